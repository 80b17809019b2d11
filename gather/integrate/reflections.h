// gather/integrate/reflections.h: what smooth surfaces mirror, traced at full resolution.
//
// A probe's map blurs to a texel, some twenty degrees; lobes narrower than that take rays of their own. Their
// hits are lit as those of probe rays are. Lights of S, which light sampling and lobe rays weigh against each
// other (lighting/scene_lighting.h), are not theirs.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "core/render/renderer.h"
#include "gather/integrate/reflection_reuse.h"
#include "gather/lighting/scene_lighting.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/settings.h"

namespace gather {

/// Whether a surface is smooth enough for rays of its own.
bool takes_reflection_rays(const core::SurfacePoint& surface, const IntegrateSettings& settings);

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
