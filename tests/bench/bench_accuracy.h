// tests/bench/bench_accuracy.h: how right a tracer's answers are, on the rays that it is timed on.
#pragma once

#include "core/trace/tracer.h"
#include "tests/bench/bench_rays.h"
#include "tests/bench/bench_tracers.h"

namespace tests {

/// Over some thousands of rays. Distances count across the surface, in voxels of the hit instance.
struct BenchAccuracy {
    double steps_per_ray = 0.0;  ///< Cells and empty blocks; 0 where a tracer does not count.
    /// Of |t - t_reference| |n.d| against the double-precision walk of the same field, on rays that hit in
    /// both. Occlusion rays have none, nor have tracers of triangles.
    double error_mean_voxels = 0.0, error_p99_voxels = 0.0;
    /// Of the distance from where a ray hits to the closest triangle. Occlusion rays have none.
    double mesh_error_mean_voxels = 0.0;
    /// Part of the rays that hit here or in the mesh, but not in both.
    double hit_disagreement = 0.0;
    /// The same against the double-precision walk of the field.
    double reference_disagreement = 0.0;
};

BenchAccuracy measure_accuracy(const core::Tracer& tracer, const BenchWorld& world, const BenchRays& rays);

}  // namespace tests
