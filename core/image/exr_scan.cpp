#include "core/image/exr_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <string_view>

#include "core/image/exr.h"
#include "core/support/error.h"

namespace core {

namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kTiledFlag = 0x200;
constexpr std::uint32_t kDeepFlag = 0x800;
constexpr std::uint32_t kMultiPartFlag = 0x1000;
constexpr std::size_t kMaxNameLength = 255;
constexpr std::int64_t kMaxCoordinate = 1 << 24;
constexpr std::size_t kMaxChannels = 1024;

/// Samples that a decoder may buffer beside the picture for one row of tiles: 64 MiB of floats.
constexpr std::uint64_t kMaxTileRowSamples = std::uint64_t{1} << 24;

/// One compression method: scanlines in a chunk, and how far its bytes can expand at most. Deflate reaches
/// 1,032; the others follow from their shortest codes (run lengths of 127 in RLE and 255 in PIZ's Huffman
/// codes, PXR24 drops a byte of four before deflating, B44A packs 32 bytes in 3, DWA a block of 64 values in
/// one code), rounded up.
struct Compression {
    std::uint64_t lines;
    std::uint64_t max_expansion;
};
constexpr Compression kCompressions[] = {{1, 1},     {1, 64},  {1, 1040}, {16, 1040},  {32, 2048},
                                         {16, 1400}, {32, 32}, {32, 32},  {32, 16384}, {256, 16384}};

/// Types of attributes with the bytes that OpenEXR reads for each, whatever size the file claims: with any
/// other it would go on reading in the wrong place.
struct FixedSize {
    std::string_view type;
    std::uint32_t bytes;
};
constexpr FixedSize kFixedSizes[] = {{"box2f", 16},
                                     {"box2i", 16},
                                     {"chromaticities", 32},
                                     {"compression", 1},
                                     {"deepImageState", 1},
                                     {"double", 8},
                                     {"envmap", 1},
                                     {"float", 4},
                                     {"int", 4},
                                     {"keycode", 28},
                                     {"lineOrder", 1},
                                     {"m33d", 72},
                                     {"m33f", 36},
                                     {"m44d", 128},
                                     {"m44f", 64},
                                     {"rational", 8},
                                     {"tiledesc", 9},
                                     {"timecode", 8},
                                     {"v2d", 16},
                                     {"v2f", 8},
                                     {"v2i", 8},
                                     {"v3d", 24},
                                     {"v3f", 12},
                                     {"v3i", 12}};

/// What the scan gathers on its way through the attributes.
struct Layout {
    std::optional<std::uint8_t> compression;
    std::optional<std::uint64_t> width, height;
    std::uint64_t channel_count = 0;
    std::uint64_t bytes_per_pixel = 0;
    std::uint64_t tile_width = 0, tile_height = 0;
};

class Scanner {
public:
    Scanner(std::span<const std::uint8_t> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    void scan() {
        if (bytes_.size() < 8 || read_u32() != kMagic) fail("does not start with the magic number of EXR");
        const std::uint32_t version = read_u32();
        if ((version & 0xff) > 2)
            fail(fmt::format("has version {}; only version 2 is known", version & 0xff));
        if (version & kDeepFlag) fail("holds deep data; only flat pictures can be read");
        if (version & kMultiPartFlag) fail("is a multi-part file; only files of one part can be read");
        while (peek() != 0) scan_attribute();
        check(version & kTiledFlag);
    }

private:
    [[noreturn]] void fail(const std::string& message) const {
        throw InputError(ErrorKind::kBadData, fmt::format("'{}': {}", name_, message));
    }

    std::uint8_t peek() const {
        if (position_ >= bytes_.size()) fail("ends inside its header");
        return bytes_[position_];
    }

    std::uint32_t read_u32() {
        if (bytes_.size() - position_ < 4) fail("ends inside its header");
        std::uint32_t value = 0;
        std::memcpy(&value, bytes_.data() + position_, 4);
        static_assert(std::endian::native == std::endian::little);
        position_ += 4;
        return value;
    }
    std::int32_t read_i32() { return static_cast<std::int32_t>(read_u32()); }

    std::string_view read_name(const char* what) {
        const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(position_);
        const auto limit =
            begin + static_cast<std::ptrdiff_t>(std::min(bytes_.size() - position_, kMaxNameLength + 1));
        const auto end = std::find(begin, limit, std::uint8_t{0});
        if (end == limit) fail(fmt::format("{} does not end within {} bytes", what, kMaxNameLength));
        const auto length = static_cast<std::size_t>(end - begin);
        const std::string_view text(reinterpret_cast<const char*>(bytes_.data() + position_), length);
        position_ += length + 1;
        return text;
    }

    void scan_attribute() {
        const std::string_view attribute = read_name("the name of an attribute");
        const std::string_view type = read_name("the type of an attribute");
        const std::uint32_t size = read_u32();
        if (size > bytes_.size() - position_) {
            fail(fmt::format("attribute '{}' claims {} bytes, {} are left", attribute, size,
                             bytes_.size() - position_));
        }
        const std::size_t end = position_ + size;
        const auto expect_size = [&](std::uint32_t right) {
            if (size != right)
                fail(fmt::format("attribute '{}' has {} bytes; {} are right", attribute, size, right));
        };
        for (const FixedSize& fixed : kFixedSizes) {
            if (type == fixed.type) expect_size(fixed.bytes);
        }
        if (type == "chlist") {
            scan_channels(end);
        } else if (type == "stringvector") {
            scan_strings(attribute, end);
        } else if (type == "floatvector") {
            if (size % 4 != 0) fail(fmt::format("attribute '{}' has {} bytes of floats", attribute, size));
        } else if (attribute == "dataWindow" || attribute == "displayWindow") {
            expect_size(16);
            scan_window(attribute);
        } else if (attribute == "compression") {
            expect_size(1);
            layout_.compression = bytes_[position_];
        } else if (attribute == "tiles") {
            expect_size(9);
            layout_.tile_width = read_u32();
            layout_.tile_height = read_u32();
        } else if (type == "preview") {
            if (size < 8) fail(fmt::format("attribute '{}' is too short for a preview", attribute));
            const std::uint64_t width = read_u32(), height = read_u32();
            if (width > size || height > size || width * height * 4 + 8 != size) {
                fail(fmt::format("attribute '{}' claims {} x {} pixels in {} bytes", attribute, width, height,
                                 size));
            }
        } else if (attribute == "type" && size >= 4 &&
                   std::memcmp(bytes_.data() + position_, "deep", 4) == 0) {
            fail("holds deep data; only flat pictures can be read");
        }
        position_ = end;
    }

    void scan_window(std::string_view attribute) {
        const std::int64_t min_x = read_i32(), min_y = read_i32(), max_x = read_i32(), max_y = read_i32();
        for (const std::int64_t coordinate : {min_x, min_y, max_x, max_y}) {
            if (coordinate < -kMaxCoordinate || coordinate > kMaxCoordinate) {
                fail(fmt::format("{} reaches to {}; at most +-{} is read", attribute, coordinate,
                                 kMaxCoordinate));
            }
        }
        if (attribute != "dataWindow") return;
        if (max_x < min_x || max_y < min_y) fail("dataWindow is empty; a picture needs pixels");
        layout_.width = static_cast<std::uint64_t>(max_x - min_x + 1);
        layout_.height = static_cast<std::uint64_t>(max_y - min_y + 1);
    }

    void scan_strings(std::string_view attribute, std::size_t end) {
        while (position_ < end) {
            const std::uint64_t length = end - position_ < 4 ? end : read_u32();
            if (length > end - position_) {
                fail(fmt::format("attribute '{}' holds a string that is longer than it", attribute));
            }
            position_ += static_cast<std::size_t>(length);
        }
    }

    void scan_channels(std::size_t end) {
        // A second list may replace the first in the decoder, so that only the larger sum is safe: sum both.
        while (peek() != 0) {
            const std::string_view channel = read_name("the name of a channel");
            const std::uint32_t type = read_u32();
            if (type > 2) fail(fmt::format("channel '{}' has unknown type {}", channel, type));
            read_u32();  // pLinear and three reserved bytes.
            const std::int32_t x_sampling = read_i32(), y_sampling = read_i32();
            if (x_sampling < 1 || y_sampling < 1) {
                fail(fmt::format("channel '{}' has sampling {} x {}; 1 or more is right", channel, x_sampling,
                                 y_sampling));
            }
            if (position_ >= end) fail("the list of channels is longer than its attribute");
            if (++layout_.channel_count > kMaxChannels)
                fail(fmt::format("has more than {} channels", kMaxChannels));
            // Subsampled channels count in full: the picture will hold them so.
            layout_.bytes_per_pixel += x_sampling == 1 && y_sampling == 1 ? (type == 1 ? 2 : 4) : 0;
        }
        if (position_ + 1 != end) fail("the list of channels ends elsewhere than its attribute");
    }

    void check(bool tiled) const {
        if (!layout_.width) fail("has no dataWindow");
        if (layout_.channel_count == 0) fail("has no channels");
        if (!layout_.compression || *layout_.compression >= std::size(kCompressions)) {
            fail("has an unknown compression");
        }
        const std::uint64_t width = *layout_.width, height = *layout_.height;
        const std::uint64_t samples = width * height * layout_.channel_count;
        if (width > kMaxExrDimension || height > kMaxExrDimension || width * height > kMaxExrPixels ||
            samples > kMaxExrSamples) {
            fail(fmt::format(
                "is {} x {} pixels of {} channels; at most {} a side, {} pixels and {} samples are read",
                width, height, layout_.channel_count, kMaxExrDimension, kMaxExrPixels, kMaxExrSamples));
        }
        const Compression compression = kCompressions[*layout_.compression];
        const std::uint64_t file_size = bytes_.size();
        if (width * height * layout_.bytes_per_pixel / compression.max_expansion > file_size) {
            fail(fmt::format("claims {} x {} pixels, more than its {} bytes can hold", width, height,
                             file_size));
        }
        std::uint64_t chunk_count = (height + compression.lines - 1) / compression.lines;
        if (tiled) {
            if (layout_.tile_width == 0 || layout_.tile_height == 0)
                fail("is tiled but has no size of tiles");
            const std::uint64_t row_width = std::max(width, layout_.tile_width);
            if (layout_.tile_width > kMaxExrDimension || layout_.tile_height > kMaxExrDimension ||
                row_width * layout_.tile_height * layout_.channel_count >
                    std::max(samples, kMaxTileRowSamples)) {
                fail(fmt::format("has tiles of {} x {} pixels, too large for its {} x {} pixels",
                                 layout_.tile_width, layout_.tile_height, width, height));
            }
            chunk_count = ((width + layout_.tile_width - 1) / layout_.tile_width) *
                          ((height + layout_.tile_height - 1) / layout_.tile_height);
        }
        if (chunk_count * 8 > file_size - position_) {
            fail(fmt::format("ends inside its table of {} chunks", chunk_count));
        }
    }

    std::span<const std::uint8_t> bytes_;
    const std::string& name_;
    std::size_t position_ = 0;
    Layout layout_;
};

}  // namespace

void scan_exr_header(std::span<const std::uint8_t> bytes, const std::string& name) {
    Scanner(bytes, name).scan();
}

}  // namespace core
