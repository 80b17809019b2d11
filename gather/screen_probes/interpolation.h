// gather/screen_probes/interpolation.h: which probes a point of a surface reads, and with what weights.
//
// Bilinear on the screen times exp2(-k (plane distance / scale)^2), the plane distance taken from either
// surface, the scale the depth, or what long lenses and parallel rays leave of it (PixelFootprint): probes
// off the plane of the point do not count, so that a foreground does not leak onto what is behind it.
// Directions under a probe's own surface bring back that surface, and not what a point beyond the edge sees
// there. So probes count less as the normals part: not at all from 60 degrees round a convex edge, from 90 in
// a concave one, where they would bring the light of a lit floor up a dark wall. And on a surface seen at a
// grazing angle pixels side by side are far apart: probes count less by their distance, too.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

#include "core/trace/surface.h"
#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

/// The point that reads, and where it stands on the screen.
struct ProbeReader {
    glm::vec2 pixel{0.0f};
    glm::vec3 position{0.0f};
    glm::vec3 normal{0.0f, 0.0f, 1.0f};
    float plane_scale = 1.0f;  ///< Of its pixel; see PixelFootprint.
    /// Between uniform probes on a surface that faces the camera, in world units: farther ones count less.
    float spacing = std::numeric_limits<float>::infinity();
};

struct ProbeWeights {
    static constexpr std::size_t kMost = 16;
    std::array<std::uint32_t, kMost> probe{};
    std::array<float, kMost> weight{};  ///< They sum to 1 unless count is 0.
    std::size_t count = 0;
    float support = 0.0f;          ///< Sum of the weights before they were made to sum to 1,
    float surface_support = 0.0f;  ///< and without what they lose by distance along the surface.
    bool confident = true;         ///< False: no probe lies on the surface; the nearest stands in.
};

/// How well the light at one point of a surface stands for the light at another, as said above.
/// @param plane_scale of the first point, see PixelFootprint. @return 0 ... 1
float surface_weight(const glm::vec3& position, const glm::vec3& normal, float plane_scale,
                     const glm::vec3& other, const glm::vec3& other_normal, float sharpness);

/// Whether light at the one point stands for light at the other, half of it at least.
/// @param plane_scale of the first
bool is_same_plane(const core::SurfacePoint& point, float plane_scale, const core::SurfacePoint& other,
                   float sharpness);

/// Weights of the probes around a point. count is 0 only if no tile around has a probe.
ProbeWeights find_probes(const ProbeAtlas& atlas, const ProbeReader& reader, float sharpness);

}  // namespace gather
