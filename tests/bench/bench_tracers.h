// tests/bench/bench_tracers.h: every tracer that is measured, by name, on one scene baked at one resolution.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/trace/triangle_tracer.h"
#include "sdf/brick_grid.h"
#include "sdf/field_kernel.h"
#include "sdf/sampled_field.h"
#include "sdf/triangle_bvh.h"
#include "tests/bench/bench_embree.h"
#include "tests/bench/bench_meshes.h"
#include "tests/bench/bench_rays.h"
#include "tests/bench/bench_scalar.h"

namespace tests {

/// Names and what they stand for:
/// `sdf_eps`, `sdf_secant`, `sdf_cubic`: sdf::SdfTracer in that hit mode; with `_avx2` and the like, on that
/// instruction set instead of the best one; with `_8bit`, on samples of 8 bits.
/// `sdf_scalar`: ScalarFieldTracer.
/// `embree1`, `embree8`, `embree16`, `embree_stream`: Embree on the triangles, robust; with `_fast`, not.
/// `openvdb`: its LevelSetRayIntersector.
std::vector<std::string> bench_tracer_names();

/// The instruction set that a tracer's name asks for, as sdf::select_kernel_target takes it; else empty.
std::string kernel_target_of(const std::string& tracer_name);

/// Whether a tracer walks the field, so that it can be held against the double-precision walk of the same.
bool is_field_tracer(const std::string& tracer_name);

/// Samples of the field that a tracer walks.
sdf::SampleBits sample_bits_of(const std::string& tracer_name);

/// One scene, its field, and the tracers on both, made when they are first asked for.
class BenchWorld {
public:
    /// @param cache folder for baked fields, as sdf::bake_scene takes it
    /// @throws core::InputError where the field cannot be baked, or has shells: those would measure triangles
    BenchWorld(std::shared_ptr<const BenchScene> scene, int resolution, sdf::SampleBits bits,
               const std::filesystem::path& cache);

    const core::Scene& scene() const { return scene_->scene; }
    const sdf::BrickGrid& grid() const { return *grids_[0]; }
    /// Local triangles of the only mesh.
    const sdf::TriangleBvh& mesh_tree() const { return mesh_tree_; }
    /// The truth about the mesh, and about the field.
    const core::Tracer& triangles() const { return triangles_; }
    const core::Tracer& reference() const { return reference_; }

    /// @param kind, side as in make_bench_rays
    const BenchRays& rays(const std::string& kind, int side);

    /// @param is_coherent whether the rays are: Embree takes the hint
    const core::Tracer& tracer(const std::string& name, bool is_coherent);

private:
    std::unique_ptr<core::Tracer> make_tracer(const std::string& name, bool is_coherent);
    std::unique_ptr<core::Tracer> make_embree(const std::string& name, bool is_coherent);

    std::shared_ptr<const BenchScene> scene_;
    sdf::SampledField field_;
    std::vector<std::shared_ptr<const sdf::BrickGrid>> grids_;
    sdf::TriangleBvh mesh_tree_;
    core::TriangleTracer triangles_;
    ScalarFieldTracer reference_;
    std::map<std::string, BenchRays> rays_;
    std::map<std::string, std::unique_ptr<core::Tracer>> tracers_;
    std::shared_ptr<const EmbreeScene> robust_, fast_;
};

}  // namespace tests
