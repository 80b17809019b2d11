// gather/screen_probes/importance.h: where a probe's rays go.
//
// Structured importance sampling (Agarwal, Ramamoorthi, Belongie and Jensen, "Structured Importance Sampling
// of Environment Maps", SIGGRAPH 2003) on the quadtree of the octahedral map, with a fixed number of rays:
// three rays of least use become children of the texel of most use, which becomes its own fourth child.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math/spherical_harmonics.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/probe_atlas.h"
#include "gather/settings.h"

namespace gather {

/// One ray of a probe: a texel of the map, or a quarter of one.
struct ProbeRay {
    std::uint8_t x = 0, y = 0;  ///< In texels of its level: quarters count twice as many along an edge.
    std::uint8_t level = 0;     ///< 0: a whole texel; 1: a quarter.

    /// Row-major index of the texel it belongs to.
    std::size_t texel(int resolution) const {
        return static_cast<std::size_t>((y >> level) * resolution + (x >> level));
    }
};

/// Every texel once, in row order.
std::vector<ProbeRay> uniform_rays(int resolution);

/// Moves rays from where they are not worth their cost.
/// @param brdf by texel, peak about 1, clamped at 0; only it culls
/// @param light by texel, mean 1; empty: no guess. @param rays as many as texels, in any order afterwards
void choose_rays(std::span<const float> brdf, std::span<const float> light, float cull_threshold,
                 std::span<ProbeRay> rays);

/// Whose specular lobes read the probes in their own directions: surfaces rougher than `above`, and no
/// rougher than `most`. None by default.
struct SpecularReaders {
    float above = -1.0f;
    float most = -1.0f;

    bool contains(const core::SurfacePoint& surface) const {
        return surface.roughness > above && surface.roughness <= most && core::has_specular(surface.brdf);
    }
};

/// Coefficients of the clamped cosine averaged over the pixels that will read a probe; about the mirror
/// direction, too, for `readers`, by what their specular lobe reflects beside the diffuse one.
core::Sh accumulate_brdf(const VisibleSurfaces& visible, const Probe& probe, int spacing,
                         float plane_sharpness, const SpecularReaders& readers);

/// What the last frame's probes say of the light that arrives at a probe: luminance by texel with mean 1;
/// empty where none of them lies in its plane, or all are dark.
void guess_light(const ProbeAtlas& last, const Probe& probe, float plane_sharpness,
                 std::vector<float>& light);

}  // namespace gather
