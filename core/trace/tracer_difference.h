// core/trace/tracer_difference.h: how far one tracer's answers lie off another's on the same rays.
//
// Shares are of the rays that hit in either tracer, because a background would dilute them. A distance is
// |t_tested - t_reference| |n.d| in voxels of the hit instance: across the surface, not along the ray. A ray
// is within one voxel of a silhouette if any of eight parallel rays, one voxel away, changes between hit and
// miss in the reference, or hits more than one voxel off the plane that the ray itself hit there.
#pragma once

#include <cstdint>
#include <span>

#include "core/scene/scene.h"
#include "core/support/progress.h"
#include "core/trace/tracer.h"

namespace core {

/// What is compared. References must outlive the call.
struct TracerPair {
    const Scene& scene;
    const Tracer& reference;  ///< Exact: triangles.
    const Tracer& tested;
    /// Voxel of the tested tracer in local units, by mesh index; 0 for a mesh that it does not have.
    std::span<const double> voxel_of_mesh;
};

/// Of distances in voxels; all 0 where there are none.
struct DistanceQuantiles {
    double p50 = 0.0, p99 = 0.0, max = 0.0;
};

/// What was found.
struct TracerDifference {
    std::uint64_t rays = 0;
    std::uint64_t either = 0;           ///< Rays that hit in either tracer.
    std::uint64_t misses = 0;           ///< Of them, hit in the reference alone.
    std::uint64_t false_hits = 0;       ///< Of them, hit in the tested tracer alone.
    std::uint64_t silhouettes = 0;      ///< Of `either`, within one voxel of a silhouette.
    std::uint64_t disagree_beyond = 0;  ///< Misses and false hits beyond silhouettes.
    std::uint64_t exhausted = 0;        ///< Of `rays`, in the tested tracer.
    DistanceQuantiles voxels;           ///< Of rays that hit in both.
    DistanceQuantiles voxels_beyond;    ///< The same beyond silhouettes.
    double normal_degrees = 0.0;        ///< Mean angle between the normals, beyond silhouettes.
    double steps_per_ray = 0.0;         ///< Mean of the tested tracer, over all rays.

    /// Occlusion queries, at most one a hit of the reference: from there to where another ray of the same
    /// set, drawn at random, came to; towards infinity along that ray if it missed. Ends are lifted off their
    /// surfaces by the larger offset of both tracers, and queries that leave or arrive below a surface are
    /// not asked, as a renderer would not.
    std::uint64_t shadow_rays = 0;
    std::uint64_t shadow_disagree = 0;  ///< Of them, occluded in one tracer alone.

    double reference_rays_per_second = 0.0;  ///< Closest hits, on one thread.
    double tested_rays_per_second = 0.0;

    /// In percent; 0 of nothing is 0.
    double miss_percent() const { return percent(misses, either); }
    double false_hit_percent() const { return percent(false_hits, either); }
    double disagree_percent() const { return percent(misses + false_hits, either); }
    double silhouette_percent() const { return percent(silhouettes, either); }
    double disagree_beyond_percent() const { return percent(disagree_beyond, either - silhouettes); }
    double shadow_disagree_percent() const { return percent(shadow_disagree, shadow_rays); }
    double exhausted_percent() const { return percent(exhausted, rays); }

private:
    static double percent(std::uint64_t part, std::uint64_t whole) {
        return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
    }
};

/// Traces `rays` through both, on this thread for the two rates, and compares them, on all threads. All but
/// the rates is the same at any thread count.
/// @param seed of the draws of occlusion queries. @pre voxel_of_mesh.size() == scene.meshes.size()
/// @throws Interrupted when asked to stop
TracerDifference compare_tracers(const TracerPair& tracers, const RayStream& rays, std::uint32_t seed,
                                 const StopRequested& stop_requested = {});

/// The rays that the light of a picture travels: one through a random point of every pixel, and `bounces`
/// times one more from wherever these hit in the reference, cosine-distributed about the geometric normal and
/// lifted by the larger offset of both tracers.
RayStream picture_rays(const TracerPair& tracers, const Camera& camera, int width, int height, int bounces,
                       std::uint32_t seed);

}  // namespace core
