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

#include "gather/lighting/visible_surfaces.h"
#include "gather/settings.h"

namespace gather {

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

/// Adds to `specular` the light of each pixel's own rays and of its neighbours'.
void reuse_reflections(const VisibleSurfaces& visible, const ReflectionRays& rays,
                       const IntegrateSettings& settings, std::uint64_t seed, std::uint32_t frame,
                       std::vector<glm::vec3>& specular);

}  // namespace gather
