#include "gather/integrate/bent_normal.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/math/octahedral.h"
#include "core/math/random.h"
#include "core/math/sampling.h"
#include "core/scene/camera.h"
#include "core/support/parallel.h"

namespace gather {

namespace {

enum Dimension : std::uint32_t { kDirection, kAlpha };

/// How many frames must have found a pixel open for it to count as open, and how open.
constexpr std::uint32_t kFramesToTrust = 2;
constexpr float kOpen = 0.999f;

/// Luminances beyond it agree as it does: its square is finite.
constexpr float kMostCompared = 1e15f;

/// Short rays of some rows of pixels, side by side.
struct ShortRays {
    core::RayStream rays;
    std::vector<std::size_t> pixels;
    std::vector<std::uint32_t> keys;
    std::vector<std::uint8_t>
        alone;  ///< Of a pixel without probes: the ray goes on as far as there is anything.
    core::HitStream hits;
    std::vector<std::uint8_t> occluded;
};

/// Those whose hits are shaded.
struct NearHits {
    core::RayStream rays;
    core::HitStream hits;
    std::vector<std::uint32_t> keys;
    std::vector<glm::vec3> radiance;
};

class BentNormalPass {
public:
    BentNormalPass(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                   const IntegrateSettings& settings, std::uint32_t frame)
        : inputs_(inputs),
          visible_(visible),
          settings_(settings),
          frame_(frame),
          rays_a_pixel_(static_cast<std::uint32_t>(settings.bent_normal_rays)) {}

    std::uint32_t rays_of(std::size_t pixel, const NearLighting* near) const;
    void trace(std::size_t first, std::size_t last, const NearLighting* near, ShortRays& out) const;
    void bend(const ShortRays& in, const NearLighting* near, std::vector<BentNormal>& result) const;
    void shade(const NearLighting& near, const ShortRays& in, std::vector<NearLight>& result,
               HitLightingCounters& counters) const;

private:
    void compare(const NearLighting& near, const ShortRays& in, std::size_t first, std::size_t last,
                 std::span<const glm::vec3> own, NearLight& light) const;

    const core::RenderInputs& inputs_;
    const VisibleSurfaces& visible_;
    const IntegrateSettings& settings_;
    std::uint32_t frame_;
    std::uint32_t rays_a_pixel_;
};

/// A pixel whose rays of some frames found all open takes one from then on, until it finds something.
std::uint32_t BentNormalPass::rays_of(std::size_t pixel, const NearLighting* near) const {
    const bool open = near && frame_ >= kFramesToTrust && near->history.openness[pixel] >= kOpen &&
                      near->weights[pixel].confident;
    return open ? 1 : rays_a_pixel_;
}

/// Of the pixels from `first` up to `last`.
void BentNormalPass::trace(std::size_t first, std::size_t last, const NearLighting* near,
                           ShortRays& out) const {
    const auto width = static_cast<std::size_t>(visible_.width);
    out.rays.resize((last - first) * rays_a_pixel_);
    out.pixels.clear();
    out.keys.clear();
    out.alone.clear();
    std::vector<float> lengths;
    for (std::size_t pixel = first; pixel < last; ++pixel) {
        if (!visible_.surface(pixel)) continue;
        const core::SurfacePoint& point = visible_.points[pixel];
        const bool alone = near && !near->weights[pixel].confident;
        const float length = settings_.bent_normal_pixels * visible_.footprint.at(visible_.depth[pixel]);
        const std::uint32_t key = pixel_key(inputs_.seed, static_cast<int>(pixel % width),
                                            static_cast<int>(pixel / width), kBentNormalUse);
        const std::uint32_t ray_count = rays_of(pixel, near);
        for (std::uint32_t k = 0; k < ray_count; ++k) {
            const core::SampleSequence sequence(key, frame_ * rays_a_pixel_ + k);
            core::Ray ray;
            ray.origin = visible_.origins[pixel];
            ray.direction = glm::normalize(
                point.frame.to_world(core::sample_cosine_hemisphere(sequence.point(kDirection))));
            // Under the surface itself: no ray, open; what the shading normal leans over is not near.
            if (!(glm::dot(ray.direction, point.geometric_normal) > 0.0f)) continue;
            if (!alone) ray.t_max = length;
            ray.seed = sequence.bits(kAlpha);
            out.rays.set(out.pixels.size(), ray);
            out.pixels.push_back(pixel);
            out.keys.push_back(core::hash_words(key, k));
            out.alone.push_back(alone ? 1 : 0);
            lengths.push_back(length);
        }
    }
    out.rays.resize(out.pixels.size());
    out.occluded.assign(out.pixels.size(), 0);
    if (out.pixels.empty()) return;
    if (!near) {
        inputs_.tracer.trace_occluded(out.rays, out.occluded);
        return;
    }
    inputs_.tracer.trace_closest(out.rays, out.hits);
    for (std::size_t i = 0; i < out.pixels.size(); ++i) {
        // One that was exhausted met something that it could not tell: black, and counted, as elsewhere.
        const bool met = out.hits.status[i] == core::HitStatus::kHit && out.hits.t[i] <= lengths[i];
        out.occluded[i] = met || out.hits.status[i] == core::HitStatus::kExhausted ? 1 : 0;
    }
}

void BentNormalPass::bend(const ShortRays& in, const NearLighting* near,
                          std::vector<BentNormal>& result) const {
    for (std::size_t i = 0; i < in.pixels.size();) {
        const std::size_t pixel = in.pixels[i];
        glm::vec3 blocked(0.0f);
        int blocked_count = 0;
        for (; i < in.pixels.size() && in.pixels[i] == pixel; ++i) {
            if (!in.occluded[i]) continue;
            ++blocked_count;
            blocked += in.rays.get(i).direction;
        }
        if (blocked_count == 0) continue;
        const float share = 1.0f / static_cast<float>(rays_of(pixel, near));
        // The mean of the cosine-weighted hemisphere is 2/3 n; taking the blocked part off it leaves the
        // open part's, exactly n where nothing is blocked.
        const glm::vec3& normal = visible_.points[pixel].frame.normal;
        const glm::vec3 open = (2.0f / 3.0f) * normal - share * blocked;
        const float length2 = glm::dot(open, open);
        result[pixel].visibility = std::max(0.0f, 1.0f - share * static_cast<float>(blocked_count));
        result[pixel].direction = length2 > 1e-12f ? open / std::sqrt(length2) : normal;
    }
}

void BentNormalPass::shade(const NearLighting& near, const ShortRays& in, std::vector<NearLight>& result,
                           HitLightingCounters& counters) const {
    NearHits found;
    std::size_t count = 0;
    for (std::size_t i = 0; i < in.pixels.size(); ++i) count += in.occluded[i] || in.alone[i] ? 1 : 0;
    found.rays.resize(count);
    found.hits.resize(count);
    found.radiance.resize(count);
    for (std::size_t i = 0; i < in.pixels.size(); ++i) {
        if (!in.occluded[i] && !in.alone[i]) continue;
        found.rays.set(found.keys.size(), in.rays.get(i));
        found.hits.set(found.keys.size(), in.hits.get(i));
        found.keys.push_back(in.keys[i]);
    }
    if (count > 0) {
        counters = near.hit_lighting.shade(found.rays, found.hits, found.keys, frame_, found.radiance);
    }
    std::span<const glm::vec3> own = found.radiance;
    for (std::size_t i = 0, last; i < in.pixels.size(); i = last) {
        std::size_t own_count = 0;
        for (last = i; last < in.pixels.size() && in.pixels[last] == in.pixels[i]; ++last) {
            own_count += in.occluded[last] || in.alone[last] ? 1 : 0;
        }
        compare(near, in, i, last, own.first(own_count), result[in.pixels[i]]);
        own = own.subspan(own_count);
    }
}

/// Of one pixel, whose rays are `first` up to `last`. @param own light of those that found their own
void BentNormalPass::compare(const NearLighting& near, const ShortRays& in, std::size_t first,
                             std::size_t last, std::span<const glm::vec3> own, NearLight& light) const {
    const std::size_t pixel = in.pixels[first];
    // In the open the rays hold what the probes do.
    const bool ever_compared = !near.history.compared.empty() && near.history.compared[pixel];
    if (own.empty() && !ever_compared) return;
    if (!in.alone[first]) light.kind = NearLight::Kind::kCompared;
    const core::SurfacePoint& point = visible_.points[pixel];
    const glm::vec3 outgoing = point.frame.to_local(visible_.outgoing[pixel]);
    const bool reflects = reflects_near_light(point);
    const ProbeWeights& weights = near.weights[pixel];
    const float share = core::kPi / static_cast<float>(rays_of(pixel, &near));
    for (std::size_t i = first; i < last; ++i) {
        const glm::vec3 direction = in.rays.get(i).direction;
        glm::vec3 held(0.0f);
        if (!in.alone[i]) {
            const glm::vec2 at = core::octahedral_from_direction(direction);
            for (std::size_t k = 0; k < weights.count; ++k) {
                held += weights.weight[k] * near.atlas.read(weights.probe[k], at);
            }
        }
        glm::vec3 found = held;
        if (in.occluded[i] || in.alone[i]) {
            found = own.front();
            own = own.subspan(1);
        }
        const float held_luminance = std::min(core::luminance(held), kMostCompared);
        light.agreement.found += std::min(core::luminance(found), kMostCompared) * held_luminance;
        light.agreement.held += held_luminance * held_luminance;
        light.found.irradiance += share * found;
        light.held.irradiance += share * held;
        if (reflects && (found != glm::vec3(0.0f) || held != glm::vec3(0.0f))) {
            const glm::vec3 lobe =
                core::evaluate(point.brdf, outgoing, point.frame.to_local(direction)).value.specular;
            light.found.specular += share * found * lobe;
            light.held.specular += share * held * lobe;
        }
    }
}

}  // namespace

bool reflects_near_light(const core::SurfacePoint& surface) {
    constexpr float kLeastAlpha = 0.36f;  // Roughness 0.6.
    return surface.brdf.alpha >= kLeastAlpha && core::has_specular(surface.brdf);
}

BentNormalRays trace_bent_normals(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                                  const IntegrateSettings& settings, std::uint32_t frame,
                                  const NearLighting* near, std::vector<BentNormal>& result,
                                  std::vector<NearLight>& near_light) {
    result.resize(visible.depth.size());
    near_light.resize(near ? visible.depth.size() : 0);
    const BentNormalPass pass(inputs, visible, settings, frame);
    std::atomic<std::uint64_t> short_rays{0}, shadow_rays{0}, exhausted{0};
    core::parallel_for(static_cast<std::size_t>(visible.height), 2, [&](std::size_t begin, std::size_t end) {
        const core::ScopedFlushDenormals flush;
        const auto width = static_cast<std::size_t>(visible.width);
        for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
            const bool surface = visible.surface(pixel);
            result[pixel] = {surface ? visible.points[pixel].frame.normal : BentNormal{}.direction, 1.0f};
            if (!near) continue;
            near_light[pixel] = {};
            if (surface && !near->weights[pixel].confident) near_light[pixel].kind = NearLight::Kind::kAlone;
        }
        ShortRays found;
        pass.trace(begin * width, end * width, near, found);
        pass.bend(found, near, result);
        HitLightingCounters counters;
        if (near) pass.shade(*near, found, near_light, counters);
        short_rays += found.pixels.size();
        shadow_rays += counters.shadow_rays;
        exhausted += counters.exhausted;
    });
    return {short_rays, shadow_rays, exhausted};
}

float multi_bounce(float visibility, float albedo) {
    const float a = 2.0404f * albedo - 0.3324f;
    const float b = -4.7951f * albedo + 0.6417f;
    const float c = 2.7552f * albedo + 0.6903f;
    return std::max(visibility, ((visibility * a + b) * visibility + c) * visibility);
}

glm::vec3 cone_irradiance(const core::ShColor& radiance, const BentNormal& bent) {
    // Zonal coefficients of the clamped cosine within the cone, over those of the whole hemisphere.
    const float s2 = bent.visibility;
    const float c = std::sqrt(std::max(0.0f, 1.0f - s2));
    const float band1 = 1.0f - c * c * c;
    const float band2 = (4.0f - 3.0f * s2) * s2;
    core::Sh lobe = core::sh_clamped_cosine(bent.direction);
    lobe[0] *= s2;
    for (std::size_t k = 1; k < 4; ++k) lobe[k] *= band1;
    for (std::size_t k = 4; k < core::kShCount; ++k) lobe[k] *= band2;
    return glm::max(glm::vec3(0.0f), core::sh_dot(radiance, lobe));
}

}  // namespace gather
