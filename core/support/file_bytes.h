// core/support/file_bytes.h: a whole file in memory, for decoders that check before they trust.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace core {

/// Reads a regular file. Pipes and devices are refused before they are opened: they could block or never end.
/// @throws InputError kNoInput where there is no readable regular file; kBadData beyond `max_bytes`;
/// kInputOutput where reading fails
std::vector<std::uint8_t> read_file_bytes(const std::filesystem::path& path, std::uint64_t max_bytes);

}  // namespace core
