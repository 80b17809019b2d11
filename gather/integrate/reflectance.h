// gather/integrate/reflectance.h: how much of a constant environment the diffuse lobe of a surface sends to
// the eye.
#pragma once

#include <glm/glm.hpp>

#include "core/scene/brdf.h"

namespace gather {

/// Directional albedo of the diffuse lobe: what the coat's Fresnel term leaves of brdf.diffuse, exact for the
/// BRDF of core/scene/brdf. @param cosine of the view direction, in (0, 1]
glm::vec3 diffuse_albedo(const core::Brdf& brdf, float cosine);

}  // namespace gather
