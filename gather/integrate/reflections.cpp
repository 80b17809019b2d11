#include "gather/integrate/reflections.h"

#include <atomic>

#include "core/math/random.h"
#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr std::size_t kRowsAtOnce = 2;

enum Dimension : std::uint32_t { kDirection, kAlpha };

struct Reflected {
    core::RayStream rays;
    std::vector<std::size_t> pixels;
    std::vector<std::uint32_t> keys;
    std::vector<glm::vec3> weights;  ///< Of the light that comes back.
};

void sample(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
            const IntegrateSettings& settings, std::uint32_t frame, std::size_t first, std::size_t last,
            Reflected& out) {
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
            out.rays.set(out.pixels.size(), ray);
            out.pixels.push_back(pixel);
            out.keys.push_back(core::hash_words(key, k));
            out.weights.push_back(chosen.value.specular *
                                  (chosen.incoming.z / (chosen.pdf * static_cast<float>(rays))));
        }
    }
    out.rays.resize(out.pixels.size());
}

}  // namespace

bool takes_reflection_rays(const core::SurfacePoint& surface, const IntegrateSettings& settings) {
    return surface.roughness <= settings.reflection_roughness_max && core::has_specular(surface.brdf);
}

ReflectionRays trace_reflections(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                                 const HitLighting& hit_lighting, const IntegrateSettings& settings,
                                 std::uint32_t frame, std::vector<glm::vec3>& specular) {
    std::atomic<std::uint64_t> rays{0}, shadow_rays{0}, exhausted{0};
    core::parallel_for(static_cast<std::size_t>(visible.height), kRowsAtOnce,
                       [&](std::size_t begin, std::size_t end) {
                           const core::ScopedFlushDenormals flush;
                           const auto width = static_cast<std::size_t>(visible.width);
                           Reflected found;
                           sample(inputs, visible, settings, frame, begin * width, end * width, found);
                           if (found.pixels.empty()) return;
                           core::HitStream hits;
                           inputs.tracer.trace_closest(found.rays, hits);
                           std::vector<glm::vec3> radiance(found.pixels.size());
                           const HitLightingCounters counters =
                               hit_lighting.shade(found.rays, hits, found.keys, frame, radiance);
                           for (std::size_t i = 0; i < found.pixels.size(); ++i) {
                               specular[found.pixels[i]] += found.weights[i] * radiance[i];
                           }
                           rays += found.pixels.size();
                           shadow_rays += counters.shadow_rays;
                           exhausted += counters.exhausted;
                       });
    return {rays, shadow_rays, exhausted};
}

}  // namespace gather
