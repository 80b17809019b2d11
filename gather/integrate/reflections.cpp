#include "gather/integrate/reflections.h"

#include <atomic>
#include <limits>

#include "core/math/random.h"
#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr std::size_t kRowsAtOnce = 2;

enum Dimension : std::uint32_t { kDirection, kAlpha };

struct Reflected {
    core::RayStream rays;
    std::vector<std::size_t> places;  ///< In the frame's rays.
    std::vector<std::uint32_t> keys;
};

void sample(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
            const IntegrateSettings& settings, std::uint32_t frame, std::size_t first, std::size_t last,
            Reflected& out, std::vector<ReflectionRay>& found) {
    const auto width = static_cast<std::size_t>(visible.width);
    const auto rays = static_cast<std::uint32_t>(settings.reflection_rays);
    out.rays.resize((last - first) * rays);
    for (std::size_t pixel = first; pixel < last; ++pixel) {
        if (!visible.surface(pixel) || !takes_reflection_rays(visible.points[pixel], settings)) continue;
        const core::SurfacePoint& point = visible.points[pixel];
        const glm::vec3 outgoing = point.frame.to_local(visible.outgoing[pixel]);
        const std::uint32_t key = pixel_key(inputs.seed, static_cast<int>(pixel % width),
                                            static_cast<int>(pixel / width), kReflectionUse);
        for (std::uint32_t k = 0; k < rays; ++k) {
            const core::SampleSequence sequence(key, frame * rays + k);
            const core::BrdfSample chosen =
                core::sample_specular(point.brdf, outgoing, sequence.point(kDirection));
            if (!(chosen.pdf > 0.0f)) continue;
            core::Ray ray;
            ray.origin = visible.origins[pixel];
            ray.direction = glm::normalize(point.frame.to_world(chosen.incoming));
            if (!(glm::dot(ray.direction, point.geometric_normal) > 0.0f)) continue;
            ray.seed = sequence.bits(kAlpha);
            out.rays.set(out.places.size(), ray);
            out.places.push_back(pixel * rays + k);
            out.keys.push_back(core::hash_words(key, k));
            found[out.places.back()].direction = ray.direction;
            found[out.places.back()].pdf = chosen.pdf;
        }
    }
    out.rays.resize(out.places.size());
}

}  // namespace

bool takes_reflection_rays(const core::SurfacePoint& surface, const IntegrateSettings& settings) {
    return surface.roughness <= settings.reflection_roughness_max && core::has_specular(surface.brdf);
}

ReflectionCost trace_reflections(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                                 const HitLighting& hit_lighting, const IntegrateSettings& settings,
                                 std::uint32_t frame, ReflectionRays& found) {
    found.rays_a_pixel = static_cast<std::size_t>(settings.reflection_rays);
    found.rays.assign(visible.depth.size() * found.rays_a_pixel, {});
    std::atomic<std::uint64_t> rays{0}, shadow_rays{0}, exhausted{0};
    core::parallel_for(
        static_cast<std::size_t>(visible.height), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
            const core::ScopedFlushDenormals flush;
            const auto width = static_cast<std::size_t>(visible.width);
            Reflected reflected;
            sample(inputs, visible, settings, frame, begin * width, end * width, reflected, found.rays);
            if (reflected.places.empty()) return;
            core::HitStream hits;
            inputs.tracer.trace_closest(reflected.rays, hits);
            std::vector<glm::vec3> radiance(reflected.places.size());
            const HitLightingCounters counters =
                hit_lighting.shade(reflected.rays, hits, reflected.keys, frame, radiance);
            for (std::size_t i = 0; i < reflected.places.size(); ++i) {
                ReflectionRay& ray = found.rays[reflected.places[i]];
                const core::Hit hit = hits.get(i);
                ray.radiance = radiance[i];
                ray.distance = hit.hit() ? hit.t : std::numeric_limits<float>::infinity();
                ray.normal = hit.normal;
            }
            rays += reflected.places.size();
            shadow_rays += counters.shadow_rays;
            exhausted += counters.exhausted;
        });
    return {rays, shadow_rays, exhausted};
}

}  // namespace gather
