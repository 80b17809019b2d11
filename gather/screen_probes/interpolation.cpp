#include "gather/screen_probes/interpolation.h"

#include <algorithm>
#include <cmath>

namespace gather {

namespace {

/// Keeps probes that were moved within their tile, off the regular grid, from falling out altogether.
constexpr float kLeastCorner = 1e-3f;

/// Below this no probe lies in the point's plane.
constexpr float kLeastSupport = 1e-6f;

float tent(const glm::vec2& offset, float radius) {
    const glm::vec2 t = glm::max(glm::vec2(0.0f), 1.0f - glm::abs(offset) / radius);
    return t.x * t.y;
}

}  // namespace

float plane_weight(const glm::vec3& position, const glm::vec3& normal, float depth, const glm::vec3& other,
                   float sharpness) {
    const float distance = glm::dot(other - position, normal) / depth;
    return std::exp2(-sharpness * distance * distance);
}

ProbeWeights find_probes(const ProbeAtlas& atlas, const ProbeReader& reader, float sharpness) {
    ProbeWeights result;
    const auto spacing = static_cast<float>(atlas.spacing);
    const glm::ivec2 tile(static_cast<int>(reader.pixel.x) / atlas.spacing,
                          static_cast<int>(reader.pixel.y) / atlas.spacing);
    std::uint32_t nearest = 0;
    float nearest_distance = std::numeric_limits<float>::infinity();
    const auto consider = [&](std::uint32_t index, float least) {
        const Probe& probe = atlas.probes[index];
        if (!probe.valid()) return;
        const float distance = std::abs(glm::dot(probe.position - reader.position, reader.normal));
        if (distance < nearest_distance) {
            nearest_distance = distance;
            nearest = index;
        }
        const float corner = std::max(least, tent(glm::vec2(probe.pixel) - reader.pixel, spacing));
        if (!(corner > 0.0f) || result.count == ProbeWeights::kMost) return;
        const float weight =
            corner * plane_weight(reader.position, reader.normal, reader.depth, probe.position, sharpness);
        if (!(weight > 0.0f)) return;
        result.probe[result.count] = index;
        result.weight[result.count++] = weight;
        result.support += weight;
    };
    const glm::ivec2 first = glm::max(tile - 1, glm::ivec2(0));
    const glm::ivec2 last = glm::min(tile + 1, glm::ivec2(atlas.tiles_x - 1, atlas.tiles_y - 1));
    for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
            consider(static_cast<std::uint32_t>(y * atlas.tiles_x + x),
                     glm::ivec2(x, y) == tile ? kLeastCorner : 0.0f);
        }
    }
    if (!atlas.adaptive_begin.empty()) {
        for (int y = first.y; y <= last.y; ++y) {
            // Tiles of a row are neighbours in the list.
            const auto row = static_cast<std::size_t>(y * atlas.tiles_x);
            const std::uint32_t begin = atlas.adaptive_begin[row + static_cast<std::size_t>(first.x)];
            const std::uint32_t end = atlas.adaptive_begin[row + static_cast<std::size_t>(last.x) + 1];
            for (std::uint32_t index = begin; index < end; ++index) consider(index, 0.0f);
        }
    }
    if (result.support > kLeastSupport) {
        for (std::size_t i = 0; i < result.count; ++i) result.weight[i] /= result.support;
        return result;
    }
    result.confident = false;
    result.count = 0;
    if (std::isinf(nearest_distance)) return result;
    result.probe[0] = nearest;
    result.weight[0] = 1.0f;
    result.count = 1;
    return result;
}

}  // namespace gather
