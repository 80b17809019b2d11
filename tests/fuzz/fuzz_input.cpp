#include "tests/fuzz/fuzz_input.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <system_error>

#include "core/support/error.h"
#include "core/support/parallel.h"

namespace fuzz {

namespace fs = std::filesystem;

namespace {

int accepted_read_count = 0;

class OwnFolder {
public:
    OwnFolder() : path_(fs::temp_directory_path() / ("fieldlight_fuzz_" + std::to_string(getpid()))) {
        fs::create_directories(path_);
    }
    ~OwnFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    OwnFolder(const OwnFolder&) = delete;
    OwnFolder& operator=(const OwnFolder&) = delete;

    const fs::path& path() const { return path_; }

private:
    fs::path path_;
};

}  // namespace

fs::path input_file(const std::string& name, std::span<const std::uint8_t> bytes) {
    static const OwnFolder folder;
    fs::path path = folder.path() / name;
    std::FILE* file = std::fopen(path.c_str(), "wb");
    const bool written = file && std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    if (!file || std::fclose(file) != 0 || !written) {
        std::fprintf(stderr, "'%s' cannot be written\n", path.c_str());
        std::abort();
    }
    return path;
}

void read_or_refuse(const std::function<void()>& read) {
    try {
        core::with_thread_limit(1, read);
        ++accepted_read_count;
    } catch (const core::InputError&) {
        // Refusing is an answer.
    }
}

int accepted_reads() {
    return accepted_read_count;
}

}  // namespace fuzz
