// gather/screen_probes/near_field.h: probes that hold what is far alone.
//
// What stands within reach of a pixel's short rays is the pixel's own to find (integrate/bent_normal.h): seen
// from a probe some pixels apart it lies elsewhere, and a probe beside a bright thing would light all that
// read it. So a texel whose ray ended nearer than that takes what probes beside it see beyond.
#pragma once

#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

/// Replaces the light of texels that end near by the mean over the probes of the tiles around whose rays of
/// that direction went farther, and the distance by theirs; texels that no probe sees beyond keep their own.
/// @param ray_pixels length of the short rays in pixels; near is a quarter of it, since a pixel between two
/// probes must not miss with its own rays what both have lost
void take_out_near_field(const ScreenProbeSettings& settings, const VisibleSurfaces& visible,
                         float ray_pixels, ProbeAtlas& atlas);

}  // namespace gather
