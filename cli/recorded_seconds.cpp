#include "cli/recorded_seconds.h"

#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "core/support/file_bytes.h"

namespace cli {

void record_seconds(const std::filesystem::path& file, const std::string& key, double seconds) {
    const nlohmann::json record = {{"schema", 1}, {"of", key}, {"seconds", seconds}};
    core::write_text_atomically(file, record.dump() + "\n");
}

std::optional<double> recorded_seconds(const std::filesystem::path& file, const std::string& key) {
    constexpr std::uint64_t kMostBytes = 4096;
    if (std::error_code error; !std::filesystem::is_regular_file(file, error)) return std::nullopt;
    std::vector<std::uint8_t> bytes;
    try {
        bytes = core::read_file_bytes(file, kMostBytes);
    } catch (const core::InputError&) {
        return std::nullopt;  // A price that is not known ends no comparison.
    }
    const nlohmann::json record = nlohmann::json::parse(bytes, nullptr, false);
    if (!record.is_object() || record.value("of", nlohmann::json()) != key) return std::nullopt;
    const nlohmann::json seconds = record.value("seconds", nlohmann::json());
    if (!seconds.is_number() || !(seconds.get<double>() >= 0.0)) return std::nullopt;
    return seconds.get<double>();
}

}  // namespace cli
