#include "gather/screen_probes/importance.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "core/image/image.h"
#include "gather/screen_probes/interpolation.h"

namespace gather {

namespace {

/// Pixels asked along an edge of the square that a probe serves.
constexpr int kPixelsAlongEdge = 6;

}  // namespace

std::vector<ProbeRay> uniform_rays(int resolution) {
    std::vector<ProbeRay> rays;
    for (int y = 0; y < resolution; ++y) {
        for (int x = 0; x < resolution; ++x) {
            rays.push_back({static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 0});
        }
    }
    return rays;
}

void choose_rays(std::span<const float> brdf, std::span<const float> light, float cull_threshold,
                 std::span<ProbeRay> rays) {
    assert(rays.size() == brdf.size());
    struct Entry {
        float worth;
        std::uint32_t ray;
    };
    std::vector<Entry> sorted(rays.size());
    const auto resolution = static_cast<int>(std::lround(std::sqrt(static_cast<double>(brdf.size()))));
    for (std::uint32_t i = 0; i < rays.size(); ++i) {
        const std::size_t texel = rays[i].texel(resolution);
        float worth = brdf[texel] * (light.empty() ? 1.0f : light[texel]);
        // The guess of the light may be wrong, so it never culls.
        if (brdf[texel] >= cull_threshold) worth = std::max(worth, cull_threshold);
        sorted[i] = {worth, i};
    }
    std::sort(sorted.begin(), sorted.end(), [](const Entry& a, const Entry& b) {
        return a.worth != b.worth ? a.worth < b.worth : a.ray < b.ray;
    });
    std::size_t low = 0;
    std::size_t high = sorted.size();
    while (high - low >= 4 && sorted[low + 2].worth < cull_threshold &&
           sorted[high - 1].worth >= cull_threshold) {
        const ProbeRay parent = rays[sorted[high - 1].ray];
        const std::array<std::uint32_t, 4> children = {sorted[low].ray, sorted[low + 1].ray,
                                                       sorted[low + 2].ray, sorted[high - 1].ray};
        for (std::uint32_t child = 0; child < 4; ++child) {
            rays[children[child]] = {static_cast<std::uint8_t>(2 * parent.x + (child & 1)),
                                     static_cast<std::uint8_t>(2 * parent.y + (child >> 1)), 1};
        }
        low += 3;
        --high;
    }
}

namespace {

/// What the specular lobe reflects over what the diffuse one does, at most 1. @param cosine of the outgoing
/// direction
float specular_share(const core::Brdf& brdf, float cosine) {
    const float m = 1.0f - std::clamp(cosine, 0.0f, 1.0f);
    const glm::vec3 specular = brdf.f0 + (brdf.f90 - brdf.f0) * (m * m * m * m * m);
    const float diffuse = core::luminance(brdf.diffuse);
    return std::min(1.0f, core::luminance(specular) / std::max(diffuse, std::numeric_limits<float>::min()));
}

}  // namespace

core::Sh accumulate_brdf(const VisibleSurfaces& visible, const Probe& probe, int spacing,
                         float plane_sharpness, const SpecularReaders& readers) {
    core::Sh sum{};
    float total = 0.0f;
    const auto add = [&](const glm::vec3& direction, float weight) {
        const core::Sh lobe = core::sh_clamped_cosine(direction);
        for (std::size_t k = 0; k < core::kShCount; ++k) sum[k] += weight * lobe[k];
    };
    const auto consider = [&](int x, int y) {
        if (x < 0 || y < 0 || x >= visible.width || y >= visible.height) return;
        const std::size_t pixel = visible.index(x, y);
        if (!visible.surface(pixel)) return;
        const core::SurfacePoint& point = visible.points[pixel];
        const float weight =
            surface_weight(point.position, point.geometric_normal, visible.plane_scale(pixel), probe.position,
                           probe.normal, plane_sharpness);
        if (!(weight > 0.01f)) return;
        total += weight;
        add(point.frame.normal, weight);
        if (readers.contains(point)) {
            const float share =
                specular_share(point.brdf, glm::dot(point.frame.normal, visible.outgoing[pixel]));
            add(glm::reflect(-visible.outgoing[pixel], point.frame.normal), weight * share);
        }
    };
    consider(probe.pixel.x, probe.pixel.y);
    const int step = std::max(1, 2 * spacing / kPixelsAlongEdge);
    for (int dy = -spacing + step / 2; dy < spacing; dy += step) {
        for (int dx = -spacing + step / 2; dx < spacing; dx += step) {
            consider(probe.pixel.x + dx, probe.pixel.y + dy);
        }
    }
    if (total > 0.0f) {
        for (float& coefficient : sum) coefficient /= total;
    }
    return sum;
}

void guess_light(const ProbeAtlas& last, const Probe& probe, float plane_sharpness,
                 std::vector<float>& light) {
    light.clear();
    const ProbeWeights weights = find_probes(
        last, {glm::vec2(probe.pixel), probe.position, probe.normal, probe.plane_scale}, plane_sharpness);
    if (!weights.confident || weights.count == 0) return;
    light.assign(last.texel_count(), 0.0f);
    for (std::size_t i = 0; i < weights.count; ++i) {
        const std::span<const glm::vec3> texels = last.radiance_of(weights.probe[i]);
        for (std::size_t texel = 0; texel < texels.size(); ++texel) {
            light[texel] += weights.weight[i] * core::luminance(texels[texel]);
        }
    }
    double sum = 0.0;
    for (const float value : light) sum += static_cast<double>(value);
    const auto scale = static_cast<float>(static_cast<double>(light.size()) / sum);
    if (!(sum > 0.0) || !std::isfinite(sum) || !std::isfinite(scale)) {
        light.clear();
        return;
    }
    for (float& value : light) value *= scale;
}

}  // namespace gather
