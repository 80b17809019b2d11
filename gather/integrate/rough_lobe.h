// gather/integrate/rough_lobe.h: a rough specular lobe in spherical harmonics, so that a probe's light goes
// through it without sampling and without noise.
#pragma once

#include <glm/glm.hpp>

#include "core/math/spherical_harmonics.h"
#include "core/trace/surface.h"

namespace gather {

/// BRDF of the specular lobe times the cosine, projected: its dot product with the harmonics of radiance is
/// the radiance that the lobe sends to the eye. Third order holds lobes of roughness 0.8 and more to a few
/// per cent, and blurs smoother ones.
/// @param outgoing unit, world space, above the shading normal
core::ShColor rough_lobe(const core::SurfacePoint& surface, const glm::vec3& outgoing);

}  // namespace gather
