// gather/integrate/reflection_reuse.h: smooth surfaces share their reflection rays with their neighbours.
//
// A pixel has a ray or two, and its neighbours on the same surface have found light that its own lobe
// reflects as well (Stachowiak, "Stochastic Screen-Space Reflections", SIGGRAPH 2015). Each borrowed ray
// counts by the pixel's own pdf over the pdf that chose it, at most kMostCredit, and the sum is divided by
// what all counted: a ratio estimate, whose bias vanishes as the lobes coincide. A mirror's neighbours look
// elsewhere and count nothing. What a borrowed ray met is taken to be in sight, which holds where it is far
// beyond the distance between both.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "gather/integrate/reflections.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/settings.h"

namespace gather {

/// Adds to `specular` the light of each pixel's own rays and of its neighbours'.
void reuse_reflections(const VisibleSurfaces& visible, const ReflectionRays& rays,
                       const IntegrateSettings& settings, std::uint64_t seed, std::uint32_t frame,
                       std::vector<glm::vec3>& specular);

}  // namespace gather
