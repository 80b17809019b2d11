// core/image/exr.h: pictures as OpenEXR files: written whole or not at all, read without trust.
//
// The only unit that sees OpenEXR. Written: one scanline part, ZIP, chromaticities of Rec. 709. Read: one
// part, scanline or tiled (level 0 of a multi-resolution file), any channel type, luminance/chroma.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "core/image/image.h"

namespace core {

/// Value of one header attribute. A matrix for column vectors, as everywhere here; the file holds it for row
/// vectors, as OpenEXR defines `worldToCamera` and `worldToNDC`.
using ExrAttribute = std::variant<std::string, float, int, glm::mat4>;

/// Attributes by name. Nothing that depends on time, threads, output path or host belongs here.
using ExrAttributes = std::map<std::string, ExrAttribute>;

/// The largest finite half.
inline constexpr float kMaxHalf = 65504.0f;

/// Limits that a file must keep before anything is decoded.
inline constexpr int kMaxExrDimension = 1 << 16;                        ///< Width and height, pixels.
inline constexpr std::uint64_t kMaxExrPixels = std::uint64_t{1} << 28;  ///< Width x height.
inline constexpr std::uint64_t kMaxExrSamples = std::uint64_t{1}
                                                << 29;  ///< Pixels x channels: 2 GiB of floats.

/// Writes every channel of `image` atomically and returns how many values were saturated (0 without `half`).
/// @param half stores colour layers (channels R, G, B, A of any layer but `Variance`) as 16-bit floats;
/// finite
///        values beyond kMaxHalf saturate and are counted, NaN and infinities stay what they are. All other
///        channels are always 32-bit floats.
/// @pre image has pixels and at least one channel.
/// @throws InputError kCannotCreate or kInputOutput
std::size_t write_exr(const std::filesystem::path& path, const Image& image,
                      const ExrAttributes& attributes = {}, bool half = false);

/// One channel as the header declares it.
struct ExrChannelInfo {
    std::string name;
    std::string type;    ///< `half`, `float` or `uint`.
    int x_sampling = 1;  ///< Every how many pixels there is a sample.
    int y_sampling = 1;
};

/// An inclusive rectangle of pixels.
struct ExrWindow {
    int min_x = 0, min_y = 0, max_x = 0, max_y = 0;

    bool operator==(const ExrWindow&) const = default;
};

/// What the header of a file says.
struct ExrInfo {
    int width = 0;  ///< Of the data window: the pixels that the file holds.
    int height = 0;
    ExrWindow data_window;
    ExrWindow display_window;
    std::string
        compression;  ///< `none`, `rle`, `zips`, `zip`, `piz`, `pxr24`, `b44`, `b44a`, `dwaa`, `dwab`.
    bool tiled = false;
    std::vector<ExrChannelInfo> channels;           ///< In the file's order, which is alphabetical.
    std::map<std::string, std::string> attributes;  ///< The other attributes, as text.
};

/// A file that was read.
struct ExrFile {
    ExrInfo info;
    Image image;  ///< The data window, top row first; every channel as float; R, G, B, A in front.
};

/// Reads the header alone. @throws InputError as read_exr does
ExrInfo read_exr_info(const std::filesystem::path& path);

/// Reads all channels of a file. Luminance/chroma (Y, RY, BY) becomes R, G, B. Integers beyond 2^24 round.
/// @throws InputError kNoInput where no regular file can be opened; kBadData for a damaged file, one beyond
/// the limits above, one with several parts, deep data, or a subsampled channel other than RY and BY, by name
ExrFile read_exr_file(const std::filesystem::path& path);

/// The picture of read_exr_file alone.
Image read_exr(const std::filesystem::path& path);

}  // namespace core
