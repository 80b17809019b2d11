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
    height_ = static_cast<float>(height);
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

bool see(const core::RenderInputs& inputs, const SceneLighting& lighting, const core::CameraRays& camera,
         const core::Ray& ray, const core::Hit& hit, std::size_t index, VisibleSurfaces& result) {
    result.depth[index] = 0.0f;
    result.distance[index] = 0.0f;
    result.steps[index] = hit.steps;
    if (hit.status != core::HitStatus::kHit) {
        const bool is_lost = hit.status == core::HitStatus::kExhausted;
        result.emitted[index] = is_lost ? glm::vec3(0.0f) : lighting.seen_sky(ray.direction);
        return !is_lost;
    }
    const bool change_of_tracer = &inputs.primary != &inputs.tracer;
    core::SurfacePoint& point = result.points[index];
    point = core::surface_at(inputs.scene, ray, hit);
    result.emitted[index] = point.emission;
    result.outgoing[index] = -ray.direction;
    result.origins[index] =
        point.origin_above(change_of_tracer ? lighting.start_offset(point.instance) : 0.0f);
    result.depth[index] = std::max(camera.depth(point.position), std::numeric_limits<float>::min());
    result.distance[index] = hit.t;
    return true;
}

PassRays find_visible_surfaces(const core::RenderInputs& inputs, const SceneLighting& lighting,
                               const std::vector<std::uint32_t>& film_indices, VisibleSurfaces& result) {
    result.resize(inputs.width, inputs.height);
    const core::CameraRays camera(inputs.camera, inputs.width, inputs.height);
    result.footprint = PixelFootprint(camera, inputs.width, inputs.height);
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
                lost += see(inputs, lighting, camera, rays.get(i), hits.get(i), first + i, result) ? 0 : 1;
            }
            exhausted += lost;
        });
    return {static_cast<std::uint64_t>(inputs.width) * static_cast<std::uint64_t>(inputs.height), exhausted};
}

PassRays light_surfaces(const core::RenderInputs& inputs, const SceneLighting& lighting,
                        const VisibleSurfaces& visible, std::size_t begin, std::size_t end, int samples,
                        const std::function<SampleId(std::size_t)>& id, std::span<glm::vec3> direct) {
    enum Dimension : std::uint32_t { kLight, kAlpha, kLobe, kLobeDirection, kLobeAlpha };
    core::RayStream rays;
    std::vector<std::size_t> targets;
    std::vector<glm::vec3> arriving;
    std::vector<LobeRay> lobes;
    std::vector<std::size_t> lobe_targets;
    rays.resize((end - begin) * static_cast<std::size_t>(samples));
    for (std::size_t i = begin; i < end; ++i) {
        if (!visible.surface(i)) continue;
        const SampleId numbers = id(i);
        const core::SurfacePoint& point = visible.points[i];
        const core::LightSampler::Selection selection =
            lighting.sampled().selection({visible.origins[i], point.geometric_normal});
        const bool mirrors = mirrors_lights(point);
        for (std::uint32_t sample = 0; sample < static_cast<std::uint32_t>(samples); ++sample) {
            const core::SampleSequence sequence(numbers.key, numbers.first + sample);
            if (mirrors) {
                const auto lobe = sample_lobe(selection, point, visible.origins[i], visible.outgoing[i],
                                              sequence.point(kLobe).x, sequence.point(kLobeDirection),
                                              sequence.bits(kLobeAlpha));
                if (lobe) {
                    lobes.push_back(*lobe);
                    lobe_targets.push_back(i);
                }
            }
            const auto arrival =
                sample_light(lighting, lighting.sampled(), selection, point, visible.origins[i],
                             visible.outgoing[i], sequence.point(kLight), sequence.bits(kAlpha));
            if (!arrival) continue;
            rays.set(targets.size(), arrival->shadow_ray);
            targets.push_back(i);
            arriving.push_back((arrival->diffuse + arrival->specular) / static_cast<float>(samples));
        }
    }
    rays.resize(targets.size());
    std::vector<std::uint8_t> occluded(targets.size());
    if (!targets.empty()) inputs.tracer.trace_occluded(rays, occluded);
    for (std::size_t i = 0; i < targets.size(); ++i) {
        if (!occluded[i]) direct[targets[i]] += arriving[i];
    }
    const float share = 1.0f / static_cast<float>(samples);
    const std::uint64_t exhausted =
        trace_lobes(inputs.scene, inputs.tracer, lighting.sampled(), lobes,
                    [&](std::size_t i, const glm::vec3& light) { direct[lobe_targets[i]] += share * light; });
    return {targets.size() + lobes.size(), exhausted};
}

PassRays add_direct_light(const core::RenderInputs& inputs, const SceneLighting& lighting,
                          const VisibleSurfaces& visible, int samples, std::uint32_t frame,
                          std::vector<glm::vec3>& direct) {
    const auto width = static_cast<std::size_t>(visible.width);
    const auto id = [&](std::size_t pixel) {
        return SampleId{pixel_key(inputs.seed, static_cast<int>(pixel % width),
                                  static_cast<int>(pixel / width), kDirectUse),
                        frame * static_cast<std::uint32_t>(samples)};
    };
    std::atomic<std::uint64_t> ray_count{0}, exhausted{0};
    core::parallel_for(
        static_cast<std::size_t>(visible.height), kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
            const core::ScopedFlushDenormals flush;
            const PassRays rays =
                light_surfaces(inputs, lighting, visible, begin * width, end * width, samples, id, direct);
            ray_count += rays.rays;
            exhausted += rays.exhausted;
        });
    return {ray_count, exhausted};
}

}  // namespace gather
