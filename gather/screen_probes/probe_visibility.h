// gather/screen_probes/probe_visibility.h: probes that something hides from the point that reads them.
//
// A probe in the plane of a point may stand on the other side of a table's leg, and see the sun on it where
// the point sees its shadow. Interpolation knows planes, not what stands on them: short rays between both do.
#pragma once

#include <span>
#include <vector>

#include "core/render/renderer.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/interpolation.h"
#include "gather/screen_probes/probe_atlas.h"

namespace gather {

/// Takes probes that are hidden from their pixel out of its weights. A pixel that all are hidden from keeps
/// them, and is not confident.
/// @param openness mean visibility of each pixel's surroundings: where all is open no ray is traced; empty:
/// not known, all pixels trace. @param frame decides, with the pixel, what blended surfaces let through
PassRays hide_probes(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                     const ProbeAtlas& atlas, std::span<const float> openness, std::uint32_t frame,
                     std::vector<ProbeWeights>& weights);

}  // namespace gather
