#include "gather/screen_probes/interpolation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace gather {

namespace {

/// Keeps probes that were moved within their tile, off the regular grid, from falling out altogether.
constexpr float kLeastCorner = 1e-3f;

/// Below this no probe lies on the point's surface.
constexpr float kLeastSupport = 1e-3f;

/// Of a length to divide by.
constexpr float kLeastSpacing = std::numeric_limits<float>::min();

/// Halvings by the plane distance beyond which a weight is 0.
constexpr float kGone = 40.0f;

/// Normals whose cosine is less share nothing.
constexpr float kLeastConvexCosine = 0.5f;
constexpr float kLeastConcaveCosine = 0.0f;

/// @param offset from the point with the first normal to the one with the second
float plane_distance(const glm::vec3& offset, const glm::vec3& normal, const glm::vec3& other) {
    return std::max(std::abs(glm::dot(offset, normal)), std::abs(glm::dot(offset, other)));
}

float normal_weight(const glm::vec3& offset, const glm::vec3& normal, const glm::vec3& other) {
    // The sum of what each point lies above the other's plane: below 0 the surface between them is convex.
    const bool convex = glm::dot(offset, normal - other) < 0.0f;
    const float least = convex ? kLeastConvexCosine : kLeastConcaveCosine;
    return glm::clamp(2.0f * (glm::dot(normal, other) - least), 0.0f, 1.0f);
}

float weight_at(float relative_distance, float sharpness) {
    const float halvings = sharpness * relative_distance * relative_distance;
    if (halvings < 1e-4f) return 1.0f;  // In the plane, as most are.
    return std::exp2(-halvings);
}

float tent(const glm::vec2& offset, float radius) {
    const glm::vec2 t = glm::max(glm::vec2(0.0f), 1.0f - glm::abs(offset) / radius);
    return t.x * t.y;
}

}  // namespace

float surface_weight(const glm::vec3& position, const glm::vec3& normal, float plane_scale,
                     const glm::vec3& other, const glm::vec3& other_normal, float sharpness) {
    const glm::vec3 offset = other - position;
    return weight_at(plane_distance(offset, normal, other_normal) / plane_scale, sharpness) *
           normal_weight(offset, normal, other_normal);
}

bool is_same_plane(const core::SurfacePoint& point, float plane_scale, const core::SurfacePoint& other,
                   float sharpness) {
    constexpr float kSamePlane = 0.5f;
    if (other.triangle == point.triangle && other.instance == point.instance) return true;
    return surface_weight(point.position, point.geometric_normal, plane_scale, other.position,
                          other.geometric_normal, sharpness) > kSamePlane;
}

ProbeWeights find_probes(const ProbeAtlas& atlas, const ProbeReader& reader, float sharpness) {
    ProbeWeights result;
    const auto spacing = static_cast<float>(atlas.spacing);
    const glm::ivec2 tile(static_cast<int>(reader.pixel.x) / atlas.spacing,
                          static_cast<int>(reader.pixel.y) / atlas.spacing);
    const auto own = static_cast<std::size_t>(tile.y * atlas.tiles_x + tile.x);
    const float to_relative = 1.0f / reader.plane_scale;
    std::array<float, ProbeWeights::kMost> on_surface_of{};
    atlas.for_probes_around(glm::ivec2(reader.pixel), [&](std::size_t index) {
        const Probe& probe = atlas.probes[index];
        if (!probe.valid()) return;
        const float corner = std::max(index == own ? kLeastCorner : 0.0f,
                                      tent(glm::vec2(probe.pixel) - reader.pixel, spacing));
        if (!(corner > 0.0f)) return;
        const glm::vec3 offset = probe.position - reader.position;
        const float facing = normal_weight(offset, reader.normal, probe.normal);
        const float distance = plane_distance(offset, reader.normal, probe.normal) * to_relative;
        if (!(facing > 0.0f) || sharpness * distance * distance > kGone) return;
        const float on_surface = corner * facing * weight_at(distance, sharpness);
        // A ratio first: the squares of very small lengths are 0.
        const float spacings = glm::length(offset) / std::max(reader.spacing, kLeastSpacing);
        const float spacings2 = spacings * spacings;
        const float weight = on_surface / (1.0f + spacings2 * spacings2);
        std::size_t at = result.count;
        if (at < ProbeWeights::kMost) {
            ++result.count;
        } else {
            // Where probes crowd, those that matter most.
            at = static_cast<std::size_t>(std::ranges::min_element(result.weight) - result.weight.begin());
            if (!(weight > result.weight[at])) return;
            result.support -= result.weight[at];
            result.surface_support -= on_surface_of[at];
        }
        result.probe[at] = static_cast<std::uint32_t>(index);
        result.weight[at] = weight;
        on_surface_of[at] = on_surface;
        result.support += weight;
        result.surface_support += on_surface;
    });
    if (result.surface_support >= kLeastSupport) {
        for (std::size_t i = 0; i < result.count; ++i) result.weight[i] /= result.support;
        return result;
    }
    result.confident = false;
    result.count = 0;
    float least_badness = std::numeric_limits<float>::infinity();
    atlas.for_probes_around(glm::ivec2(reader.pixel), [&](std::size_t index) {
        const Probe& probe = atlas.probes[index];
        if (!probe.valid()) return;
        const glm::vec3 offset = probe.position - reader.position;
        // One that faces elsewhere stands in only where there is no other.
        const float badness =
            plane_distance(offset, reader.normal, probe.normal) +
            (1.0f - normal_weight(offset, reader.normal, probe.normal)) * reader.plane_scale;
        if (!(badness < least_badness)) return;
        least_badness = badness;
        result.probe[0] = static_cast<std::uint32_t>(index);
        result.weight[0] = 1.0f;
        result.count = 1;
    });
    return result;
}

}  // namespace gather
