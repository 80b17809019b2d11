#include "core/math/octahedral.h"

#include <algorithm>
#include <cmath>

#include "core/math/sampling.h"

namespace core {

glm::vec3 direction_from_octahedral(const glm::vec2& point) {
    const glm::vec2 p = 2.0f * point - 1.0f;
    const glm::vec2 a = glm::abs(p);
    const float signed_distance = 1.0f - (a.x + a.y);  // From the square's inner diamond, the equator.
    const float radius = 1.0f - std::abs(signed_distance);
    const float phi = radius == 0.0f ? 0.25f * kPi : 0.25f * kPi * ((a.y - a.x) / radius + 1.0f);
    // r sqrt(2 - r^2) is sqrt(1 - z^2) without its cancellation at the poles.
    const float z = 1.0f - radius * radius;
    const float planar = radius * std::sqrt(2.0f - radius * radius);
    return {std::copysign(planar * std::cos(phi), p.x), std::copysign(planar * std::sin(phi), p.y),
            std::copysign(z, signed_distance)};
}

glm::vec2 octahedral_from_direction(const glm::vec3& direction) {
    const glm::vec3 a = glm::abs(direction);
    const float planar2 = a.x * a.x + a.y * a.y;
    // sqrt(1 - |z|), without its cancellation at the poles.
    const float radius = std::sqrt(planar2 / (1.0f + std::min(a.z, 1.0f)));
    const float larger = std::max(a.x, a.y);
    const float smaller = std::min(a.x, a.y);
    float share = larger > 0.0f ? std::atan(smaller / larger) * (2.0f / kPi) : 0.0f;
    if (a.x < a.y) share = 1.0f - share;
    glm::vec2 p(radius - radius * share, radius * share);
    if (direction.z < 0.0f) p = glm::vec2(1.0f - p.y, 1.0f - p.x);
    p = glm::clamp(p, 0.0f, 1.0f);
    return 0.5f * glm::vec2(std::copysign(p.x, direction.x), std::copysign(p.y, direction.y)) + 0.5f;
}

glm::ivec2 wrap_octahedral_texel(const glm::ivec2& texel, int resolution) {
    int x = texel.x;
    int y = texel.y;
    if (x < 0) {
        x = -1 - x;
        y = resolution - 1 - y;
    } else if (x >= resolution) {
        x = 2 * resolution - 1 - x;
        y = resolution - 1 - y;
    }
    if (y < 0) {
        y = -1 - y;
        x = resolution - 1 - x;
    } else if (y >= resolution) {
        y = 2 * resolution - 1 - y;
        x = resolution - 1 - x;
    }
    return {x, y};
}

}  // namespace core
