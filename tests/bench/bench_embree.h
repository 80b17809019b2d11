// tests/bench/bench_embree.h: Embree 3 at its best, the peer of our field tracers.
//
// Unlike core::TriangleTracer nothing is checked, no offset is computed and normals stay as Embree hands them
// out (unnormalised, in the instance's own space): whatever our tracers do beyond that is their own cost.
#pragma once

#include <memory>

#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace tests {

/// Trees of one scene, built at high quality: one level where there is one instance, else two.
class EmbreeScene;

/// @param robust RTC_SCENE_FLAG_ROBUST: no leaks between triangles, at some cost
std::shared_ptr<const EmbreeScene> build_embree_scene(const core::Scene& scene, bool robust);

/// How rays are handed over.
enum class EmbreeCall { kSingle, kPacket8, kPacket16, kStream };

/// @param is_coherent the hint that Embree takes about the rays
/// @pre rays are valid (is_valid_ray), t_min >= 0
std::unique_ptr<core::Tracer> make_embree_tracer(std::shared_ptr<const EmbreeScene> scene, EmbreeCall call,
                                                 bool is_coherent);

}  // namespace tests
