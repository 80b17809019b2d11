// core/math/octahedral.h: the sphere as a square, with equal areas.
//
// Clarberg, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", JGT 2008. Every texel of an N x N map
// covers 4 pi / N^2, and its quarters cover a quarter each. The square's centre is +Z, its corners are -Z.
#pragma once

#include <glm/glm.hpp>

namespace core {

/// The unit direction of a point of [0, 1]^2.
glm::vec3 direction_from_octahedral(const glm::vec2& point);

/// The inverse. @param direction unit
glm::vec2 octahedral_from_direction(const glm::vec3& direction);

/// The texel of an N x N map that a texel just outside of it continues in.
/// @param texel components in [-1, resolution]
glm::ivec2 wrap_octahedral_texel(const glm::ivec2& texel, int resolution);

}  // namespace core
