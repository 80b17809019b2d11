#include "core/scene/texture.h"

#include <fmt/format.h>
#include <stb/stb_image.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "core/image/tonemap.h"
#include "core/support/error.h"
#include "core/support/memory.h"

namespace core {

namespace {

constexpr std::uint64_t kMaximumTexelCount = std::uint64_t{1} << 28;

/// Texels that one encoded byte can stand for at most. PNG: deflate's 1032 bytes of 8 one-bit texels. JPEG:
/// one bit a block of 64 in each of the scans that stb reads. Headers that promise more are lies, and are
/// refused before memory is taken.
constexpr std::uint64_t kMaximumTexelsPerByte = 8 * 1032;
constexpr std::uint64_t kMaximumTexelsPerJpegByte = 1024;

bool starts_with(std::span<const std::uint8_t> bytes, std::initializer_list<std::uint8_t> prefix) {
    return bytes.size() >= prefix.size() && std::equal(prefix.begin(), prefix.end(), bytes.begin());
}

bool is_png(std::span<const std::uint8_t> bytes) {
    return starts_with(bytes, {0x89, 'P', 'N', 'G'});
}

[[noreturn]] void refuse(const std::string& name, const std::string& reason) {
    throw InputError(ErrorKind::kBadData, fmt::format("image '{}': {}", name, reason));
}

/// stb takes as much memory as a chunk claims to be long before it looks for its bytes.
void check_png_chunks(std::span<const std::uint8_t> encoded, const std::string& name) {
    constexpr std::size_t kSignature = 8;
    constexpr std::size_t kChunkHeader = 8;
    constexpr std::size_t kChecksum = 4;
    std::size_t offset = kSignature;
    while (offset <= encoded.size() && encoded.size() - offset >= kChunkHeader) {
        const std::uint8_t* chunk = encoded.data() + offset;
        const std::uint64_t length = std::uint64_t{chunk[0]} << 24 | std::uint64_t{chunk[1]} << 16 |
                                     std::uint64_t{chunk[2]} << 8 | chunk[3];
        const std::size_t left = encoded.size() - offset - kChunkHeader;
        if (length > left) {
            refuse(name, fmt::format("claims a chunk of {} bytes where {} are left; the file is damaged",
                                     length, left));
        }
        if (std::equal(chunk + 4, chunk + 8, "IEND")) return;
        offset += kChunkHeader + static_cast<std::size_t>(length) + kChecksum;
    }
}

std::array<float, 256> make_srgb_table() {
    std::array<float, 256> table{};
    for (int code = 0; code < 256; ++code) table[code] = linear_from_srgb(code / 255.0);
    return table;
}

std::array<float, 256> make_linear_table() {
    std::array<float, 256> table{};
    for (int code = 0; code < 256; ++code) table[code] = static_cast<float>(code / 255.0);
    return table;
}

const std::array<float, 256> kLinearFromSrgb = make_srgb_table();
const std::array<float, 256> kUnitFromByte = make_linear_table();

/// The coordinate brought to one period ([0, 1], or [0, 2] where mirrored), so that products with the size
/// stay exact and in range of int.
float wrap_coordinate(float u, TextureWrap wrap) {
    if (!std::isfinite(u)) return 0.0f;
    switch (wrap) {
        case TextureWrap::kRepeat:
            return u - std::floor(u);
        case TextureWrap::kClampToEdge:
            return std::clamp(u, 0.0f, 1.0f);
        case TextureWrap::kMirroredRepeat:
            break;
    }
    return u - 2.0f * std::floor(0.5f * u);
}

/// A texel index at most one period off, brought into [0, size).
int wrap_index(int index, int size, TextureWrap wrap) {
    switch (wrap) {
        case TextureWrap::kRepeat:
            if (index < 0) return index + size;
            return index >= size ? index - size : index;
        case TextureWrap::kClampToEdge:
            return std::clamp(index, 0, size - 1);
        case TextureWrap::kMirroredRepeat:
            break;
    }
    if (index < 0) return -1 - index;
    if (index >= 2 * size) return index - 2 * size;
    return index >= size ? 2 * size - 1 - index : index;
}

glm::vec4 texel(const TextureImage& image, int x, int y, const std::array<float, 256>& color_table) {
    const std::uint8_t* rgba = &image.rgba[4 * (static_cast<std::size_t>(y) * image.width + x)];
    return {color_table[rgba[0]], color_table[rgba[1]], color_table[rgba[2]], kUnitFromByte[rgba[3]]};
}

/// Asks for what decoding takes at its peak: rows before and after filtering, the four channels, and tables.
void require_texture_memory(const glm::ivec2& size, const std::string& name) {
    constexpr std::uint64_t kBytesPerTexel = 12, kTables = 1 << 20;
    require_memory(
        kBytesPerTexel * static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) + kTables,
        fmt::format("image '{}' of {} x {} texels", name, size.x, size.y));
}

/// Grey in all colours where there is one channel or two; opaque where there is no alpha.
std::vector<std::uint8_t> with_four_channels(const std::uint8_t* pixels, int channel_count,
                                             std::size_t pixel_count) {
    std::vector<std::uint8_t> rgba(4 * pixel_count);
    const bool has_color = channel_count >= 3, has_alpha = channel_count % 2 == 0;
    for (std::size_t i = 0; i < pixel_count; ++i) {
        const std::uint8_t* source = pixels + static_cast<std::size_t>(channel_count) * i;
        std::uint8_t* target = rgba.data() + 4 * i;
        for (int color = 0; color < 3; ++color) target[color] = source[has_color ? color : 0];
        target[3] = has_alpha ? source[channel_count - 1] : 255;
    }
    return rgba;
}

}  // namespace

bool is_texture_image(std::span<const std::uint8_t> encoded) {
    return is_png(encoded) || starts_with(encoded, {0xff, 0xd8, 0xff});
}

glm::ivec2 texture_image_size(std::span<const std::uint8_t> encoded, const std::string& name) {
    if (!is_texture_image(encoded)) refuse(name, "is neither PNG nor JPEG, the two formats of glTF");
    const bool png = is_png(encoded);
    if (encoded.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
        refuse(name, "holds more than 2^31 bytes");
    }
    if (png) check_png_chunks(encoded, name);
    const int byte_count = static_cast<int>(encoded.size());
    int width = 0;
    int height = 0;
    int channel_count = 0;
    if (!stbi_info_from_memory(encoded.data(), byte_count, &width, &height, &channel_count) || width <= 0 ||
        height <= 0) {
        refuse(name, "has no readable PNG or JPEG header");
    }
    const std::uint64_t texel_count = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    const std::uint64_t plausible =
        encoded.size() * (png ? kMaximumTexelsPerByte : kMaximumTexelsPerJpegByte);
    if (texel_count > kMaximumTexelCount) {
        refuse(name, fmt::format("is {} x {} texels; at most 2^28 in all are read", width, height));
    }
    if (texel_count > plausible) {
        refuse(name, fmt::format("claims {} x {} texels in {} bytes; the file is damaged", width, height,
                                 encoded.size()));
    }
    return {width, height};
}

TextureImage decode_texture_image(std::span<const std::uint8_t> encoded, const std::string& name) {
    const glm::ivec2 size = texture_image_size(encoded, name);
    require_texture_memory(size, name);
    TextureImage image;
    image.name = name;
    image.width = size.x;
    image.height = size.y;
    // As many channels as the file has: four would be made beside them, and the peak is what limits count.
    int channel_count = 0;
    const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
        stbi_load_from_memory(encoded.data(), static_cast<int>(encoded.size()), &image.width, &image.height,
                              &channel_count, 0),
        stbi_image_free);
    if (!pixels) {
        // stb takes what it had no memory for to be another format, and gives that format's reason.
        const std::string reason = stbi_failure_reason();
        require_texture_memory(size, name);
        refuse(name, fmt::format("cannot be decoded ({})", reason));
    }
    image.rgba = with_four_channels(pixels.get(), channel_count,
                                    static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
    return image;
}

glm::vec4 sample_texture(const Texture& texture, const TextureImage& image, const glm::vec2& uv, bool srgb) {
    const std::array<float, 256>& table = srgb ? kLinearFromSrgb : kUnitFromByte;
    const float x = wrap_coordinate(uv.x, texture.wrap_u) * static_cast<float>(image.width);
    const float y = wrap_coordinate(uv.y, texture.wrap_v) * static_cast<float>(image.height);
    if (texture.nearest) {
        return texel(image, wrap_index(static_cast<int>(x), image.width, texture.wrap_u),
                     wrap_index(static_cast<int>(y), image.height, texture.wrap_v), table);
    }
    const float left = std::floor(x - 0.5f);
    const float top = std::floor(y - 0.5f);
    const float fx = x - 0.5f - left;
    const float fy = y - 0.5f - top;
    const int x0 = wrap_index(static_cast<int>(left), image.width, texture.wrap_u);
    const int x1 = wrap_index(static_cast<int>(left) + 1, image.width, texture.wrap_u);
    const int y0 = wrap_index(static_cast<int>(top), image.height, texture.wrap_v);
    const int y1 = wrap_index(static_cast<int>(top) + 1, image.height, texture.wrap_v);
    const glm::vec4 upper = (1.0f - fx) * texel(image, x0, y0, table) + fx * texel(image, x1, y0, table);
    const glm::vec4 lower = (1.0f - fx) * texel(image, x0, y1, table) + fx * texel(image, x1, y1, table);
    return (1.0f - fy) * upper + fy * lower;
}

}  // namespace core
