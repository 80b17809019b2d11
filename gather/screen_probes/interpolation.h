// gather/screen_probes/interpolation.h: which probes a point of a surface reads, and with what weights.
//
// Bilinear on the screen times exp2(-k (|dot(x_probe - x, n)| / depth)^2): probes off the plane of the point
// do not count, so that a foreground does not leak onto what is behind it. A probe holds the whole sphere, so
// its normal does not matter, but for one case: round a convex edge. There the point sees directions that lie
// under the probe's own surface, where the probe has found that surface and not what is beyond the edge.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

/// The point that reads, and where it stands on the screen.
struct ProbeReader {
    glm::vec2 pixel{0.0f};
    glm::vec3 position{0.0f};
    glm::vec3 normal{0.0f, 0.0f, 1.0f};
    float depth = 1.0f;
};

struct ProbeWeights {
    static constexpr std::size_t kMost = 16;
    std::array<std::uint32_t, kMost> probe{};
    std::array<float, kMost> weight{};  ///< They sum to 1 unless count is 0.
    std::size_t count = 0;
    float support = 0.0f;   ///< Sum of the weights before they were made to sum to 1.
    bool confident = true;  ///< False: no probe lies in the plane; the nearest to it stands in.
};

/// How well light at one point of a surface stands for light at another.
/// @return exp2(-k (distance of `other` from the plane / depth)^2), times a weight that falls from 1 to 0 as
/// the normals part by up to 60 degrees where the surface between them is convex
float surface_weight(const glm::vec3& position, const glm::vec3& normal, float depth, const glm::vec3& other,
                     const glm::vec3& other_normal, float sharpness);

/// Weights of the probes around a point. count is 0 only if no tile around has a probe.
ProbeWeights find_probes(const ProbeAtlas& atlas, const ProbeReader& reader, float sharpness);

}  // namespace gather
