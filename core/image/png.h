// core/image/png.h: 8-bit sRGB previews.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace core {

/// Writes an opaque 8-bit RGB picture atomically, top row first.
/// @pre rgb.size() == 3 * width * height > 0
/// @throws InputError kCannotCreate or kInputOutput; kUsage where the picture has 2^31 bytes or more
void write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace core
