// core/math/spherical_harmonics.h: real spherical harmonics of third order (nine functions).
//
// Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001.
// Order of the nine: 1; y, z, x; xy, yz, 3z^2 - 1, xz, x^2 - y^2.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>

namespace core {

inline constexpr std::size_t kShCount = 9;

/// One number a function: values at a direction, or coefficients of a scalar.
using Sh = std::array<float, kShCount>;

/// Coefficients of a colour.
using ShColor = std::array<glm::vec3, kShCount>;

/// The orthonormal functions at a unit direction.
Sh sh_basis(const glm::vec3& direction);

/// Coefficients of the clamped cosine about a unit normal: sh_basis times (pi, 2 pi / 3, pi / 4) by band.
Sh sh_clamped_cosine(const glm::vec3& normal);

inline float sh_dot(const Sh& a, const Sh& b) {
    float sum = 0.0f;
    for (std::size_t i = 0; i < kShCount; ++i) sum += a[i] * b[i];
    return sum;
}
inline glm::vec3 sh_dot(const ShColor& a, const Sh& b) {
    glm::vec3 sum(0.0f);
    for (std::size_t i = 0; i < kShCount; ++i) sum += a[i] * b[i];
    return sum;
}

}  // namespace core
