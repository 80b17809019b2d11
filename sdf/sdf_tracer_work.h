// sdf/sdf_tracer_work.h: what SdfTracer keeps of rays while it traces them. For its own sources alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "core/math/ray.h"
#include "core/scene/scene.h"
#include "sdf/entry_kernel.h"
#include "sdf/hit_kernel.h"
#include "sdf/instance_tree.h"
#include "sdf/sdf_tracer.h"
#include "sdf/surface_kernel.h"

namespace sdf {

/// How far off a solid's surface rays start that leave it. The solver's own error is far smaller; this clears
/// the facets of the trilinear surface, which rise 1 / 8r over the smooth surface that the normal belongs to,
/// r its radius in voxels.
inline constexpr double kSurfaceClearanceVoxels = 0.05;

/// A crossing farther than this from every stored triangle is the lid with which the winding number closes a
/// hole of the mesh, and no surface. Where the sign changes at the mesh, the surface passes through the cell,
/// whose diagonal is 1.74.
inline constexpr double kFarthestTriangleVoxels = 2.0;

/// Four units in the last place of a float of this magnitude.
inline double four_ulp(double magnitude) {
    return 4.0 * magnitude * static_cast<double>(std::numeric_limits<float>::epsilon());
}

/// A ray in an instance's voxels, and what it has met there so far.
struct SdfTracer::LocalRay {
    core::Ray world;
    std::uint32_t slot;  ///< Of the block's rays.
    std::uint32_t instance;
    const PlacedGrid& placed;
    const core::Mesh& mesh;
    glm::dvec3 origin;     ///< Voxel coordinates.
    glm::dvec3 direction;  ///< Voxels a world unit.
    double t_max;          ///< The nearest hit of other instances, or the ray's own end.
    double unmet_since;    ///< No visible triangle is met before; at first the ray's start.
    double come_to;        ///< Where the walk is: at a crossing, or where it goes on.
    bool is_inside;        ///< Whether the field is negative there.
    bool any;              ///< Whether any triangle will do, not the first alone.
};

/// A ray's way through the box of one instance's field.
struct SdfTracer::Passage {
    std::uint32_t instance = core::kNoIndex;
    double t_min = 0.0, t_max = 0.0;
    double t_per_voxel = 1.0;

    double t_at(const MarchHit& march_hit) const { return t_min + march_hit.distance * t_per_voxel; }
};

/// A ray on its way through the scene.
struct SdfTracer::Traced {
    NearestHit nearest;
    Passage passage;
    std::uint32_t steps = 0;
    bool is_exhausted = false;

    /// Whether the passage may end where the field is negative: never at the face of its box.
    bool may_end_inside() const { return is_exhausted || passage.t_max >= nearest.t; }
};

/// What lies at a crossing: the closest of the triangles that its cell names.
struct SdfTracer::Surface {
    std::uint32_t triangle = kNoTriangle;
    double distance = 0.0;  ///< From the crossing, voxels.
    glm::vec2 barycentrics{0.0f};
    bool is_front = true;      ///< Whether the ray comes from its front.
    glm::vec3 gradient{0.0f};  ///< Of the field.

    NearestHit hit(double t, std::uint32_t instance, bool enters_negative) const {
        NearestHit found;
        found.t = t;
        found.instance = instance;
        found.triangle = triangle;
        found.barycentrics = barycentrics;
        found.is_front = is_front;
        found.gradient = gradient;
        found.enters_negative = enters_negative;
        return found;
    }
};

/// What a crossing of the field stands for.
enum class SdfTracer::Stands : std::uint8_t {
    kNothing,  ///< The lid of a hole.
    kShell,    ///< Triangles within decide.
    kSurface,  ///< A surface that lies where the field says.
};

/// What becomes of a ray that meets no triangle.
enum class SdfTracer::IfUnmet : std::uint8_t { kEnd, kGoOn, kTakeSurface };

/// A ray that waits for the answer of its mesh's triangles.
struct SdfTracer::Asked {
    LocalRay ray;
    Surface here;  ///< At the crossing to which the ray has come.
    IfUnmet if_unmet;
};

/// Rays that are traced together: enough to keep the lanes of a kernel busy, few enough for the cache.
inline constexpr std::size_t kBlockRays = 2048;

/// The memory of a block of rays.
struct SdfTracer::Work {
    const core::RayStream* rays = nullptr;
    std::size_t first_ray = 0;  ///< Of the block.
    std::vector<std::uint8_t> valid = std::vector<std::uint8_t>(kBlockRays);
    std::vector<Traced> traced{kBlockRays};
    std::vector<InstanceTree::Walk> walks{kBlockRays};  ///< Of the same rays.
    std::vector<std::uint32_t> leaving;                 ///< Rays that go on to their next instance.
    std::vector<double> limits = std::vector<double>(kBlockRays);  ///< Of those.
    std::vector<std::uint32_t> next_instances = std::vector<std::uint32_t>(kBlockRays);
    Entries entries{kBlockRays};
    std::vector<std::uint32_t> active;             ///< Rays that are within a field's box.
    std::vector<MarchRay> march_rays{kBlockRays};  ///< Of the active rays.
    std::vector<MarchHit> march_hits{kBlockRays};
    std::vector<std::uint32_t> met;  ///< Entries of `active` whose crossing is looked up in `surface`.
    SurfacePoints surface;
    std::vector<Asked> asked, answered;
    std::vector<TriangleQuery> queries, answers;  ///< Of the same rays.
    int round = 0;                                ///< How often rays went on already.
    std::vector<LocalRay> going_on;               ///< Rays whose crossing was no visible surface.
    std::vector<LocalRay> walking;                ///< Those that the kernels take to their next.

    core::Ray ray(std::uint32_t slot) const { return rays->get(first_ray + slot); }
};

}  // namespace sdf
