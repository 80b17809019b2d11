// gather/screen_probes/interpolation.h: which probes a point of a surface reads, and with what weights.
//
// Bilinear on the screen times exp2(-k (|dot(x_probe - x, n)| / depth)^2): probes off the plane of the point
// do not count, so that a foreground does not leak onto what is behind it. Normals of probes are not asked:
// a probe holds the whole sphere.
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

/// exp2(-k (distance from the plane / depth)^2).
float plane_weight(const glm::vec3& position, const glm::vec3& normal, float depth, const glm::vec3& other,
                   float sharpness);

/// Weights of the probes around a point. count is 0 only if no tile around has a probe.
ProbeWeights find_probes(const ProbeAtlas& atlas, const ProbeReader& reader, float sharpness);

}  // namespace gather
