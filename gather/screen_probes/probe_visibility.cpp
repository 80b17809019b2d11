#include "gather/screen_probes/probe_visibility.h"

#include <algorithm>
#include <atomic>

#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr std::size_t kPixelsAtOnce = 1024;

/// Both ends are lifted by this share of their distance: a chord of a round surface whose normals part by 60
/// degrees, the most that interpolation allows, runs an eighth of it below.
constexpr float kLift = 0.15f;

/// Of a weight, for a ray: less is hardly seen.
constexpr float kLeastWeight = 0.02f;

/// Nothing stands near a pixel that is at least this open.
constexpr float kOpen = 0.999f;

struct Question {
    std::size_t pixel;
    std::size_t entry;  ///< Of the pixel's weights.
};

/// @return false where both are one point
bool ray_between(const glm::vec3& a, const glm::vec3& a_normal, const Probe& b, core::Ray& ray) {
    const float lift = kLift * glm::length(b.position - a);
    const glm::vec3 origin = a + lift * a_normal;
    const glm::vec3 offset = b.position + lift * b.normal - origin;
    const float distance = glm::length(offset);
    if (!(distance > 0.0f)) return false;
    ray.origin = origin;
    ray.direction = offset / distance;
    ray.t_max = distance;
    return true;
}

void keep_visible(ProbeWeights& weights) {
    float sum = 0.0f;
    for (std::size_t i = 0; i < weights.count; ++i) sum += std::max(weights.weight[i], 0.0f);
    if (!(sum > 0.0f)) {
        for (std::size_t i = 0; i < weights.count; ++i) weights.weight[i] = -weights.weight[i];
        weights.confident = false;
        return;
    }
    for (std::size_t i = 0; i < weights.count; ++i) {
        weights.weight[i] = std::max(weights.weight[i], 0.0f) / sum;
    }
}

}  // namespace

PassRays hide_probes(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                     const ProbeAtlas& atlas, std::span<const float> openness,
                     std::vector<ProbeWeights>& weights) {
    std::atomic<std::uint64_t> ray_count{0};
    core::parallel_for(weights.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        const core::ScopedFlushDenormals flush;
        std::vector<Question> questions;
        std::vector<core::Ray> asked;
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
            if (!visible.surface(pixel) || !weights[pixel].confident) continue;
            if (!openness.empty() && openness[pixel] >= kOpen) continue;
            const core::SurfacePoint& point = visible.points[pixel];
            for (std::size_t i = 0; i < weights[pixel].count; ++i) {
                core::Ray ray;
                if (weights[pixel].weight[i] < kLeastWeight ||
                    !ray_between(point.position, point.geometric_normal,
                                 atlas.probes[weights[pixel].probe[i]], ray)) {
                    continue;
                }
                ray.seed =
                    pixel_key(inputs.seed, static_cast<int>(pixel), static_cast<int>(i), kVisibilityUse);
                asked.push_back(ray);
                questions.push_back({pixel, i});
            }
        }
        if (asked.empty()) return;
        core::RayStream rays;
        rays.resize(asked.size());
        for (std::size_t i = 0; i < asked.size(); ++i) rays.set(i, asked[i]);
        std::vector<std::uint8_t> occluded(asked.size());
        inputs.tracer.trace_occluded(rays, occluded);
        ray_count += asked.size();
        for (std::size_t i = 0; i < questions.size();) {
            ProbeWeights& read = weights[questions[i].pixel];
            bool hidden = false;
            for (const std::size_t pixel = questions[i].pixel;
                 i < questions.size() && questions[i].pixel == pixel; ++i) {
                if (!occluded[i]) continue;
                read.weight[questions[i].entry] = -read.weight[questions[i].entry];
                hidden = true;
            }
            if (hidden) keep_visible(read);
        }
    });
    return {ray_count, 0};
}

}  // namespace gather
