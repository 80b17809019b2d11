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

/// Rays under the surface weigh the same, whatever they find.
constexpr float kLeastWeight = 1e-6f;

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
    std::vector<float> weights;      ///< A ray's in its texel; see WeightedDirection,
    std::vector<float> shares;       ///< also for what its light counts.
    std::vector<float> weight_sums;  ///< A texel's.
};

/// Where within its texel each ray of a frame goes, in [0, 1)^2: stratified over the frames, independent from
/// texel to texel, and shifted from probe to probe, so that no error is shared by a whole picture and the
/// filter averages different places.
class Jitter {
public:
    explicit Jitter(const ProbeTraceInputs& in)
        : on_(in.settings.jitter_directions),
          resolution_(in.settings.resolution),
          spacing_(in.settings.spacing) {
        if (!on_) return;
        for (int level = 0; level < 2; ++level) {
            const auto edge = static_cast<std::uint32_t>(resolution_ << level);
            for (std::uint32_t texel = 0; texel < edge * edge; ++texel) {
                const std::uint32_t key =
                    pixel_key(in.inputs.seed, static_cast<int>(texel), level, kJitterUse);
                places_[static_cast<std::size_t>(level)].push_back(
                    core::SampleSequence(key, in.frame).point(0));
            }
        }
        for (std::uint32_t i = 0; i < shifts_.size(); ++i) {
            shifts_[i] = core::SampleSequence(kJitterUse, i).point(0);
        }
    }

    glm::vec2 of(const Probe& probe, const ProbeRay& ray) const {
        if (!on_) return glm::vec2(0.5f);
        const int edge = resolution_ << ray.level;
        const glm::vec2 place =
            places_[ray.level][static_cast<std::size_t>(ray.y * edge + ray.x)] + shifts_[shift_of(probe)];
        return glm::min(place - glm::floor(place), 0x1.fffffep-1f);
    }

private:
    static constexpr int kEdge = 4;  // Of a block of tiles: its uniform probes take all shifts.

    std::size_t shift_of(const Probe& probe) const {
        if (probe.level > 0) {
            const auto x = static_cast<std::uint32_t>(probe.pixel.x);
            const auto y = static_cast<std::uint32_t>(probe.pixel.y);
            return core::hash_words(x, y, kJitterUse, 0) % shifts_.size();
        }
        const glm::ivec2 tile = probe.pixel / spacing_;
        return static_cast<std::size_t>(tile.y % kEdge * kEdge + tile.x % kEdge);
    }

    bool on_;
    int resolution_;
    int spacing_;
    std::array<std::vector<glm::vec2>, 2> places_;  ///< By level of the rays.
    std::array<glm::vec2, static_cast<std::size_t>(kEdge) * kEdge> shifts_{};
};

/// Along the horizon a cell's centre may lie hardly above it, and a ray of the cell far above: it counts for
/// no more.
constexpr float kMostShare = 2.0f;

struct WeightedDirection {
    glm::vec3 direction{0.0f, 0.0f, 1.0f};
    float weight = 0.0f;  ///< The mean cosine over the ray's texel, up to a factor.
    float light = 1.0f;   ///< What the ray finds counts by this much.
};

/// Cuts [0, 1) into parts as long as `weights` and finds the one that holds u, which becomes the place
/// within.
/// @pre their sum is `sum` > 0
std::size_t find_part(std::span<const float> weights, float sum, float& u) {
    float left = u * sum;
    std::size_t last = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        if (!(weights[i] > 0.0f)) continue;
        last = i;
        if (left < weights[i]) break;
        left -= weights[i];
    }
    u = std::clamp(left / weights[last], 0.0f, 0x1.fffffep-1f);
    return last;
}

/// A direction within the texel of a ray, by the cosine about the shading normal: `jitter` is warped by the
/// cosine of the texel's cells, which keeps it stratified over the frames, and what the cosine still varies
/// within a cell weighs the light. So a texel holds the mean light under the cosine, and its product with the
/// mean cosine is the irradiance that came through it: no grazing light is taken for light from higher up,
/// and what lies under the horizon, which is the surface, does not count.
WeightedDirection ray_direction(const ProbeRay& ray, const TexelTable& table, int resolution,
                                glm::vec2 jitter, const glm::vec3& normal) {
    const int edge = TexelTable::kCells >> ray.level;  // Cells of the ray's texel or quarter of one.
    const glm::ivec2 first = glm::ivec2(ray.x, ray.y) * edge;
    const std::span<const glm::vec3> cells = table.cells(ray.texel(resolution));
    std::array<std::array<float, TexelTable::kCells>, TexelTable::kCells> cosines{};
    std::array<float, TexelTable::kCells> rows{};
    float sum = 0.0f;
    for (int j = 0; j < edge; ++j) {
        for (int i = 0; i < edge; ++i) {
            const int cell =
                (first.y + j) % TexelTable::kCells * TexelTable::kCells + (first.x + i) % TexelTable::kCells;
            const float cosine = std::max(0.0f, glm::dot(cells[static_cast<std::size_t>(cell)], normal));
            cosines[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)] = cosine;
            rows[static_cast<std::size_t>(j)] += cosine;
        }
        sum += rows[static_cast<std::size_t>(j)];
    }
    const auto direction_at = [&](const glm::vec2& place) {
        const auto cells_of_map = static_cast<float>(resolution * TexelTable::kCells);
        return glm::normalize(core::direction_from_octahedral((glm::vec2(first) + place) / cells_of_map));
    };
    if (!(sum > 0.0f)) return {direction_at(jitter * static_cast<float>(edge)), 0.0f, 1.0f};
    const std::size_t row = find_part(rows, sum, jitter.y);
    const std::size_t column = find_part(cosines[row], rows[row], jitter.x);
    const glm::vec3 direction = direction_at(glm::vec2(column, row) + jitter);
    return {direction, sum / static_cast<float>(edge * edge),
            std::clamp(glm::dot(direction, normal) / cosines[row][column], 0.0f, kMostShare)};
}

void choose(const ProbeTraceInputs& in, const Probe& probe, std::span<ProbeRay> rays, Batch& batch) {
    if (!in.cull) return;
    const core::Sh lobe = accumulate_brdf(in.visible, probe, in.settings.spacing, in.settings.plane_sharpness,
                                          in.specular_readers);
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
    const Jitter jitter(in);
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
            batch.weights.resize(count);
            batch.shares.resize(count);
            batch.weight_sums.assign(count, 0.0f);
            for (std::size_t i = 0; i < count; ++i) {
                const ProbeRay& choice = batch.choice[batch.order[i]];
                const std::uint32_t probe_index = probe_of[batch.order[i] / texels];
                const Probe& probe = atlas.probes[probe_index];
                core::Ray ray;
                const std::size_t pixel = in.visible.index(probe.pixel.x, probe.pixel.y);
                const WeightedDirection chosen =
                    ray_direction(choice, in.table, atlas.resolution, jitter.of(probe, choice),
                                  in.visible.points[pixel].frame.normal);
                ray.direction = chosen.direction;
                batch.weights[i] = chosen.weight;
                batch.shares[i] = chosen.light;
                ray.origin = in.visible.origins[pixel];
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
                const Probe& probe = atlas.probes[probe_of[batch.order[i] / texels]];
                // Over the shading normal's horizon and under the surface: nothing arrives from there.
                const bool is_under =
                    batch.weights[i] > 0.0f && !(glm::dot(batch.rays.get(i).direction, probe.normal) > 0.0f);
                glm::vec3 light = is_under ? glm::vec3(0.0f) : batch.shares[i] * batch.radiance[i];
                const float bright = core::luminance(light);
                brought[b] += static_cast<double>(bright);
                if (in.settings.max_ray_intensity > 0.0f && bright > in.settings.max_ray_intensity) {
                    light *= in.settings.max_ray_intensity / bright;
                    removed[b] += static_cast<double>(bright - in.settings.max_ray_intensity);
                }
                const float distance = batch.hits.status[i] == core::HitStatus::kHit
                                           ? batch.hits.t[i]
                                           : in.lighting.trace_limit();
                const float weight = std::max(batch.weights[i], kLeastWeight);
                batch.weight_sums[batch.order[i] / texels * texels + choice.texel(atlas.resolution)] +=
                    weight;
                atlas.radiance[texel] += weight * light;
                atlas.hit_distance[texel] =
                    atlas.ray_count[texel] == 0 ? distance : std::min(atlas.hit_distance[texel], distance);
                ++atlas.ray_count[texel];
            }
            for (std::size_t i = 0; i < count; ++i) {
                const std::size_t texel = probe_of[i / texels] * texels + i % texels;
                assert(atlas.ray_count[texel] == 0 || atlas.ray_count[texel] == 1 ||
                       atlas.ray_count[texel] == 4);
                if (atlas.ray_count[texel] > 0) atlas.radiance[texel] /= batch.weight_sums[i];
            }
        }
    });
    ProbeTraceCost cost{ray_count, shadow_count, exhausted};
    for (std::size_t b = 0; b < batches; ++b) {
        cost.light += brought[b];
        cost.clamped += removed[b];
    }
    return cost;
}

}  // namespace gather
