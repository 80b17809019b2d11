#include "gather/integrate/reflection_reuse.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/image/image.h"
#include "core/math/random.h"
#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr std::size_t kPixelsAtOnce = 1024;

/// A borrowed ray counts for no more own ones than this.
constexpr float kMostCredit = 2.0f;

/// Neighbours lend that are no farther off the plane, of their greatest distance. Their lobes may be others.
constexpr float kOffPlane = 0.1f;

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

    /// @param apart from the point to where the ray begins
    void add(const glm::vec3& apart, const ReflectionRay& ray) {
        glm::vec3 direction = ray.direction;
        float pdf = ray.pdf;
        if (std::isfinite(ray.distance)) {
            const glm::vec3 way = apart + ray.distance * ray.direction;
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
    // Value and pdf from one half vector: of a mirror both are huge, and their ratio is not.
    const core::BrdfEvaluation lobe = core::evaluate_specular(pixel.point.brdf, pixel.outgoing, incoming);
    if (!(lobe.pdf > 0.0f)) return glm::vec3(0.0f);
    return lobe.value.specular * (incoming.z / lobe.pdf) * ray.radiance;
}

/// Where neighbours stand before a pixel turns them: like a sunflower's seeds.
std::vector<glm::vec2> neighbor_offsets(int count) {
    constexpr float kGoldenAngle = 2.3999632f;
    std::vector<glm::vec2> offsets;
    for (int i = 0; i < count; ++i) {
        const float radius = kRadius * std::sqrt((static_cast<float>(i) + 0.5f) / static_cast<float>(count));
        const float angle = kGoldenAngle * static_cast<float>(i);
        offsets.push_back(radius * glm::vec2(std::cos(angle), std::sin(angle)));
    }
    return offsets;
}

class Reuse {
public:
    Reuse(const VisibleSurfaces& visible, const ReflectionRays& rays, const IntegrateSettings& settings,
          std::uint64_t seed, std::uint32_t frame)
        : visible_(visible),
          rays_(rays),
          settings_(settings),
          seed_(seed),
          frame_(frame),
          offsets_(neighbor_offsets(settings.reflection_neighbors)) {}

    bool takes_part(std::size_t pixel) const {
        return visible_.surface(pixel) && takes_reflection_rays(visible_.points[pixel], settings_);
    }

    /// @pre takes_part(pixel)
    glm::vec3 light_of(std::size_t pixel) const {
        const core::SurfacePoint& point = visible_.points[pixel];
        const float reach = kRadius * visible_.footprint.at(visible_.depth[pixel]);
        Borrower borrower{point, point.frame.to_local(visible_.outgoing[pixel]), kFarther * reach};
        glm::vec3 near(0.0f);
        int far_count = 0;
        for (const ReflectionRay& ray : rays_of(pixel)) {
            if (!(ray.pdf > 0.0f)) continue;
            const glm::vec3 light = reflected(borrower, ray);
            if (borrower.is_far(ray)) {
                ++far_count;
                borrower.light += light;
                borrower.credit += 1.0f;
            } else {
                near += light;
            }
        }
        const auto count = static_cast<float>(rays_.rays_a_pixel);
        if (far_count == 0) return near / count;
        if (!(point.brdf.alpha < kLeastAlpha)) borrow(pixel, reach, borrower);
        return (near + static_cast<float>(far_count) / borrower.credit * borrower.light) / count;
    }

private:
    std::span<const ReflectionRay> rays_of(std::size_t pixel) const {
        return {rays_.rays.data() + pixel * rays_.rays_a_pixel, rays_.rays_a_pixel};
    }

    void borrow(std::size_t pixel, float reach, Borrower& borrower) const {
        const auto width = static_cast<std::size_t>(visible_.width);
        const glm::ivec2 at(pixel % width, pixel / width);
        const core::SampleSequence sequence(pixel_key(seed_, at.x, at.y, kReflectionReuseUse), frame_);
        const float angle = 2.0f * core::kPi * sequence.point(0).x;
        const glm::vec2 turn(std::cos(angle), std::sin(angle));
        for (const glm::vec2& offset : offsets_) {
            const glm::vec2 turned(turn.x * offset.x - turn.y * offset.y,
                                   turn.x * offset.y + turn.y * offset.x);
            const glm::ivec2 there = at + glm::ivec2(glm::round(turned));
            if (there == at || there.x < 0 || there.y < 0 || there.x >= visible_.width ||
                there.y >= visible_.height) {
                continue;
            }
            const std::size_t other = visible_.index(there.x, there.y);
            const glm::vec3 apart = visible_.origins[other] - borrower.point.position;
            if (glm::dot(apart, apart) > reach * reach) continue;
            if (std::abs(glm::dot(apart, borrower.point.geometric_normal)) > kOffPlane * reach) continue;
            for (const ReflectionRay& ray : rays_of(other)) {
                if (borrower.is_far(ray)) borrower.add(apart, ray);
            }
        }
    }

    const VisibleSurfaces& visible_;
    const ReflectionRays& rays_;
    const IntegrateSettings& settings_;
    std::uint64_t seed_;
    std::uint32_t frame_;
    std::vector<glm::vec2> offsets_;
};

}  // namespace

void reuse_reflections(const VisibleSurfaces& visible, const ReflectionRays& rays,
                       const IntegrateSettings& settings, std::uint64_t seed, std::uint32_t frame,
                       std::vector<glm::vec3>& specular) {
    const Reuse reuse(visible, rays, settings, seed, frame);
    core::parallel_for(visible.depth.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t pixel = begin; pixel < end; ++pixel) {
            if (reuse.takes_part(pixel)) specular[pixel] += reuse.light_of(pixel);
        }
    });
}

}  // namespace gather
