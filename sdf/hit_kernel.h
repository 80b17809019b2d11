// sdf/hit_kernel.h: from what rays have met in fields to hits of the scene, many at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

#include "core/scene/scene.h"
#include "core/trace/ray_stream.h"

namespace sdf {

/// The nearest visible crossing of a ray so far.
struct NearestHit {
    double t = 0.0;          ///< Until there is one: t_max.
    float rounded_t = 0.0f;  ///< The same, for finish_hits().
    std::uint32_t instance = core::kNoIndex;
    std::uint32_t triangle = core::kNoIndex;
    glm::vec2 barycentrics{0.0f};
    glm::vec3 gradient{0.0f};  ///< Of the field, in voxels, where not is_triangle.
    bool enters_negative = true;
    bool is_front = true;
    bool is_triangle = false;  ///< The ray meets the triangle itself, not the field that stands for it.

    bool found() const { return instance != core::kNoIndex; }
    /// Whether finish_hits() knows its normal: the field's, and not the triangle's.
    bool has_field_normal() const {
        constexpr float kLeastSquared = 1e-12f;
        return !is_triangle && glm::dot(gradient, gradient) >= kLeastSquared;
    }
};

/// What an instance's hits need to know of it.
struct HitPlacement {
    float world_from_gradient[9];  ///< Column by column, up to a factor.
    float clearance;               ///< How far off the surface rays start, world units.
};

/// How far beyond a right angle the normals of finish_hits() face their rays.
inline constexpr float kFacing = 1e-6f;

/// Writes hits and misses of rays begin to begin + count - 1; where has_field_normal() is false, the normal
/// is for the caller to write. Normals face their rays. `steps` is left alone. Same bits on every instruction
/// set.
/// @param nearest of ray `begin`; those of the others follow in steps of `stride` bytes
/// @pre begin is a multiple of core::kStreamLanes, stride of 4
void finish_hits(const core::RayStream& rays, std::size_t begin, std::size_t count, const NearestHit* nearest,
                 std::size_t stride, const HitPlacement* placements, core::HitStream& hits);

}  // namespace sdf
