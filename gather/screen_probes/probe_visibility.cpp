#include "gather/screen_probes/probe_visibility.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/math/random.h"
#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr std::size_t kPixelsAtOnce = 1024;

/// Both ends are lifted by this share of their distance: a chord of a round surface whose normals part by 60
/// degrees, the most that interpolation allows, runs an eighth of it below.
constexpr float kLift = 0.15f;

/// Of a weight, for a ray: less is hardly seen, and says nothing of its own.
constexpr float kLeastWeight = 0.02f;

/// Nothing stands near a pixel that is at least this open.
constexpr float kOpen = 0.999f;

struct Question {
    std::size_t pixel;
    std::size_t entry;  ///< Of the pixel's weights.
};

/// Between points that lie at least as far above their surfaces as rays from there start.
/// @return false where both are one point
bool ray_between(const VisibleSurfaces& visible, std::size_t pixel, const Probe& probe, core::Ray& ray) {
    const auto start_offset = [&](std::size_t i) {
        return glm::length(visible.origins[i] - visible.points[i].position);
    };
    const core::SurfacePoint& point = visible.points[pixel];
    const float lift = kLift * glm::length(probe.position - point.position);
    const float probe_lift = std::max(lift, start_offset(visible.index(probe.pixel.x, probe.pixel.y)));
    const glm::vec3 origin = point.position + std::max(lift, start_offset(pixel)) * point.geometric_normal;
    const glm::vec3 offset = probe.position + probe_lift * probe.normal - origin;
    const float distance = glm::length(offset);
    if (!(distance > 0.0f)) return false;
    ray.origin = origin;
    ray.direction = offset / distance;
    ray.t_max = distance;
    return true;
}

/// @pre those that are hidden have negative weights
void keep_visible(ProbeWeights& weights) {
    float sum = 0.0f;
    bool any_seen = false;
    for (std::size_t i = 0; i < weights.count; ++i) {
        sum += std::max(weights.weight[i], 0.0f);
        any_seen = any_seen || weights.weight[i] >= kLeastWeight;
    }
    if (!any_seen) {
        for (std::size_t i = 0; i < weights.count; ++i) weights.weight[i] = std::abs(weights.weight[i]);
        weights.confident = false;
        return;
    }
    for (std::size_t i = 0; i < weights.count; ++i) {
        weights.weight[i] = std::max(weights.weight[i], 0.0f) / sum;
    }
}

}  // namespace

PassRays hide_probes(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                     const ProbeAtlas& atlas, std::span<const float> openness, std::uint32_t frame,
                     std::vector<ProbeWeights>& weights) {
    std::atomic<std::uint64_t> ray_count{0};
    const auto width = static_cast<std::size_t>(visible.width);
    core::parallel_for(weights.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        const core::ScopedFlushDenormals flush;
        std::vector<Question> questions;
        std::vector<core::Ray> asked;
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
            if (!visible.surface(pixel) || !weights[pixel].confident) continue;
            if (!openness.empty() && openness[pixel] >= kOpen) continue;
            const std::uint32_t key =
                core::hash_words(pixel_key(inputs.seed, static_cast<int>(pixel % width),
                                           static_cast<int>(pixel / width), kVisibilityUse),
                                 frame);
            for (std::size_t i = 0; i < weights[pixel].count; ++i) {
                core::Ray ray;
                if (weights[pixel].weight[i] < kLeastWeight ||
                    !ray_between(visible, pixel, atlas.probes[weights[pixel].probe[i]], ray)) {
                    continue;
                }
                ray.seed = core::hash_words(key, static_cast<std::uint32_t>(i));
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
