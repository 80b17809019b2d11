// gather/screen_probes/filtering.h: averages probes with their neighbours, in the space of the cache.
//
// A neighbour's ray of the same direction counts by how little it deviates once its hit is seen from here.
// Its hit distance is clamped to one's own first: distant light has no parallax, would never be left out, and
// would leak into contacts.
#pragma once

#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

/// Filters all valid probes, settings.filter_passes times.
void filter_probes(const ScreenProbeSettings& settings, const TexelTable& table, ProbeAtlas& atlas);

}  // namespace gather
