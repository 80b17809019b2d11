// gather/integrate/bent_normal.h: near occlusion at full resolution, and irradiance through what is left
// open.
//
// Short rays restore what probes some pixels apart cannot hold: contact shadows. The probes' light is the far
// field; what nearby surfaces send back is estimated by the multi-bounce approximation (Jimenez, Wu, Pesce
// and Jarabo, "Practical Realtime Strategies for Accurate Indirect Occlusion", 2016), after Mayaux,
// "Horizon-Based Indirect Lighting", 2018.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "core/math/spherical_harmonics.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/settings.h"

namespace gather {

/// How open the hemisphere of a pixel is nearby.
struct BentNormal {
    glm::vec3 direction{0.0f, 0.0f, 1.0f};  ///< Unit: where the opening points. The normal if all is open.
    float visibility = 1.0f;                ///< 1 - the cosine-weighted share that is occluded.
};

/// Traces `integrate.bent_normal_rays` short rays a pixel. Their length is what `bent_normal_pixels` span on
/// the screen at the pixel's distance.
PassRays trace_bent_normals(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                            const IntegrateSettings& settings, std::uint32_t frame,
                            std::vector<BentNormal>& result);

/// Ambient occlusion with the light that nearby surfaces of this albedo send back.
float multi_bounce(float visibility, float albedo);

/// Irradiance of an environment through the cone about bent.direction with sin^2 = visibility. With
/// visibility 1 it is the irradiance about the direction.
glm::vec3 cone_irradiance(const core::ShColor& radiance, const BentNormal& bent);

}  // namespace gather
