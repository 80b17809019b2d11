#include "gather/lighting/visible_surfaces.h"

#include <algorithm>
#include <atomic>

#include "core/scene/camera.h"
#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr int kRowsAtOnce = 2;

}  // namespace

PixelFootprint::PixelFootprint(const core::CameraRays& camera, int width, int height) {
    const glm::vec2 center = 0.5f * glm::vec2(width, height);
    const core::Ray here = camera.ray(center);
    const core::Ray beside = camera.ray(center + glm::vec2(1.0f, 0.0f));
    origin_ = beside.origin - here.origin;
    direction_ = beside.direction - here.direction;
}

void VisibleSurfaces::resize(int new_width, int new_height) {
    width = new_width;
    height = new_height;
    const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    points.resize(count);
    origins.resize(count);
    outgoing.resize(count);
    depth.resize(count);
    distance.resize(count);
    emitted.resize(count);
    steps.resize(count);
}

std::uint32_t pixel_key(std::uint64_t seed, int x, int y, std::uint32_t use) {
    return core::hash_words(static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                            static_cast<std::uint32_t>(y) * 0x10001u + static_cast<std::uint32_t>(x), use);
}

core::Ray film_ray(const core::RenderInputs& inputs, const core::CameraRays& camera, int x, int y,
                   std::uint32_t film_index) {
    enum Dimension : std::uint32_t { kFilm, kAlpha };
    const core::SampleSequence sequence(pixel_key(inputs.seed, x, y, kCameraUse), film_index);
    core::Ray ray = camera.ray(glm::vec2(x, y) + sequence.point(kFilm));
    ray.seed = sequence.bits(kAlpha);
    return ray;
}

PassRays find_visible_surfaces(const core::RenderInputs& inputs, const SceneLighting& lighting,
                               const std::vector<std::uint32_t>& film_indices, VisibleSurfaces& result) {
    result.resize(inputs.width, inputs.height);
    const core::CameraRays camera(inputs.camera, inputs.width, inputs.height);
    result.footprint = PixelFootprint(camera, inputs.width, inputs.height);
    const bool change_of_tracer = &inputs.primary != &inputs.tracer;
    std::atomic<std::uint64_t> exhausted{0};
    core::parallel_for(
        static_cast<std::size_t>(inputs.height), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
            const core::ScopedFlushDenormals flush;
            core::RayStream rays;
            core::HitStream hits;
            rays.resize((end - begin) * static_cast<std::size_t>(inputs.width));
            const std::size_t first = begin * static_cast<std::size_t>(inputs.width);
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const int x = static_cast<int>((first + i) % static_cast<std::size_t>(inputs.width));
                const int y = static_cast<int>((first + i) / static_cast<std::size_t>(inputs.width));
                rays.set(i, film_ray(inputs, camera, x, y, film_indices[first + i]));
            }
            inputs.primary.trace_closest(rays, hits);
            std::uint64_t lost = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const std::size_t pixel = first + i;
                const core::Ray ray = rays.get(i);
                result.depth[pixel] = 0.0f;
                result.distance[pixel] = 0.0f;
                result.steps[pixel] = hits.steps[i];
                if (hits.status[i] != core::HitStatus::kHit) {
                    const bool is_lost = hits.status[i] == core::HitStatus::kExhausted;
                    lost += is_lost ? 1 : 0;
                    result.emitted[pixel] = is_lost ? glm::vec3(0.0f) : lighting.seen_sky(ray.direction);
                    continue;
                }
                core::SurfacePoint& point = result.points[pixel];
                point = core::surface_at(inputs.scene, ray, hits.get(i));
                result.emitted[pixel] = point.emission;
                result.outgoing[pixel] = -ray.direction;
                result.origins[pixel] =
                    point.origin_above(change_of_tracer ? lighting.start_offset(point.instance) : 0.0f);
                result.depth[pixel] =
                    std::max(camera.depth(point.position), std::numeric_limits<float>::min());
                result.distance[pixel] = hits.t[i];
            }
            exhausted += lost;
        });
    return {static_cast<std::uint64_t>(inputs.width) * static_cast<std::uint64_t>(inputs.height), exhausted};
}

PassRays add_direct_light(const core::RenderInputs& inputs, const SceneLighting& lighting,
                          const VisibleSurfaces& visible, int samples, std::uint32_t frame,
                          std::vector<glm::vec3>& direct) {
    enum Dimension : std::uint32_t { kLight, kAlpha, kLobe, kLobeDirection, kLobeAlpha };
    std::atomic<std::uint64_t> ray_count{0}, exhausted{0};
    core::parallel_for(
        static_cast<std::size_t>(visible.height), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
            const core::ScopedFlushDenormals flush;
            const auto width = static_cast<std::size_t>(visible.width);
            core::RayStream rays;
            std::vector<std::size_t> pixels;
            std::vector<glm::vec3> arriving;
            std::vector<LobeRay> lobes;
            std::vector<std::size_t> lobe_pixels;
            rays.resize((end - begin) * width * static_cast<std::size_t>(samples));
            for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
                if (!visible.surface(pixel)) continue;
                const std::uint32_t key = pixel_key(inputs.seed, static_cast<int>(pixel % width),
                                                    static_cast<int>(pixel / width), kDirectUse);
                const core::SurfacePoint& point = visible.points[pixel];
                const core::LightSampler::Selection selection =
                    lighting.sampled().selection({visible.origins[pixel], point.geometric_normal});
                const bool mirrors = mirrors_lights(point);
                for (int sample = 0; sample < samples; ++sample) {
                    const core::SampleSequence sequence(key, frame * static_cast<std::uint32_t>(samples) +
                                                                 static_cast<std::uint32_t>(sample));
                    if (mirrors) {
                        const auto lobe =
                            sample_lobe(selection, point, visible.origins[pixel], visible.outgoing[pixel],
                                        sequence.point(kLobe).x, sequence.point(kLobeDirection),
                                        sequence.bits(kLobeAlpha));
                        if (lobe) {
                            lobes.push_back(*lobe);
                            lobe_pixels.push_back(pixel);
                        }
                    }
                    const auto arrival =
                        sample_light(lighting, lighting.sampled(), selection, point, visible.origins[pixel],
                                     visible.outgoing[pixel], sequence.point(kLight), sequence.bits(kAlpha));
                    if (!arrival) continue;
                    rays.set(pixels.size(), arrival->shadow_ray);
                    pixels.push_back(pixel);
                    arriving.push_back((arrival->diffuse + arrival->specular) / static_cast<float>(samples));
                }
            }
            rays.resize(pixels.size());
            std::vector<std::uint8_t> occluded(pixels.size());
            if (!pixels.empty()) inputs.tracer.trace_occluded(rays, occluded);
            for (std::size_t i = 0; i < pixels.size(); ++i) {
                if (!occluded[i]) direct[pixels[i]] += arriving[i];
            }
            const float share = 1.0f / static_cast<float>(samples);
            exhausted += trace_lobes(
                inputs.scene, inputs.tracer, lighting.sampled(), lobes,
                [&](std::size_t i, const glm::vec3& light) { direct[lobe_pixels[i]] += share * light; });
            ray_count += pixels.size() + lobes.size();
        });
    return {ray_count, exhausted};
}

}  // namespace gather
