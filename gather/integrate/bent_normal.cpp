#include "gather/integrate/bent_normal.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/math/sampling.h"
#include "core/scene/camera.h"
#include "core/support/parallel.h"

namespace gather {

PassRays trace_bent_normals(const core::RenderInputs& inputs, const VisibleSurfaces& visible,
                            const IntegrateSettings& settings, std::uint32_t frame,
                            std::vector<BentNormal>& result) {
    enum Dimension : std::uint32_t { kDirection, kAlpha };
    result.assign(visible.depth.size(), BentNormal{});
    const core::CameraRays camera(inputs.camera, inputs.width, inputs.height);
    const glm::vec2 center = 0.5f * glm::vec2(inputs.width, inputs.height);
    const core::Ray here = camera.ray(center);
    const core::Ray beside = camera.ray(center + glm::vec2(1.0f, 0.0f));
    const auto rays_a_pixel = static_cast<std::uint32_t>(settings.bent_normal_rays);
    std::atomic<std::uint64_t> ray_count{0};
    core::parallel_for(static_cast<std::size_t>(visible.height), 2, [&](std::size_t begin, std::size_t end) {
        const core::ScopedFlushDenormals flush;
        const auto width = static_cast<std::size_t>(visible.width);
        core::RayStream rays;
        std::vector<std::size_t> pixels;
        rays.resize((end - begin) * width * rays_a_pixel);
        for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
            if (!visible.surface(pixel)) continue;
            const core::SurfacePoint& point = visible.points[pixel];
            const float far = visible.depth[pixel];
            const float length =
                settings.bent_normal_pixels *
                glm::length((beside.origin - here.origin) + far * (beside.direction - here.direction));
            const std::uint32_t key = pixel_key(inputs.seed, static_cast<int>(pixel % width),
                                                static_cast<int>(pixel / width), kBentNormalUse);
            for (std::uint32_t k = 0; k < rays_a_pixel; ++k) {
                const core::SampleSequence sequence(key, frame * rays_a_pixel + k);
                core::Ray ray;
                ray.origin = visible.origins[pixel];
                ray.direction = glm::normalize(
                    point.frame.to_world(core::sample_cosine_hemisphere(sequence.point(kDirection))));
                // Under the surface itself: no ray, open; what the shading normal leans over is not near.
                if (!(glm::dot(ray.direction, point.geometric_normal) > 0.0f)) continue;
                ray.t_max = length;
                ray.seed = sequence.bits(kAlpha);
                rays.set(pixels.size(), ray);
                pixels.push_back(pixel);
            }
        }
        rays.resize(pixels.size());
        std::vector<std::uint8_t> occluded(pixels.size());
        if (!pixels.empty()) inputs.tracer.trace_occluded(rays, occluded);
        const float share = 1.0f / static_cast<float>(rays_a_pixel);
        for (std::size_t i = 0; i < pixels.size();) {
            const std::size_t pixel = pixels[i];
            const glm::vec3& normal = visible.points[pixel].frame.normal;
            glm::vec3 blocked(0.0f);
            int blocked_count = 0;
            for (; i < pixels.size() && pixels[i] == pixel; ++i) {
                if (!occluded[i]) continue;
                ++blocked_count;
                blocked += glm::vec3(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
            }
            if (blocked_count == 0) {
                result[pixel] = {normal, 1.0f};
                continue;
            }
            // The mean of the cosine-weighted hemisphere is 2/3 n; taking the blocked part off it leaves the
            // open part's, exactly n where nothing is blocked.
            const glm::vec3 open = (2.0f / 3.0f) * normal - share * blocked;
            const float length2 = glm::dot(open, open);
            result[pixel].visibility = std::max(0.0f, 1.0f - share * static_cast<float>(blocked_count));
            result[pixel].direction = length2 > 1e-12f ? open / std::sqrt(length2) : normal;
        }
        for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
            if (visible.surface(pixel) && result[pixel].visibility == 1.0f) {
                result[pixel].direction = visible.points[pixel].frame.normal;
            }
        }
        ray_count += pixels.size();
    });
    return {ray_count, 0};
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
