// gather/lighting/scene_lighting.h: what lights a scene, split into what is sampled and what is hit.
//
// Nothing is counted twice: S (lights without a surface, the sun, small bright emitters, peaks of the sky)
// enters at any vertex only by shadow rays, U (all other emission) only by rays that meet it. Where a path
// ends (at what a gathering ray hits) no ray goes on that could meet U: there shadow rays go to both.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/math/random.h"
#include "core/render/light_sampler.h"
#include "core/scene/scene.h"
#include "core/scene/sky.h"
#include "core/trace/surface.h"
#include "core/trace/tracer.h"
#include "gather/settings.h"

namespace gather {

/// Whether any light is left to U, to be found by rays that meet it.
bool gathers_anything(const core::Scene& scene, const LightingSettings& settings);

/// Which part of the light each way of finding it brings. Immutable once built; thread-safe.
class SceneLighting {
public:
    /// @pre scene outlives it. @param tracer for the start offsets of shadow rays
    SceneLighting(const core::Scene& scene, const core::Tracer& tracer, const LightingSettings& settings);
    SceneLighting(const SceneLighting&) = delete;
    SceneLighting& operator=(const SceneLighting&) = delete;

    /// All that a camera ray sees where it leaves the scene.
    glm::vec3 seen_sky(const glm::vec3& direction) const { return everything_.escaped_radiance(direction); }

    /// What a gathering ray brings from there: the part of the sky that is not sampled.
    glm::vec3 gathered_sky(const glm::vec3& direction) const { return sky_.base.radiance(direction); }

    /// Whether a gathering ray that hits this instance brings its emission.
    bool gathers_emission(std::uint32_t instance) const { return sampled_emitters_[instance] == 0; }

    /// Whether shadow rays have anything to go to.
    bool samples_anything() const { return !sampled_->empty(); }

    /// How many lights a pixel samples where `wanted` are asked for: no more than there are, if all of S are
    /// points and suns, which leave hardly a penumbra to sample.
    int direct_samples(int wanted) const;

    /// S, for surfaces whose light is gathered, too.
    const core::LightSampler& sampled() const { return *sampled_; }

    /// S and U, for the ends of paths.
    const core::LightSampler& everything() const { return everything_; }

    float start_offset(std::uint32_t instance) const { return start_offsets_[instance]; }

    /// Longer than any way through the scene, and finite: the distance of a ray that hits nothing.
    float trace_limit() const { return trace_limit_; }

private:
    core::LightSampler everything_;
    core::SkySplit sky_;
    std::vector<std::uint8_t> sampled_emitters_;
    std::optional<core::LightSampler> sampled_;
    std::vector<float> start_offsets_;
    float trace_limit_ = 1.0f;
    bool samples_extended_ = false;  ///< Emitters or sky are in S.
};

/// Whether a smooth lobe needs a ray of its own: light sampling alone would leave speckles of lights that it
/// mirrors. Such surfaces weigh both by the power heuristic.
bool mirrors_lights(const core::SurfacePoint& surface);

/// One sampled light on its way to a surface, before its shadow ray.
struct LightArrival {
    core::Ray shadow_ray;
    glm::vec3 diffuse{0.0f};   ///< Radiance it adds towards `outgoing` by the diffuse lobe,
    glm::vec3 specular{0.0f};  ///< and by the specular one.
};

/// Chooses one light of `sampler` for a surface. Nothing where no light arrives.
/// @param selection of the sampler at `origin`, where rays leave the surface; `outgoing` unit, away from it
/// @param point_alpha_min the lobes are at least this wide for lights without a surface
std::optional<LightArrival> sample_light(const SceneLighting& lighting, const core::LightSampler& sampler,
                                         const core::LightSampler::Selection& selection,
                                         const core::SurfacePoint& surface, const glm::vec3& origin,
                                         const glm::vec3& outgoing, const glm::vec2& u, std::uint32_t seed,
                                         float point_alpha_min = 0.0f);

/// A ray in a direction that the BRDF chose, and what its light counts.
struct LobeRay {
    core::Ray ray;
    core::BrdfSample chosen;
    core::LightReceiver receiver;
    core::LightSampler::Selection selection;
};

/// Of a surface that mirrors_lights(). @param selection as of sample_light(). Nothing where the lobe sends no
/// ray above the surface.
std::optional<LobeRay> sample_lobe(const core::LightSampler::Selection& selection,
                                   const core::SurfacePoint& surface, const glm::vec3& origin,
                                   const glm::vec3& outgoing, float u_lobe, const glm::vec2& u,
                                   std::uint32_t seed);

/// Traces such rays and gives the radiance that each adds towards its `outgoing` by the light of `sampler`
/// that it meets, weighted against sample_light(). @return rays that were exhausted
std::uint64_t trace_lobes(const core::Scene& scene, const core::Tracer& tracer,
                          const core::LightSampler& sampler, std::span<const LobeRay> lobes,
                          const std::function<void(std::size_t lobe, const glm::vec3& light)>& add);

/// Light that hits send back along their rays: emission of U, and direct light of S and U by a shadow ray
/// each; misses bring the sky of U. Of the cached bounce nothing yet: `bounced`, where present, is called for
/// each hit and its light added.
struct HitLightingCounters {
    std::uint64_t shadow_rays = 0;
    std::uint64_t exhausted = 0;
};
class HitLighting {
public:
    using Bounced = glm::vec3 (*)(const core::SurfacePoint& surface, const glm::vec3& outgoing);

    /// @param roughness_min smoother surfaces are lit as if this rough (Kaplanyan and Dachsbacher, "Path
    /// Space Regularization for Holistic and Robust Light Transport", 2013): a lamp that few rays see
    /// mirrored would shine on all that read their probe
    /// @param point_roughness_min likewise for lights without a surface alone, which no ray meets: in a
    /// smooth surface they are nothing but fireflies
    HitLighting(const core::Scene& scene, const core::Tracer& tracer, const SceneLighting& lighting,
                bool direct_light, float roughness_min, float point_roughness_min, Bounced bounced = nullptr)
        : scene_(scene),
          tracer_(tracer),
          lighting_(lighting),
          direct_(direct_light),
          roughness_min_(roughness_min),
          point_roughness_min_(point_roughness_min),
          bounced_(bounced) {}

    /// @param keys of the random numbers, one a ray; `frame` their index
    /// @param radiance as long as rays
    HitLightingCounters shade(const core::RayStream& rays, const core::HitStream& hits,
                              std::span<const std::uint32_t> keys, std::uint32_t frame,
                              std::span<glm::vec3> radiance) const;

private:
    const core::Scene& scene_;
    const core::Tracer& tracer_;
    const SceneLighting& lighting_;
    bool direct_;
    float roughness_min_;
    float point_roughness_min_;
    Bounced bounced_;
};

}  // namespace gather
