// gather/screen_probes/placement.h: where probes stand.
//
// A uniform grid on jittered pixels; then refinement at half and a quarter of the spacing where interpolation
// fails (after Krivanek et al., "Making Radiance and Irradiance Caching Practical", EGSR 2006 and later), and
// at last one probe for each connected region of pixels that still fails.
#pragma once

#include <cstdint>

#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

/// Most adaptive probes of a picture.
std::size_t adaptive_limit(int width, int height, const ScreenProbeSettings& settings);

/// Tiles of a picture.
glm::ivec2 tile_grid(int width, int height, int spacing);

/// Places all probes of a frame; texels are not allocated. @param adaptive whether the plan has them
void place_probes(const VisibleSurfaces& visible, const ScreenProbeSettings& settings, bool adaptive,
                  std::uint32_t frame, std::uint64_t seed, ProbeAtlas& atlas);

}  // namespace gather
