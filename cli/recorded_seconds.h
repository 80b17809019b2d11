// cli/recorded_seconds.h: what a result that is kept between runs once cost, in a small file beside it. The
// result itself must not depend on time.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace cli {

/// Writes `{"schema":1,"of":KEY,"seconds":S}`. @param key of the result, by which it is known again
/// @throws core::InputError where the file cannot be written
void record_seconds(const std::filesystem::path& file, const std::string& key, double seconds);

/// What was recorded for the same key; nothing where there is no such record, or none that can be read.
std::optional<double> recorded_seconds(const std::filesystem::path& file, const std::string& key);

}  // namespace cli
