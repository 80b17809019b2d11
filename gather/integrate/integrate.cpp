#include "gather/integrate/integrate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/image/image.h"
#include "core/math/octahedral.h"
#include "core/math/random.h"
#include "core/math/sampling.h"
#include "core/support/parallel.h"
#include "gather/integrate/reflectance.h"
#include "gather/integrate/reflections.h"
#include "gather/integrate/rough_lobe.h"

namespace gather {

namespace {

constexpr std::size_t kPixelsAtOnce = 1024;

core::ShColor mix_sh(const ProbeAtlas& atlas, const ProbeWeights& weights) {
    core::ShColor sum{};
    for (std::size_t i = 0; i < weights.count; ++i) {
        const core::ShColor& sh = atlas.sh[weights.probe[i]];
        for (std::size_t k = 0; k < core::kShCount; ++k) sum[k] += weights.weight[i] * sh[k];
    }
    return sum;
}

/// One of the probes by its weight: a direction reads one, and their mean over directions and frames is the
/// interpolation. @param u in [0, 1). @pre weights.count > 0
std::size_t choose_probe(const ProbeWeights& weights, float u) {
    std::size_t i = 0;
    for (; i + 1 < weights.count && u >= weights.weight[i]; ++i) u -= weights.weight[i];
    return weights.probe[i];
}

/// Irradiance about a normal.
glm::vec3 irradiance(const IntegrateInputs& in, const ProbeWeights& weights, const glm::vec3& normal,
                     std::vector<float>& cosine_weights) {
    if (in.settings.diffuse == DiffuseIntegral::kSh) {
        return glm::max(glm::vec3(0.0f),
                        core::sh_dot(mix_sh(in.atlas, weights), core::sh_clamped_cosine(normal)));
    }
    cosine_weights.resize(in.atlas.texel_count());
    in.table.cosine_weights(normal, cosine_weights);
    glm::vec3 sum(0.0f);
    for (std::size_t i = 0; i < weights.count; ++i) {
        const std::span<const glm::vec3> texels = in.atlas.radiance_of(weights.probe[i]);
        glm::vec3 one(0.0f);
        for (std::size_t t = 0; t < texels.size(); ++t) one += cosine_weights[t] * texels[t];
        sum += weights.weight[i] * one;
    }
    return sum;
}

/// Radiance that the specular lobe of a rough surface sends to the eye.
glm::vec3 rough_reflection(const IntegrateInputs& in, const ProbeWeights& weights,
                           const core::SurfacePoint& point, const glm::vec3& outgoing) {
    if (in.settings.diffuse == DiffuseIntegral::kSh) {
        const core::ShColor lobe = rough_lobe(point, outgoing);
        const core::ShColor light = mix_sh(in.atlas, weights);
        glm::vec3 sum(0.0f);
        for (std::size_t k = 0; k < core::kShCount; ++k) sum += lobe[k] * light[k];
        return glm::max(glm::vec3(0.0f), sum);
    }
    const glm::vec3 local_outgoing = point.frame.to_local(outgoing);
    const float solid_angle = 4.0f * core::kPi / static_cast<float>(in.atlas.texel_count());
    glm::vec3 sum(0.0f);
    for (std::size_t t = 0; t < in.atlas.texel_count(); ++t) {
        const glm::vec3 incoming = point.frame.to_local(in.table.centers()[t]);
        if (!(incoming.z > 0.0f)) continue;
        glm::vec3 light(0.0f);
        for (std::size_t i = 0; i < weights.count; ++i) {
            light += weights.weight[i] * in.atlas.radiance_of(weights.probe[i])[t];
        }
        sum += core::evaluate(point.brdf, local_outgoing, incoming).value.specular *
               (incoming.z * solid_angle) * light;
    }
    return sum;
}

/// The same by directions drawn to the visible normals of GGX.
glm::vec3 directional_reflection(const IntegrateInputs& in, const ProbeWeights& weights,
                                 const core::SurfacePoint& point, std::size_t pixel) {
    glm::vec3 sum(0.0f);
    if (weights.count == 0) return sum;
    const auto width = static_cast<std::size_t>(in.visible.width);
    const auto samples = static_cast<std::uint32_t>(in.settings.specular_directions);
    const std::uint32_t key =
        pixel_key(in.seed, static_cast<int>(pixel % width), static_cast<int>(pixel / width), kSpecularUse);
    const glm::vec3 outgoing = point.frame.to_local(in.visible.outgoing[pixel]);
    for (std::uint32_t k = 0; k < samples; ++k) {
        const core::SampleSequence sequence(key, in.frame * samples + k);
        const core::BrdfSample chosen = core::sample_specular(point.brdf, outgoing, sequence.point(0));
        if (!(chosen.pdf > 0.0f)) continue;
        const glm::vec3 direction = glm::normalize(point.frame.to_world(chosen.incoming));
        const glm::vec3 light = in.atlas.read(choose_probe(weights, sequence.point(1).x),
                                              core::octahedral_from_direction(direction));
        sum += chosen.value.specular * (chosen.incoming.z / chosen.pdf) * light;
    }
    return sum / static_cast<float>(samples);
}

}  // namespace

void IndirectLight::reset(std::size_t pixels, bool controlled) {
    const std::array<std::vector<glm::vec3>*, 4> all = {&diffuse, &specular, &diffuse_control,
                                                        &specular_control};
    for (std::size_t i = 0; i < all.size(); ++i) all[i]->resize(controlled || i < 2 ? pixels : 0);
    core::parallel_for(pixels, kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::vector<glm::vec3>* light : all) {
            if (!light->empty()) std::fill(light->begin() + begin, light->begin() + end, glm::vec3(0.0f));
        }
    });
}

void interpolate_probes(const IntegrateInputs& in, std::vector<ProbeWeights>& weights) {
    const VisibleSurfaces& visible = in.visible;
    weights.resize(visible.depth.size());
    const auto width = static_cast<std::size_t>(visible.width);
    core::parallel_for(weights.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
            if (!visible.surface(pixel)) continue;
            const glm::ivec2 at(pixel % width, pixel / width);
            const core::SurfacePoint& point = visible.points[pixel];
            ProbeReader reader{
                glm::vec2(at), point.position, point.geometric_normal, visible.plane_scale(pixel),
                visible.footprint.at(visible.depth[pixel]) * static_cast<float>(in.atlas.spacing)};
            if (in.probes.jitter_interpolation && in.atlas.spacing > 1) {
                const core::SampleSequence sequence(pixel_key(in.seed, at.x, at.y, kInterpolationUse),
                                                    in.frame);
                const glm::vec2 offset =
                    (sequence.independent_point(0) - 0.5f) * static_cast<float>(in.atlas.spacing);
                const glm::ivec2 moved = glm::clamp(at + glm::ivec2(glm::round(offset)), glm::ivec2(0),
                                                    glm::ivec2(visible.width, visible.height) - 1);
                const std::size_t there = visible.index(moved.x, moved.y);
                if (visible.surface(there) &&
                    is_same_plane(point, visible.plane_scale(pixel), visible.points[there],
                                  in.probes.plane_sharpness)) {
                    reader.pixel = glm::vec2(moved);
                }
            }
            weights[pixel] = find_probes(in.atlas, reader, in.probes.plane_sharpness);
        }
    });
}

void integrate_diffuse(const IntegrateInputs& in, const std::vector<ProbeWeights>& weights,
                       const std::vector<BentNormal>& bent, const std::vector<NearLight>& near_light,
                       IndirectLight& light) {
    const VisibleSurfaces& visible = in.visible;
    core::parallel_for(weights.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        std::vector<float> cosine_weights;
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
            if (!visible.surface(pixel)) continue;
            const core::SurfacePoint& point = visible.points[pixel];
            const glm::vec3& normal = point.frame.normal;
            const glm::vec3 albedo = diffuse_albedo(point.brdf, glm::dot(normal, visible.outgoing[pixel]));
            if (albedo == glm::vec3(0.0f)) continue;
            const glm::vec3 brdf = albedo / core::kPi;
            const NearLight near = near_light.empty() ? NearLight{} : near_light[pixel];
            light.diffuse[pixel] += brdf * near.found.irradiance;
            if (!(near.open_share + near.compared_share > 0.0f)) continue;
            glm::vec3 arriving = irradiance(in, weights[pixel], normal, cosine_weights);
            if (!bent.empty() && bent[pixel].visibility < 1.0f) {
                const float v = bent[pixel].visibility;
                const float occlusion = multi_bounce(
                    v, std::min(in.settings.near_field_albedo_max, core::luminance(point.brdf.diffuse)));
                // The open part's share of what the same harmonics give for the whole hemisphere.
                const core::ShColor sh = mix_sh(in.atlas, weights[pixel]);
                arriving = cone_irradiance(sh, bent[pixel]) + (occlusion - v) * arriving;
            }
            light.diffuse[pixel] += near.open_share * brdf * arriving;
            if (near.compared_share > 0.0f) {
                light.diffuse_control[pixel] +=
                    brdf * (near.compared_share * arriving - near.held.irradiance);
            }
        }
    });
}

void integrate_specular(const IntegrateInputs& in, const std::vector<ProbeWeights>& weights,
                        const SpecularModes& modes, const std::vector<NearLight>& near_light,
                        IndirectLight& light) {
    const VisibleSurfaces& visible = in.visible;
    core::parallel_for(weights.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
            if (!visible.surface(pixel)) continue;
            const core::SurfacePoint& point = visible.points[pixel];
            if (!core::has_specular(point.brdf)) continue;
            if (modes.reflections && takes_reflection_rays(point, in.settings)) continue;
            const bool has_near = !near_light.empty() && reflects_near_light(point);
            const NearLight near = has_near ? near_light[pixel] : NearLight{};
            light.specular[pixel] += near.found.specular;
            if (!(near.open_share + near.compared_share > 0.0f)) continue;
            const glm::vec3 arriving =
                modes.directional && point.roughness <= in.settings.rough_specular_max
                    ? directional_reflection(in, weights[pixel], point, pixel)
                    : rough_reflection(in, weights[pixel], point, visible.outgoing[pixel]);
            light.specular[pixel] += near.open_share * arriving;
            if (near.compared_share > 0.0f) {
                light.specular_control[pixel] += near.compared_share * arriving - near.held.specular;
            }
        }
    });
}

}  // namespace gather
