#include "core/image/hdr.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <vector>

#include "core/support/error.h"
#include "core/support/file_bytes.h"
#include "core/support/memory.h"

namespace core {

namespace {

constexpr std::uint64_t kMaxFileBytes = std::uint64_t{1} << 32;
constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;
constexpr int kMaxDimension = 1 << 16;

/// Runs by component reach 16, the old runs of whole pixels 64 (more only where digits are chained, which
/// only a picture of one colour could use).
constexpr std::uint64_t kMaxPixelsPerByte = 64;

constexpr std::size_t kMaxHeaderLine = 4096;

/// Widths outside these bounds cannot be run-length encoded by component.
constexpr int kMinEncodedWidth = 8;
constexpr int kMaxEncodedWidth = 0x7fff;

using Rgbe = std::array<std::uint8_t, 4>;

class HdrDecoder {
public:
    HdrDecoder(std::span<const std::uint8_t> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    Image decode() {
        read_header();
        read_resolution();
        Image image(width_, height_);
        require_memory(3 * sizeof(float) * image.pixel_count(),
                       fmt::format("'{}': {} x {} pixels", name_, width_, height_));
        std::array<std::vector<float>, 3> planes;
        for (std::vector<float>& plane : planes) plane.resize(image.pixel_count());
        std::vector<Rgbe> scanline(static_cast<std::size_t>(width_));
        std::size_t pixel = 0;
        for (row_ = 0; row_ < height_; ++row_) {
            read_scanline(scanline);
            for (const Rgbe& value : scanline) {
                // A zero exponent is black, whatever the mantissas hold.
                const double scale = value[3] == 0 ? 0.0 : std::ldexp(1.0, value[3] - (128 + 8)) / exposure_;
                for (std::size_t i = 0; i < 3; ++i) planes[i][pixel] = static_cast<float>(value[i] * scale);
                ++pixel;
            }
        }
        for (std::size_t i = 0; i < 3; ++i) image.add_channel(std::string(1, "RGB"[i]), std::move(planes[i]));
        return image;
    }

private:
    [[noreturn]] void fail(const std::string& message) const {
        throw InputError(ErrorKind::kBadData, fmt::format("'{}': {}", name_, message));
    }

    std::size_t left() const { return bytes_.size() - position_; }

    std::string_view read_line() {
        const char* begin = reinterpret_cast<const char*>(bytes_.data() + position_);
        const std::size_t limit = std::min(left(), kMaxHeaderLine);
        const void* newline = limit == 0 ? nullptr : std::memchr(begin, '\n', limit);
        if (!newline) fail("ends inside its header, or holds a line beyond 4,096 bytes there");
        const std::string_view line(begin,
                                    static_cast<std::size_t>(static_cast<const char*>(newline) - begin));
        position_ += line.size() + 1;
        return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
    }

    void read_header() {
        if (left() < 2 || bytes_[0] != '#' || bytes_[1] != '?')
            fail("does not start with '#?' as Radiance files do");
        read_line();
        while (true) {
            const std::string_view line = read_line();
            if (line.empty()) return;
            if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe") {
                fail(fmt::format("has {}; only 32-bit_rle_rgbe can be read", line));
            }
            if (line.starts_with("EXPOSURE=")) read_exposure(line.substr(std::strlen("EXPOSURE=")));
        }
    }

    /// Several exposures multiply: each program along the way adds its own.
    void read_exposure(std::string_view text) {
        while (text.starts_with(' ')) text.remove_prefix(1);
        double value = 0.0;
        const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
        if (result.ec == std::errc()) exposure_ *= value;
        if (result.ec != std::errc() || !(value > 0.0) || !(exposure_ > 1e-20) || !(exposure_ < 1e20)) {
            fail(fmt::format("has EXPOSURE={}; a positive number between 1e-20 and 1e20 is right", text));
        }
    }

    void read_resolution() {
        const std::string line(read_line());
        char axis_y[3] = {}, axis_x[3] = {};
        int end = 0;
        const int fields =
            std::sscanf(line.c_str(), "%2s %9d %2s %9d%n", axis_y, &height_, axis_x, &width_, &end);
        if (fields != 4 || static_cast<std::size_t>(end) != line.size() || std::string_view(axis_y) != "-Y" ||
            std::string_view(axis_x) != "+X") {
            fail(fmt::format("has the resolution line '{}'; only '-Y height +X width' can be read", line));
        }
        if (width_ < 1 || height_ < 1 || width_ > kMaxDimension || height_ > kMaxDimension ||
            static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_) > kMaxPixels) {
            fail(fmt::format("is {} x {} pixels; 1 to {} a side and at most {} pixels are read", width_,
                             height_, kMaxDimension, kMaxPixels));
        }
        const std::uint64_t pixels = static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_);
        if (pixels > kMaxPixelsPerByte * left()) {
            fail(fmt::format("claims {} x {} pixels, more than its {} bytes can hold", width_, height_,
                             left()));
        }
    }

    std::uint8_t read_byte() {
        if (left() == 0) fail(fmt::format("ends inside scanline {} of {}", row_, height_));
        return bytes_[position_++];
    }

    Rgbe read_rgbe() {
        if (left() < 4) fail(fmt::format("ends inside scanline {} of {}", row_, height_));
        Rgbe value;
        std::memcpy(value.data(), bytes_.data() + position_, 4);
        position_ += 4;
        return value;
    }

    void read_scanline(std::vector<Rgbe>& scanline) {
        const Rgbe first = read_rgbe();
        const bool by_component = width_ >= kMinEncodedWidth && width_ <= kMaxEncodedWidth && first[0] == 2 &&
                                  first[1] == 2 && first[2] < 128;
        if (!by_component) {
            position_ -= 4;
            read_flat(scanline);
            return;
        }
        const int claimed = first[2] * 256 + first[3];
        if (claimed != width_) {
            fail(fmt::format("scanline {} claims {} pixels; {} are right", row_, claimed, width_));
        }
        for (std::size_t component = 0; component < 4; ++component) read_component(scanline, component);
    }

    void read_component(std::vector<Rgbe>& scanline, std::size_t component) {
        std::size_t x = 0;
        while (x < scanline.size()) {
            const std::uint8_t code = read_byte();
            const bool run = code > 128;
            const std::size_t count = run ? code - 128u : code;
            if (count == 0 || count > scanline.size() - x) {
                fail(fmt::format("scanline {} holds a run of {} values where {} are left", row_, count,
                                 scanline.size() - x));
            }
            const std::uint8_t repeated = run ? read_byte() : std::uint8_t{0};
            for (const std::size_t end = x + count; x < end; ++x) {
                scanline[x][component] = run ? repeated : read_byte();
            }
        }
    }

    /// Pixels as they are, with the old run lengths: (1, 1, 1, n) repeats the last pixel n times, and the n
    /// of consecutive ones are digits of base 256, lowest first.
    void read_flat(std::vector<Rgbe>& scanline) {
        std::size_t x = 0;
        int shift = 0;
        while (x < scanline.size()) {
            const Rgbe value = read_rgbe();
            if (value[0] != 1 || value[1] != 1 || value[2] != 1) {
                scanline[x++] = value;
                shift = 0;
                continue;
            }
            const std::size_t count = shift > 16 ? scanline.size() + 1 : std::size_t{value[3]} << shift;
            if (x == 0 || count > scanline.size() - x) {
                fail(fmt::format("scanline {} repeats a pixel beyond its {} pixels", row_, width_));
            }
            std::fill_n(scanline.begin() + static_cast<std::ptrdiff_t>(x), count, scanline[x - 1]);
            x += count;
            shift += 8;
        }
    }

    std::span<const std::uint8_t> bytes_;
    const std::string& name_;
    std::size_t position_ = 0;
    double exposure_ = 1.0;
    int width_ = 0;
    int height_ = 0;
    int row_ = 0;
};

}  // namespace

Image read_hdr(const std::filesystem::path& path) {
    return decode_hdr(read_file_bytes(path, kMaxFileBytes), path.string());
}

Image decode_hdr(std::span<const std::uint8_t> bytes, const std::string& name) {
    return HdrDecoder(bytes, name).decode();
}

}  // namespace core
