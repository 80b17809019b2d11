// tests/bench/bench_openvdb.h: OpenVDB's own ray intersector on the samples that our tracers walk.
#pragma once

#include <memory>

#include "core/scene/scene.h"
#include "core/trace/tracer.h"
#include "sdf/sampled_field.h"

namespace tests {

/// LevelSetRayIntersector with four rounds of refinement. Hits have t and a normal, and no triangle.
/// @param field of the scene's only mesh. @pre scene.instances.size() == 1
std::unique_ptr<core::Tracer> make_openvdb_tracer(const core::Scene& scene, const sdf::SampledField& field);

}  // namespace tests
