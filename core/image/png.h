// core/image/png.h: 8-bit sRGB previews.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace core {

/// The bytes of a PNG file of an opaque 8-bit RGB picture, top row first.
/// @pre rgb.size() == 3 * width * height > 0, less than 2^31 bytes with one more a row
/// @throws InputError kOutOfMemory
std::string encode_png(int width, int height, std::span<const std::uint8_t> rgb);

/// Writes an opaque 8-bit RGB picture atomically, top row first.
/// @pre rgb.size() == 3 * width * height > 0
/// @throws InputError kCannotCreate or kInputOutput; kUsage where the picture has 2^31 bytes or more
void write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace core
