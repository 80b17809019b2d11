#include "tests/support/shared_data.h"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <string>

namespace tests {

namespace fs = std::filesystem;

std::optional<fs::path> shared_folder() {
    if (const char* configured = std::getenv("FIELDLIGHT_SHARED"); configured && *configured) {
        return fs::path(configured);
    }
    const fs::path beside = fs::path(FIELDLIGHT_SOURCE_DIR).parent_path() / "shared";
    if (fs::exists(beside / "scenes")) return beside;
    return std::nullopt;
}

fs::path assets_folder() {
    return fs::path(FIELDLIGHT_SOURCE_DIR) / "assets";
}

TemporaryFolder::TemporaryFolder() {
    static std::atomic<int> counter{0};
    path_ = fs::temp_directory_path() /
            ("fieldlight_test_" + std::to_string(getpid()) + "_" + std::to_string(counter++));
    fs::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

}  // namespace tests
