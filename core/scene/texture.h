// core/scene/texture.h: decoded pictures and how a material looks them up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

namespace core {

/// A decoded image: 8-bit RGBA, row 0 at v = 0 (glTF's top), row-major.
struct TextureImage {
    std::string name;
    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> rgba;  ///< 4 x width x height.
};

enum class TextureWrap : std::uint8_t { kRepeat, kClampToEdge, kMirroredRepeat };

/// An image with its sampler. Colour textures are sRGB-encoded, data textures are linear.
struct Texture {
    std::uint32_t image = 0;  ///< Index into Scene::images.
    TextureWrap wrap_u = TextureWrap::kRepeat;
    TextureWrap wrap_v = TextureWrap::kRepeat;
    bool nearest = false;  ///< Nearest texel instead of bilinear; there are no mip levels.
};

/// Whether bytes begin as PNG or JPEG do.
bool is_texture_image(std::span<const std::uint8_t> encoded);

/// Width and height of a PNG or JPEG held in memory, from its header alone. `name` is used in messages.
/// @throws InputError as decode_texture_image does
glm::ivec2 texture_image_size(std::span<const std::uint8_t> encoded, const std::string& name);

/// Decodes a PNG or JPEG held in memory.
/// @throws InputError (kBadData) for anything stb cannot read, and for more than 2^28 texels.
TextureImage decode_texture_image(std::span<const std::uint8_t> encoded, const std::string& name);

/// The texel value at `uv`, filtered in linear space: RGB through the sRGB curve if `srgb`, alpha always
/// linear. Any finite uv is valid; a non-finite one reads uv = 0.
glm::vec4 sample_texture(const Texture& texture, const TextureImage& image, const glm::vec2& uv, bool srgb);

}  // namespace core
