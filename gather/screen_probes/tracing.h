// gather/screen_probes/tracing.h: the rays of all probes, and their light composed into texels.
#pragma once

#include <cstdint>
#include <vector>

#include "gather/lighting/scene_lighting.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/importance.h"
#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

struct ProbeTraceInputs {
    const core::RenderInputs& inputs;
    const VisibleSurfaces& visible;
    const SceneLighting& lighting;
    const HitLighting& hit_lighting;
    const TexelTable& table;
    const ScreenProbeSettings& settings;
    const ProbeAtlas* last = nullptr;  ///< The last frame's probes guide the rays; nullptr: no guess.
    bool cull = true;  ///< Importance sampling; never without the filter, which fills culled texels.
    SpecularReaders specular_readers;
    std::uint32_t frame = 0;
};

struct ProbeTraceCost {
    std::uint64_t probe_rays = 0;
    std::uint64_t shadow_rays = 0;
    std::uint64_t exhausted = 0;
    double light = 0.0;    ///< Sum of what the rays brought, in luminance,
    double clamped = 0.0;  ///< and of what max_ray_intensity took off it.
};

/// Fills the texels of all valid probes: radiance is the mean of a texel's rays, the distance their minimum.
/// Streams are sorted by direction, so that rays side by side go the same way.
ProbeTraceCost trace_probes(const ProbeTraceInputs& in, ProbeAtlas& atlas);

}  // namespace gather
