// cli/report_encode.h: values as text that a page can hold and a browser can turn back into the same values.
//
// Bytes of equal weight are brought together first (all lowest bytes, then all second ones, ...), since those
// resemble each other; then zlib (RFC 1950, what browsers call "deflate"), then base64 (RFC 4648).
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <string>
#include <string_view>

namespace cli {

std::string base64(std::string_view bytes);

/// The bytes compressed by zlib at its highest level. @throws std::bad_alloc
std::string deflated(std::string_view bytes);

/// Exactly these colours as text: three planes (R, G, B) of little-endian float32, bytes of equal weight
/// together in each plane: 12 runs of colors.size() bytes.
std::string encode_colors(std::span<const glm::vec3> colors);

/// Values as 16-bit steps of `scale` / 65534, rounded, as text: all low bytes, then all high bytes. Values
/// outside [0, scale] are clamped; 65535 is a value that is not finite. @pre scale > 0
std::string encode_map(std::span<const float> values, float scale);

}  // namespace cli
