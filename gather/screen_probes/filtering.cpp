#include "gather/screen_probes/filtering.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/sampling.h"
#include "core/support/parallel.h"
#include "gather/screen_probes/interpolation.h"

namespace gather {

namespace {

/// Neighbours off the plane by more are not looked at.
constexpr float kLeastPlaneWeight = 0.01f;

}  // namespace

void filter_probes(const ScreenProbeSettings& settings, const TexelTable& table, ProbeAtlas& atlas) {
    const std::size_t texels = atlas.texel_count();
    const float angle_max = settings.filter_angle * core::kPi / 180.0f;
    std::vector<glm::vec3> filtered(atlas.radiance.size());
    // Texels that hold light: traced, or filled by an earlier pass.
    std::vector<std::uint8_t> known(atlas.ray_count.size());
    for (std::size_t i = 0; i < known.size(); ++i) known[i] = atlas.ray_count[i] > 0 ? 1 : 0;
    std::vector<std::uint8_t> known_after(known.size());
    for (int pass = 0; pass < settings.filter_passes; ++pass) {
        core::parallel_for(atlas.probes.size(), 32, [&](std::size_t begin, std::size_t end) {
            const core::ScopedFlushDenormals flush;
            std::vector<float> weights(texels);
            for (std::size_t p = begin; p < end; ++p) {
                const Probe& own = atlas.probes[p];
                if (!own.valid()) continue;
                glm::vec3* out = filtered.data() + p * texels;
                std::uint8_t* out_known = known_after.data() + p * texels;
                for (std::size_t t = 0; t < texels; ++t) {
                    out_known[t] = known[p * texels + t];
                    // A culled texel holds nothing before it is filled, and little of its own then.
                    const bool traced = atlas.ray_count[p * texels + t] > 0;
                    weights[t] = traced ? 1.0f : out_known[t] ? settings.culled_weight : 0.0f;
                    out[t] = weights[t] * atlas.radiance[p * texels + t];
                }
                const glm::ivec2 tile = own.pixel / atlas.spacing;
                for (int y = std::max(0, tile.y - 1); y <= std::min(tile.y + 1, atlas.tiles_y - 1); ++y) {
                    for (int x = std::max(0, tile.x - 1); x <= std::min(tile.x + 1, atlas.tiles_x - 1); ++x) {
                        const auto n = static_cast<std::size_t>(y * atlas.tiles_x + x);
                        const Probe& other = atlas.probes[n];
                        if (n == p || !other.valid()) continue;
                        const float plane =
                            surface_weight(own.position, own.normal, own.plane_scale, other.position,
                                           other.normal, settings.plane_sharpness);
                        if (!(plane > kLeastPlaneWeight)) continue;
                        const glm::vec3 offset = other.position - own.position;
                        for (std::size_t t = 0; t < texels; ++t) {
                            if (!known[n * texels + t]) continue;
                            // A texel filled by a neighbour has no distance of its own.
                            float h = atlas.ray_count[n * texels + t] > 0 ? atlas.hit_distance[n * texels + t]
                                                                          : own.depth;
                            if (settings.clamp_hit_distance && atlas.ray_count[p * texels + t] > 0) {
                                h = std::min(h, atlas.hit_distance[p * texels + t]);
                            }
                            const glm::vec3& d = table.centers()[t];
                            const glm::vec3 seen = offset + h * d;
                            const float length2 = glm::dot(seen, seen);
                            if (!(length2 > 0.0f)) continue;
                            const float cosine = glm::dot(d, seen) / std::sqrt(length2);
                            // The angle, to 0.2 % where it is small enough to count.
                            const float angle = std::sqrt(std::max(0.0f, 2.0f - 2.0f * cosine));
                            const float weight = plane * (1.0f - std::min(1.0f, angle / angle_max));
                            if (!(weight > 0.0f)) continue;
                            weights[t] += weight;
                            out[t] += weight * atlas.radiance[n * texels + t];
                            out_known[t] = 1;
                        }
                    }
                }
                for (std::size_t t = 0; t < texels; ++t) {
                    out[t] = weights[t] > 0.0f ? out[t] / weights[t] : glm::vec3(0.0f);
                }
            }
        });
        std::swap(atlas.radiance, filtered);
        std::swap(known, known_after);
    }
}

}  // namespace gather
