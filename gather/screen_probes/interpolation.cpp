#include "gather/screen_probes/interpolation.h"

#include <algorithm>
#include <cmath>

namespace gather {

namespace {

/// Keeps probes that were moved within their tile, off the regular grid, from falling out altogether.
constexpr float kLeastCorner = 1e-3f;

/// Below this no probe lies in the point's plane.
constexpr float kLeastSupport = 1e-6f;

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
    return std::exp2(-sharpness * relative_distance * relative_distance);
}

float tent(const glm::vec2& offset, float radius) {
    const glm::vec2 t = glm::max(glm::vec2(0.0f), 1.0f - glm::abs(offset) / radius);
    return t.x * t.y;
}

}  // namespace

float surface_weight(const glm::vec3& position, const glm::vec3& normal, float depth, const glm::vec3& other,
                     const glm::vec3& other_normal, float sharpness) {
    const glm::vec3 offset = other - position;
    return weight_at(plane_distance(offset, normal, other_normal) / depth, sharpness) *
           normal_weight(offset, normal, other_normal);
}

ProbeWeights find_probes(const ProbeAtlas& atlas, const ProbeReader& reader, float sharpness) {
    ProbeWeights result;
    const auto spacing = static_cast<float>(atlas.spacing);
    const glm::ivec2 tile(static_cast<int>(reader.pixel.x) / atlas.spacing,
                          static_cast<int>(reader.pixel.y) / atlas.spacing);
    std::uint32_t nearest = 0;
    float least_badness = std::numeric_limits<float>::infinity();
    const auto consider = [&](std::uint32_t index, float least) {
        const Probe& probe = atlas.probes[index];
        if (!probe.valid()) return;
        const glm::vec3 offset = probe.position - reader.position;
        const float distance = plane_distance(offset, reader.normal, probe.normal);
        const float facing = normal_weight(offset, reader.normal, probe.normal);
        // One that faces elsewhere stands in only where there is no other.
        const float badness = distance + (1.0f - facing) * reader.depth;
        if (badness < least_badness) {
            least_badness = badness;
            nearest = index;
        }
        const float corner = std::max(least, tent(glm::vec2(probe.pixel) - reader.pixel, spacing));
        if (!(corner > 0.0f) || result.count == ProbeWeights::kMost) return;
        const float on_surface = corner * weight_at(distance / reader.depth, sharpness) * facing;
        const float spacings2 = glm::dot(offset, offset) / (reader.spacing * reader.spacing);
        const float weight = on_surface / (1.0f + spacings2 * spacings2);
        if (!(weight > 0.0f)) return;
        result.probe[result.count] = index;
        result.weight[result.count++] = weight;
        result.support += weight;
        result.surface_support += on_surface;
    };
    const std::size_t own = static_cast<std::size_t>(tile.y * atlas.tiles_x + tile.x);
    atlas.for_probes_around(glm::ivec2(reader.pixel), [&](std::size_t index) {
        consider(static_cast<std::uint32_t>(index), index == own ? kLeastCorner : 0.0f);
    });
    if (result.support > kLeastSupport) {
        for (std::size_t i = 0; i < result.count; ++i) result.weight[i] /= result.support;
        return result;
    }
    result.confident = false;
    result.count = 0;
    if (std::isinf(least_badness)) return result;
    result.probe[0] = nearest;
    result.weight[0] = 1.0f;
    result.count = 1;
    return result;
}

}  // namespace gather
