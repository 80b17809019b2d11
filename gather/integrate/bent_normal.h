// gather/integrate/bent_normal.h: what stands near a pixel, at full resolution.
//
// Short rays restore what probes some pixels apart cannot hold: contact shadows, and light from nearby. The
// probes' light is the far field. Of the near field there are two accounts:
// - traced: where a short ray hits, the hit's own light takes the place of what the probes hold in its
//   direction. It is a control variate: its mean is right whatever the probes say of near things, and it has
//   no noise where nothing is near. Where no probe lies on a pixel's surface, its rays are not short, and all
//   that they find is its light: features too thin or too many for probes do not leak. Its coefficient is the
//   regression of what the rays found on what the probes held, so that where something dark stands before a
//   probe's brightest direction, a crease beside a lit floor, the probes' noise is not subtracted for
//   nothing.
// - multi_bounce: the probes through a cone about the opening, and what nearby surfaces send back estimated
//   (Jimenez, Wu, Pesce and Jarabo, "Practical Realtime Strategies for Accurate Indirect Occlusion", 2016),
//   after Mayaux, "Horizon-Based Indirect Lighting", 2018. No shadow rays, and no noise but of the opening.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/math/spherical_harmonics.h"
#include "gather/lighting/scene_lighting.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/interpolation.h"
#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

/// How open the hemisphere of a pixel is nearby.
struct BentNormal {
    glm::vec3 direction{0.0f, 0.0f, 1.0f};  ///< Unit: where the opening points. The normal if all is open.
    float visibility = 1.0f;                ///< 1 - the cosine-weighted share that is occluded.
};

/// Of one pixel, sums over the short rays of the frames so far. Luminances.
struct ProbeAgreement {
    float found =
        0.0f;  ///< Of what a ray's direction holds, its hit's light or the probes', times the probes'.
    float held = 0.0f;  ///< Of the squares of what the probes held. 0: nothing near was found yet.

    /// The coefficient of the control variate: the regression of what was found on what was held.
    float probe_share() const { return held > 0.0f ? std::min(1.0f, found / held) : 1.0f; }
};

/// What the short rays of a pixel, and of those about it, say of its light.
struct NearLight {
    enum class Kind : std::uint8_t {
        kOpen,      ///< Nothing near: its light is the probes'.
        kCompared,  ///< Its light is `found`, and for any share of it the probes' less `held`: of mean 0.
        kAlone,     ///< No probe lies on its surface: its light is `found`.
    };
    struct Light {
        glm::vec3 irradiance{0.0f};
        glm::vec3 specular{0.0f};  ///< As radiance: of surfaces that reflects_near_light().
    };
    Light found;               ///< Of the rays' hits, and of the probes where a ray is open.
    Light held;                ///< Of the probes in all directions of the rays.
    ProbeAgreement agreement;  ///< Of this frame's own rays.
    Kind kind = Kind::kOpen;
    /// Of the pixels that share, how many are open and how many compared.
    float open_share = 1.0f;
    float compared_share = 0.0f;
};

/// What the frames so far found near each pixel; empty before the first.
struct NearHistory {
    std::vector<float> openness;  ///< Mean visibility.
    /// Of all that shared. held is 0 where no pixel about was compared yet.
    std::vector<ProbeAgreement> agreement;
    std::vector<std::uint8_t> compared;  ///< 1: a frame compared the pixel's own rays.
    // Room to work in.
    std::vector<NearLight> before_sharing;
    std::vector<std::uint8_t> compared_in_row;
};

/// What `traced` compares: the light of hits with that of the probes.
struct NearLighting {
    const HitLighting& hit_lighting;
    const ProbeAtlas& atlas;
    const std::vector<ProbeWeights>& weights;  ///< A pixel's.
    const NearHistory& history;
};

/// Whether the specular lobe is wide enough for rays that follow the cosine: smoother ones would speckle.
bool reflects_near_light(const core::SurfacePoint& surface);

struct BentNormalRays {
    std::uint64_t short_rays = 0;
    std::uint64_t shadow_rays = 0;
    std::uint64_t exhausted = 0;
};

/// Traces `integrate.bent_normal_rays` short rays a pixel, whole ones with `near` where a pixel has no probe.
/// Their length is what `bent_normal_pixels` span on the screen at the pixel's distance.
/// @param near nullptr: hits are not shaded
/// @param near_light empty without `near`
BentNormalRays trace_bent_normals(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                                  const IntegrateSettings& settings, std::uint32_t frame,
                                  const NearLighting* near, std::vector<BentNormal>& result,
                                  std::vector<NearLight>& near_light);

/// After a frame's rays: their light becomes a mean, by a tent, over the pixels within
/// `integrate.near_field_radius` on one plane, and `history` counts them. Contacts blur by as much. What one
/// pixel finds the open ones about it share, too: away from borders nothing is lost.
void share_near_light(const VisibleSurfaces& visible, const IntegrateSettings& settings,
                      float plane_sharpness, std::uint32_t frame, const std::vector<BentNormal>& bent,
                      NearHistory& history, std::vector<NearLight>& near_light);

/// Ambient occlusion with the light that nearby surfaces of this albedo send back.
float multi_bounce(float visibility, float albedo);

/// Irradiance of an environment through the cone about bent.direction with sin^2 = visibility. With
/// visibility 1 it is the irradiance about the direction.
glm::vec3 cone_irradiance(const core::ShColor& radiance, const BentNormal& bent);

}  // namespace gather
