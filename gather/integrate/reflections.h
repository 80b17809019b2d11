// gather/integrate/reflections.h: what smooth surfaces mirror, traced at full resolution.
//
// A probe's map blurs to a texel, some twenty degrees; lobes narrower than that take rays of their own. Their
// hits are lit as those of probe rays are. Lights of S, which light sampling and lobe rays weigh against each
// other (lighting/scene_lighting.h), are not theirs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "core/render/renderer.h"
#include "gather/lighting/scene_lighting.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/settings.h"

namespace gather {

/// Whether a surface is smooth enough for rays of its own.
bool takes_reflection_rays(const core::SurfacePoint& surface, const IntegrateSettings& settings);

/// A ray that a pixel's specular lobe chose, and what it brought.
struct ReflectionRay {
    glm::vec3 direction{0.0f};  ///< Unit.
    float pdf = 0.0f;           ///< Of the direction, per steradian; 0: the lobe chose one under the surface.
    glm::vec3 radiance{0.0f};
    float distance = 0.0f;   ///< Infinite where it escaped.
    glm::vec3 normal{0.0f};  ///< Of what it met.
};

/// The rays of a frame: those of pixel i stand from i * rays_a_pixel on. Only pixels that
/// takes_reflection_rays() have any.
struct ReflectionRays {
    std::vector<ReflectionRay> rays;
    std::size_t rays_a_pixel = 0;
};

struct ReflectionCost {
    std::uint64_t rays = 0;
    std::uint64_t shadow_rays = 0;
    std::uint64_t exhausted = 0;
};

/// Traces `settings.reflection_rays` rays from each pixel that takes_reflection_rays().
ReflectionCost trace_reflections(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                                 const HitLighting& hit_lighting, const IntegrateSettings& settings,
                                 std::uint32_t frame, ReflectionRays& found);

}  // namespace gather
