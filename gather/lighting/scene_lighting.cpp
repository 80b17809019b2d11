#include "gather/lighting/scene_lighting.h"

#include <algorithm>
#include <cmath>

#include "core/image/image.h"
#include "core/math/sampling.h"

namespace gather {

namespace {

/// What decides whether an instance's emission is sampled.
struct EmitterEstimate {
    double area = 0.0;
    double power = 0.0;  ///< Luminance times area.
};

EmitterEstimate estimate_emitter(const core::Scene& scene, std::uint32_t index) {
    const core::Instance& instance = scene.instances[index];
    const core::Mesh& mesh = scene.meshes[instance.mesh];
    EmitterEstimate result;
    for (std::size_t part_index = 0; part_index < mesh.parts.size(); ++part_index) {
        const core::Material& material = scene.materials[instance.materials[part_index]];
        if (!material.emissive()) continue;
        const core::MeshPart& part = mesh.parts[part_index];
        for (std::uint32_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
            glm::dvec3 points[3];
            for (int corner = 0; corner < 3; ++corner) {
                points[corner] = glm::dvec3(instance.world_from_local *
                                            glm::dvec4(mesh.positions[mesh.triangles[t][corner]], 1.0));
            }
            const double area = 0.5 * glm::length(glm::cross(points[1] - points[0], points[2] - points[0]));
            const glm::vec3 emission = core::sample_emission(
                scene, material, core::surface_coordinates(mesh, t, glm::vec2(1.0f / 3.0f)));
            result.area += area;
            result.power += area * static_cast<double>(core::luminance(emission));
        }
    }
    return result;
}

std::vector<std::uint8_t> choose_emitters(const core::Scene& scene, double radius,
                                          const LightingSettings& settings) {
    std::vector<std::uint8_t> chosen(scene.instances.size(), 0);
    if (settings.sampled_emitters == SampledEmitters::kNone) return chosen;
    std::vector<EmitterEstimate> estimates(scene.instances.size());
    double total = 0.0;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        estimates[i] = estimate_emitter(scene, i);
        total += estimates[i].power;
    }
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        if (!(estimates[i].area > 0.0)) continue;
        if (settings.sampled_emitters == SampledEmitters::kAll) {
            chosen[i] = 1;
            continue;
        }
        // As seen from half the scene's radius away, one side of it.
        const double distance = 0.5 * radius;
        const double solid_angle = 0.5 * estimates[i].area / std::max(distance * distance, 1e-300);
        chosen[i] = solid_angle <= static_cast<double>(settings.sampled_solid_angle) &&
                            estimates[i].power >= static_cast<double>(settings.sampled_power_share) * total
                        ? 1
                        : 0;
    }
    return chosen;
}

double scene_radius(const core::Scene& scene) {
    return scene.instances.empty() ? 1.0 : 0.5 * glm::length(core::world_bounds(scene).extent());
}

float sky_ratio(const LightingSettings& settings) {
    switch (settings.sampled_emitters) {
        case SampledEmitters::kNone:
            return std::numeric_limits<float>::infinity();
        case SampledEmitters::kAll:
            return 0.0f;
        case SampledEmitters::kAuto:
            break;
    }
    return settings.sky_peak_ratio;
}

/// Rougher lobes are wide enough for light sampling.
constexpr float kMirrorRoughness = 0.5f;

bool any_positive(const glm::vec3& v) {
    return v.x > 0.0f || v.y > 0.0f || v.z > 0.0f;
}

/// What a ray chosen by the BRDF brings, weighted against sample_light().
glm::vec3 light_by_lobe(const core::Scene& scene, const core::LightSampler& sampler, const LobeRay& lobe,
                        const core::Hit& hit) {
    glm::vec3 light(0.0f);
    if (hit.status == core::HitStatus::kHit) {
        if (!sampler.samples_emitter(hit.instance) || !sampler.emits(hit.instance, hit.triangle))
            return light;
        light = core::surface_at(scene, lobe.ray, hit).emission *
                core::power_heuristic(lobe.chosen.pdf,
                                      sampler.emitter_pdf(lobe.receiver, lobe.selection, hit.instance,
                                                          hit.triangle, lobe.ray.direction, hit.t));
    } else if (hit.status == core::HitStatus::kMiss) {
        light = sampler.weighted_escaped_radiance(lobe.receiver, lobe.selection, lobe.ray.direction,
                                                  lobe.chosen.pdf);
    }
    return lobe.chosen.value.sum() * (lobe.chosen.incoming.z / lobe.chosen.pdf) * light;
}

}  // namespace

bool gathers_anything(const core::Scene& scene, const LightingSettings& settings) {
    if (!core::split_sky(scene.sky, sky_ratio(settings)).base.black()) return true;
    const std::vector<std::uint8_t> sampled = choose_emitters(scene, scene_radius(scene), settings);
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        if (sampled[i] != 0) continue;
        for (const std::uint32_t material : scene.instances[i].materials) {
            if (scene.materials[material].emissive()) return true;
        }
    }
    return false;
}

SceneLighting::SceneLighting(const core::Scene& scene, const core::Tracer& tracer,
                             const LightingSettings& settings)
    : everything_(scene), sky_(core::split_sky(scene.sky, sky_ratio(settings))) {
    const double radius = scene_radius(scene);
    trace_limit_ = static_cast<float>(std::min(4.0 * radius, 1e30));
    sampled_emitters_ = choose_emitters(scene, radius, settings);
    sampled_.emplace(scene, core::LightSubset{sky_.peaks.black() ? nullptr : &sky_.peaks, sampled_emitters_});
    samples_extended_ = !sky_.peaks.black() || std::any_of(sampled_emitters_.begin(), sampled_emitters_.end(),
                                                           [](std::uint8_t chosen) { return chosen != 0; });
    start_offsets_.resize(scene.instances.size());
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) start_offsets_[i] = tracer.start_offset(i);
}

int SceneLighting::direct_samples(int wanted) const {
    if (samples_extended_) return wanted;
    return std::min(wanted, std::max(1, static_cast<int>(sampled_->group_count())));
}

std::optional<LightArrival> sample_light(const SceneLighting& lighting, const core::LightSampler& sampler,
                                         const core::LightSampler::Selection& selection,
                                         const core::SurfacePoint& surface, const glm::vec3& origin,
                                         const glm::vec3& outgoing, const glm::vec2& u, std::uint32_t seed,
                                         float point_alpha_min) {
    const core::LightSampler::Sample light =
        sampler.sample(core::LightReceiver{origin, surface.geometric_normal}, selection, u);
    if (!(light.pdf > 0.0f) || !any_positive(light.radiance) ||
        !(glm::dot(light.direction, surface.geometric_normal) > 0.0f)) {
        return std::nullopt;
    }
    const glm::vec3 incoming = surface.frame.to_local(light.direction);
    core::Brdf lobes = surface.brdf;
    if (light.delta) lobes.alpha = std::max(lobes.alpha, point_alpha_min);
    const core::BrdfEvaluation brdf = core::evaluate(lobes, surface.frame.to_local(outgoing), incoming);
    const float weight =
        mirrors_lights(surface) && !light.delta ? core::power_heuristic(light.pdf, brdf.pdf) : 1.0f;
    const glm::vec3 irradiance = light.radiance * (weight * incoming.z / light.pdf);
    LightArrival result;
    result.diffuse = brdf.value.diffuse * irradiance;
    result.specular = brdf.value.specular * irradiance;
    if (!any_positive(result.diffuse + result.specular)) return std::nullopt;
    // The ray stops short of the emitter by what the tracer may misplace its surface.
    const float stop_short = light.instance == core::kNoIndex
                                 ? 0.0f
                                 : lighting.start_offset(light.instance) + 4e-6f * light.distance;
    result.shadow_ray.origin = origin;
    result.shadow_ray.direction = light.direction;
    result.shadow_ray.t_max = light.distance - stop_short;
    result.shadow_ray.seed = seed;
    if (!(result.shadow_ray.t_max > 0.0f)) return std::nullopt;
    return result;
}

bool mirrors_lights(const core::SurfacePoint& surface) {
    return surface.roughness <= kMirrorRoughness && core::has_specular(surface.brdf);
}

std::optional<LobeRay> sample_lobe(const core::LightSampler::Selection& selection,
                                   const core::SurfacePoint& surface, const glm::vec3& origin,
                                   const glm::vec3& outgoing, float u_lobe, const glm::vec2& u,
                                   std::uint32_t seed) {
    LobeRay result;
    result.chosen = core::sample(surface.brdf, surface.frame.to_local(outgoing), u_lobe, u);
    if (!(result.chosen.pdf > 0.0f)) return std::nullopt;
    result.ray.direction = glm::normalize(surface.frame.to_world(result.chosen.incoming));
    if (!(glm::dot(result.ray.direction, surface.geometric_normal) > 0.0f)) return std::nullopt;
    result.ray.origin = origin;
    result.ray.seed = seed;
    result.receiver = {origin, surface.geometric_normal};
    result.selection = selection;
    return result;
}

std::uint64_t trace_lobes(const core::Scene& scene, const core::Tracer& tracer,
                          const core::LightSampler& sampler, std::span<const LobeRay> lobes,
                          const std::function<void(std::size_t lobe, const glm::vec3& light)>& add) {
    if (lobes.empty()) return 0;
    core::RayStream rays;
    core::HitStream hits;
    rays.resize(lobes.size());
    for (std::size_t i = 0; i < lobes.size(); ++i) rays.set(i, lobes[i].ray);
    tracer.trace_closest(rays, hits);
    std::uint64_t exhausted = 0;
    for (std::size_t i = 0; i < lobes.size(); ++i) {
        exhausted += hits.status[i] == core::HitStatus::kExhausted ? 1 : 0;
        add(i, light_by_lobe(scene, sampler, lobes[i], hits.get(i)));
    }
    return exhausted;
}

HitLightingCounters HitLighting::shade(const core::RayStream& rays, const core::HitStream& hits,
                                       std::span<const std::uint32_t> keys, std::uint32_t frame,
                                       std::span<glm::vec3> radiance) const {
    enum Dimension : std::uint32_t { kLight, kAlpha, kLobe, kLobeDirection, kLobeAlpha };
    HitLightingCounters counters;
    core::RayStream shadow_rays;
    shadow_rays.resize(direct_ ? rays.size() : 0);
    std::vector<std::uint32_t> target;
    std::vector<glm::vec3> arriving;
    std::vector<LobeRay> lobes;
    std::vector<std::uint32_t> lobe_target;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        radiance[i] = glm::vec3(0.0f);
        const core::Ray ray = rays.get(i);
        if (hits.status[i] != core::HitStatus::kHit) {
            // An exhausted ray claims neither surface nor sky: black, and counted.
            if (hits.status[i] == core::HitStatus::kExhausted) {
                ++counters.exhausted;
            } else if (core::is_valid_ray(ray)) {
                radiance[i] = lighting_.gathered_sky(ray.direction);
            }
            continue;
        }
        const core::Hit hit = hits.get(i);
        const bool emission = lighting_.gathers_emission(hit.instance);
        if (!direct_ && !bounced_ &&
            !(emission && scene_.material_of(hit.instance, hit.triangle).emissive())) {
            continue;
        }
        core::SurfacePoint surface = core::surface_at(scene_, ray, hit);
        if (surface.roughness < roughness_min_) {
            surface.roughness = roughness_min_;
            surface.brdf.alpha = std::max(surface.brdf.alpha, roughness_min_ * roughness_min_);
        }
        if (emission) radiance[i] += surface.emission;
        if (bounced_) radiance[i] += bounced_(surface, -ray.direction);
        if (!direct_) continue;
        const core::SampleSequence sequence(keys[i], frame);
        const glm::vec3 origin = surface.origin_above();
        const core::LightSampler::Selection selection =
            lighting_.everything().selection({origin, surface.geometric_normal});
        if (mirrors_lights(surface)) {
            const auto lobe = sample_lobe(selection, surface, origin, -ray.direction, sequence.point(kLobe).x,
                                          sequence.point(kLobeDirection), sequence.bits(kLobeAlpha));
            if (lobe) {
                lobes.push_back(*lobe);
                lobe_target.push_back(static_cast<std::uint32_t>(i));
            }
        }
        const auto arrival = sample_light(lighting_, lighting_.everything(), selection, surface, origin,
                                          -ray.direction, sequence.point(kLight), sequence.bits(kAlpha),
                                          point_roughness_min_ * point_roughness_min_);
        if (!arrival) continue;
        shadow_rays.set(target.size(), arrival->shadow_ray);
        target.push_back(static_cast<std::uint32_t>(i));
        arriving.push_back(arrival->diffuse + arrival->specular);
    }
    shadow_rays.resize(target.size());
    std::vector<std::uint8_t> occluded(target.size());
    if (!target.empty()) tracer_.trace_occluded(shadow_rays, occluded);
    for (std::size_t i = 0; i < target.size(); ++i) {
        if (!occluded[i]) radiance[target[i]] += arriving[i];
    }
    counters.shadow_rays = target.size() + lobes.size();
    counters.exhausted +=
        trace_lobes(scene_, tracer_, lighting_.everything(), lobes,
                    [&](std::size_t i, const glm::vec3& light) { radiance[lobe_target[i]] += light; });
    return counters;
}

}  // namespace gather
