#include "gather/integrate/reflection_reuse.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/image/image.h"
#include "core/math/random.h"
#include "core/support/parallel.h"
#include "gather/integrate/reflections.h"
#include "gather/screen_probes/interpolation.h"

namespace gather {

namespace {

constexpr std::size_t kPixelsAtOnce = 1024;

/// A borrowed ray counts for no more own ones than this.
constexpr float kMostCredit = 2.0f;

/// Neighbours lend where their surface weight is at least this.
constexpr float kSameSurface = 0.5f;

/// Smoother surfaces keep to themselves: their neighbours' rays would hardly count.
constexpr float kLeastAlpha = 0.01f;

/// Pixels; neighbours lie within.
constexpr float kRadius = 8.0f;

/// What lies this many such radii away, or farther, is in the sight of all neighbours if it is in one's.
constexpr float kFarther = 2.0f;

/// One pixel's, while it adds up.
struct Borrower {
    const core::SurfacePoint& point;
    glm::vec3 outgoing;  ///< In its frame.
    float far_distance;
    glm::vec3 light{0.0f};  ///< Of rays that met something far,
    float credit = 0.0f;    ///< and what they count.

    bool is_far(const ReflectionRay& ray) const { return ray.pdf > 0.0f && ray.distance >= far_distance; }

    /// @param from where the ray begins
    void add(const glm::vec3& from, const ReflectionRay& ray) {
        glm::vec3 direction = ray.direction;
        float pdf = ray.pdf;
        if (std::isfinite(ray.distance)) {
            const glm::vec3 way = from - point.position + ray.distance * ray.direction;
            const float distance2 = glm::dot(way, way);
            direction = way / std::sqrt(distance2);
            const float cosine = std::abs(glm::dot(ray.normal, direction));
            if (!(cosine > 0.0f)) return;
            // The same points met, seen from here.
            pdf *= std::abs(glm::dot(ray.normal, ray.direction)) * distance2 /
                   (cosine * ray.distance * ray.distance);
        }
        if (!(glm::dot(direction, point.geometric_normal) > 0.0f)) return;
        const glm::vec3 incoming = point.frame.to_local(direction);
        const core::BrdfEvaluation lobe = core::evaluate_specular(point.brdf, outgoing, incoming);
        if (!(lobe.pdf > 0.0f) || !(pdf > 0.0f)) return;
        const float share = std::min(kMostCredit, lobe.pdf / pdf);
        credit += share;
        light += lobe.value.specular * (share * incoming.z / lobe.pdf) * ray.radiance;
    }
};

/// What one of the pixel's own rays reflects.
glm::vec3 reflected(const Borrower& pixel, const ReflectionRay& ray) {
    const glm::vec3 incoming = pixel.point.frame.to_local(ray.direction);
    const glm::vec3 value =
        core::evaluate_specular(pixel.point.brdf, pixel.outgoing, incoming).value.specular;
    return value * (incoming.z / ray.pdf) * ray.radiance;
}

}  // namespace

void reuse_reflections(const VisibleSurfaces& visible, const ReflectionRays& rays,
                       const IntegrateSettings& settings, float plane_sharpness, std::uint64_t seed,
                       std::uint32_t frame, std::vector<glm::vec3>& specular) {
    const std::size_t count = rays.rays_a_pixel;
    const auto width = static_cast<std::size_t>(visible.width);
    core::parallel_for(visible.depth.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
            if (!visible.surface(pixel) || !takes_reflection_rays(visible.points[pixel], settings)) continue;
            const core::SurfacePoint& point = visible.points[pixel];
            const float reach = kRadius * visible.footprint.at(visible.depth[pixel]);
            Borrower borrower{point, point.frame.to_local(visible.outgoing[pixel]), kFarther * reach};
            const std::span<const ReflectionRay> own(rays.rays.data() + pixel * count, count);
            glm::vec3 sum(0.0f);
            int far_count = 0;
            for (const ReflectionRay& ray : own) {
                if (!(ray.pdf > 0.0f)) continue;
                const glm::vec3 light = reflected(borrower, ray);
                if (borrower.is_far(ray)) {
                    ++far_count;
                    borrower.light += light;
                    borrower.credit += 1.0f;
                } else {
                    sum += light;
                }
            }
            const int neighbors =
                point.brdf.alpha < kLeastAlpha || far_count == 0 ? 0 : settings.reflection_neighbors;
            const glm::ivec2 at(pixel % width, pixel / width);
            // A sunflower's seeds, turned at random.
            const float turn =
                2.0f * core::kPi *
                core::SampleSequence(pixel_key(seed, at.x, at.y, kReflectionReuseUse), frame).point(0).x;
            for (int i = 0; i < neighbors; ++i) {
                constexpr float kGoldenAngle = 2.3999632f;
                const float radius =
                    kRadius * std::sqrt((static_cast<float>(i) + 0.5f) / static_cast<float>(neighbors));
                const float angle = turn + kGoldenAngle * static_cast<float>(i);
                const glm::ivec2 there =
                    at + glm::ivec2(glm::round(radius * glm::vec2(std::cos(angle), std::sin(angle))));
                if (there == at || there.x < 0 || there.y < 0 || there.x >= visible.width ||
                    there.y >= visible.height) {
                    continue;
                }
                const std::size_t other = visible.index(there.x, there.y);
                if (!visible.surface(other) || !takes_reflection_rays(visible.points[other], settings))
                    continue;
                const core::SurfacePoint& lender = visible.points[other];
                if (surface_weight(point.position, point.geometric_normal, visible.depth[pixel],
                                   lender.position, lender.geometric_normal,
                                   plane_sharpness) < kSameSurface) {
                    continue;
                }
                const glm::vec3 apart = lender.position - point.position;
                if (glm::dot(apart, apart) > reach * reach) continue;
                for (const ReflectionRay& ray : std::span(rays.rays.data() + other * count, count)) {
                    if (borrower.is_far(ray)) borrower.add(visible.origins[other], ray);
                }
            }
            if (far_count > 0) sum += static_cast<float>(far_count) / borrower.credit * borrower.light;
            specular[pixel] += sum / static_cast<float>(count);
        }
    });
}

}  // namespace gather
