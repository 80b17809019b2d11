// gather/integrate/integrate.h: from the probes' light to a pixel's, at full resolution.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "gather/integrate/bent_normal.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/interpolation.h"
#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

struct IntegrateInputs {
    const VisibleSurfaces& visible;
    const ProbeAtlas& atlas;
    const TexelTable& table;
    const ScreenProbeSettings& probes;
    const IntegrateSettings& settings;
    std::uint64_t seed = 0;
    std::uint32_t frame = 0;
};

/// Indirect light toward the eye by pixel, and the control variates of near light: the picture may take any
/// share of them, for their mean is 0. See NearLight.
struct IndirectLight {
    std::vector<glm::vec3> diffuse, specular;
    std::vector<glm::vec3> diffuse_control, specular_control;  ///< Empty where near light is not compared.

    void reset(std::size_t pixels, bool controlled);
};

/// Which probes every pixel reads.
void interpolate_probes(const IntegrateInputs& in, std::vector<ProbeWeights>& weights);

/// Light that the diffuse lobe sends to the eye, added to `light`. @param bent what the probes are
/// seen through; empty: everything is open. @param near_light may be empty
void integrate_diffuse(const IntegrateInputs& in, const std::vector<ProbeWeights>& weights,
                       const std::vector<BentNormal>& bent, const std::vector<NearLight>& near_light,
                       IndirectLight& light);

struct SpecularModes {
    bool directional = false;  ///< Surfaces up to settings.rough_specular_max reflect in GGX directions.
    bool reflections = false;  ///< Those that takes_reflection_rays() are left to them.
};

/// Light that the specular lobe finds in the probes: in visible-normal GGX directions, or through
/// rough_lobe().
/// @param near_light may be empty
void integrate_specular(const IntegrateInputs& in, const std::vector<ProbeWeights>& weights,
                        const SpecularModes& modes, const std::vector<NearLight>& near_light,
                        IndirectLight& light);

}  // namespace gather
