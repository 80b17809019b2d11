// core/math/ray.h: one ray, and the index that points nowhere.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

namespace core {

/// Stands for "no instance", "no triangle", "no entry".
inline constexpr std::uint32_t kNoIndex = std::numeric_limits<std::uint32_t>::max();

/// One ray: points origin + t direction for t in [t_min, t_max]. The direction has unit length, so t is world
/// distance. `seed` decides the stochastic transparency of BLEND materials and nothing else.
struct Ray {
    glm::vec3 origin{0.0f};
    float t_min = 0.0f;
    glm::vec3 direction{0.0f, 0.0f, 1.0f};
    float t_max = std::numeric_limits<float>::infinity();
    std::uint32_t seed = 0;
};

}  // namespace core
