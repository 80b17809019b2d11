#include "gather/screen_probes/tracing.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>

#include "core/image/image.h"
#include "core/math/octahedral.h"
#include "core/math/random.h"
#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr std::uint32_t kJitterUse = 0x6d17e2u;
constexpr std::uint32_t kProbeUse = 0x7ac3b1u;

/// Rays of one stream; probes are dealt to streams by this.
constexpr std::size_t kRaysAtOnce = 8192;

/// What one stream of probes works with.
struct Batch {
    core::RayStream rays;
    core::HitStream hits;
    std::vector<ProbeRay> choice;      ///< Of all its probes, one after the other.
    std::vector<std::uint32_t> order;  ///< Ray of the stream -> index into `choice`.
    std::vector<std::uint32_t> begin;  ///< Counting sort.
    std::vector<std::uint32_t> keys;
    std::vector<glm::vec3> radiance;
    std::vector<float> brdf, light;
};

/// Places within a texel that a ray tries in turn until it leaves the surface. The same for all probes of a
/// frame, so that the rays of neighbours match.
using Jitters = std::array<glm::vec2, 8>;

Jitters frame_jitters(const ProbeTraceInputs& in) {
    Jitters jitters;
    const auto count = static_cast<std::uint32_t>(jitters.size());
    // Without jitter the centre comes first, and the others are the same in every frame.
    const std::uint32_t frame = in.settings.jitter_directions ? in.frame : 0;
    for (std::uint32_t k = 0; k < count; ++k) {
        jitters[k] = core::SampleSequence(pixel_key(in.inputs.seed, 0, k, kJitterUse), frame).point(0);
    }
    if (!in.settings.jitter_directions) jitters[0] = glm::vec2(0.5f);
    return jitters;
}

/// A direction within the texel of a ray, above the probe's surface if any tried is: what lies under it is
/// the surface itself, whose own light would shine on it through the texels that straddle its horizon.
glm::vec3 ray_direction(const ProbeRay& ray, int resolution, const Jitters& jitters,
                        const glm::vec3& normal) {
    const auto edge = static_cast<float>(resolution << ray.level);
    glm::vec3 first(0.0f);
    for (std::size_t k = 0; k < jitters.size(); ++k) {
        const glm::vec3 direction =
            glm::normalize(core::direction_from_octahedral((glm::vec2(ray.x, ray.y) + jitters[k]) / edge));
        if (glm::dot(direction, normal) > 0.0f) return direction;
        if (k == 0) first = direction;
    }
    return first;
}

void choose(const ProbeTraceInputs& in, const Probe& probe, std::span<ProbeRay> rays, Batch& batch) {
    if (!in.cull) return;
    const core::Sh lobe = accumulate_brdf(in.visible, probe, in.settings.spacing, in.settings.plane_sharpness,
                                          in.specular_roughness_max);
    const std::vector<core::Sh>& mean = in.table.mean_sh();
    batch.brdf.resize(mean.size());
    for (std::size_t texel = 0; texel < mean.size(); ++texel) {
        batch.brdf[texel] = std::max(0.0f, core::sh_dot(lobe, mean[texel]));
    }
    batch.light.clear();
    if (in.last) guess_light(*in.last, probe, in.settings.plane_sharpness, batch.light);
    choose_rays(batch.brdf, batch.light, in.settings.cull_threshold, rays);
}

}  // namespace

ProbeTraceCost trace_probes(const ProbeTraceInputs& in, ProbeAtlas& atlas) {
    atlas.allocate_texels();
    const std::size_t texels = atlas.texel_count();
    const std::size_t probes_at_once = std::max<std::size_t>(1, kRaysAtOnce / texels);
    const std::vector<ProbeRay> uniform = uniform_rays(atlas.resolution);
    const Jitters jitters = frame_jitters(in);
    const std::size_t batches = (atlas.probes.size() + probes_at_once - 1) / probes_at_once;
    std::vector<double> brought(batches, 0.0);
    std::vector<double> removed(batches, 0.0);
    std::atomic<std::uint64_t> ray_count{0}, shadow_count{0}, exhausted{0};
    core::parallel_for(batches, 1, [&](std::size_t begin_batch, std::size_t end_batch) {
        const core::ScopedFlushDenormals flush;
        Batch batch;
        for (std::size_t b = begin_batch; b < end_batch; ++b) {
            const std::size_t first = b * probes_at_once;
            const std::size_t last = std::min(first + probes_at_once, atlas.probes.size());
            batch.choice.clear();
            std::vector<std::uint32_t> probe_of;
            for (std::size_t p = first; p < last; ++p) {
                if (!atlas.probes[p].valid()) continue;
                probe_of.push_back(static_cast<std::uint32_t>(p));
                batch.choice.insert(batch.choice.end(), uniform.begin(), uniform.end());
                choose(in, atlas.probes[p],
                       std::span<ProbeRay>(batch.choice).subspan(batch.choice.size() - texels), batch);
            }
            const std::size_t count = batch.choice.size();
            // By direction, then by probe.
            batch.begin.assign(texels + 1, 0);
            for (const ProbeRay& ray : batch.choice) ++batch.begin[ray.texel(atlas.resolution) + 1];
            for (std::size_t t = 0; t < texels; ++t) batch.begin[t + 1] += batch.begin[t];
            batch.order.resize(count);
            for (std::uint32_t i = 0; i < count; ++i) {
                batch.order[batch.begin[batch.choice[i].texel(atlas.resolution)]++] = i;
            }
            batch.rays.resize(count);
            batch.keys.resize(count);
            batch.radiance.resize(count);
            for (std::size_t i = 0; i < count; ++i) {
                const ProbeRay& choice = batch.choice[batch.order[i]];
                const std::uint32_t probe_index = probe_of[batch.order[i] / texels];
                const Probe& probe = atlas.probes[probe_index];
                core::Ray ray;
                ray.direction = ray_direction(choice, atlas.resolution, jitters, probe.normal);
                ray.origin = in.visible.origins[in.visible.index(probe.pixel.x, probe.pixel.y)];
                batch.keys[i] = core::hash_words(
                    pixel_key(in.inputs.seed, probe.pixel.x, probe.pixel.y, kProbeUse), choice.x, choice.y,
                    choice.level + 2u * static_cast<std::uint32_t>(probe.level));
                ray.seed = core::SampleSequence(batch.keys[i], in.frame).bits(7);
                batch.rays.set(i, ray);
            }
            in.inputs.tracer.trace_closest(batch.rays, batch.hits);
            const HitLightingCounters lit =
                in.hit_lighting.shade(batch.rays, batch.hits, batch.keys, in.frame, batch.radiance);
            ray_count += count;
            shadow_count += lit.shadow_rays;
            exhausted += lit.exhausted;

            for (std::size_t i = 0; i < count; ++i) {
                const ProbeRay& choice = batch.choice[batch.order[i]];
                const std::size_t texel =
                    probe_of[batch.order[i] / texels] * texels + choice.texel(atlas.resolution);
                glm::vec3 light = batch.radiance[i];
                const float bright = core::luminance(light);
                brought[b] += static_cast<double>(bright);
                if (in.settings.max_ray_intensity > 0.0f && bright > in.settings.max_ray_intensity) {
                    light *= in.settings.max_ray_intensity / bright;
                    removed[b] += static_cast<double>(bright - in.settings.max_ray_intensity);
                }
                const float distance = batch.hits.status[i] == core::HitStatus::kHit
                                           ? batch.hits.t[i]
                                           : in.lighting.trace_limit();
                atlas.radiance[texel] += light;
                atlas.hit_distance[texel] =
                    atlas.ray_count[texel] == 0 ? distance : std::min(atlas.hit_distance[texel], distance);
                ++atlas.ray_count[texel];
            }
            for (const std::uint32_t p : probe_of) {
                for (std::size_t texel = p * texels; texel < (p + 1) * texels; ++texel) {
                    assert(atlas.ray_count[texel] == 0 || atlas.ray_count[texel] == 1 ||
                           atlas.ray_count[texel] == 4);
                    if (atlas.ray_count[texel] > 1) {
                        atlas.radiance[texel] /= static_cast<float>(atlas.ray_count[texel]);
                    }
                }
            }
        }
    });
    double all = 0.0;
    double gone = 0.0;
    for (std::size_t b = 0; b < batches; ++b) {
        all += brought[b];
        gone += removed[b];
    }
    return {ray_count, shadow_count, exhausted, all > 0.0 ? gone / all : 0.0};
}

}  // namespace gather
