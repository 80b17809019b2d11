#include "gather/lighting/outlines.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <optional>

#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr std::size_t kPixelsAtOnce = 512;
constexpr std::size_t kRowsAtOnce = 4;

/// Neighbours whose normals have a smaller cosine are not one surface.
constexpr float kLeastCosine = 0.9f;

/// Nor are those farther off each other's plane than this share of their distance.
constexpr float kMostSlope = 0.35f;

/// An emission that differs by more than this share is another's.
constexpr float kMostEmissionChange = 0.1f;

constexpr float kMostTint = 4.0f;

bool same_surface(const core::SurfacePoint& a, const core::SurfacePoint& b) {
    if (a.instance != b.instance || glm::dot(a.geometric_normal, b.geometric_normal) < kLeastCosine)
        return false;
    const glm::vec3 offset = b.position - a.position;
    const float off_plane = std::max(std::abs(glm::dot(offset, a.geometric_normal)),
                                     std::abs(glm::dot(offset, b.geometric_normal)));
    return off_plane * off_plane <= kMostSlope * kMostSlope * glm::dot(offset, offset);
}

bool same_emission(const glm::vec3& a, const glm::vec3& b) {
    const glm::vec3 most = kMostEmissionChange * glm::max(a, b);
    return glm::all(glm::lessThanEqual(glm::abs(a - b), most));
}

/// A texture's change from one sample to the other. Dark samples tell too little of it.
glm::vec3 tint_between(const core::SurfacePoint& source, const core::SurfacePoint& point) {
    const glm::vec3 from = core::approximate_albedo(source.brdf);
    return glm::clamp(core::approximate_albedo(point.brdf) / glm::max(from, glm::vec3(1e-6f)),
                      glm::vec3(1.0f / kMostTint), glm::vec3(kMostTint));
}

/// Calls `visit` with the pixel and those beside it.
template <typename Visit>
void for_neighbours(const VisibleSurfaces& visible, std::size_t pixel, const Visit& visit) {
    const auto width = static_cast<std::size_t>(visible.width);
    const int x = static_cast<int>(pixel % width), y = static_cast<int>(pixel / width);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, visible.height - 1); ++v) {
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, visible.width - 1); ++u) {
            visit(visible.index(u, v));
        }
    }
}

/// The sample around `pixel` whose light stands for that of `point`: the nearest on its surface, or, where
/// its surface is as thin as a leaf's edge, the nearest on its instance, or, where that is as thin as a
/// wire, the nearest of all.
std::optional<std::size_t> find_source(const VisibleSurfaces& visible, std::size_t pixel,
                                       const core::SurfacePoint& point) {
    enum Likeness { kAny, kInstance, kSurface, kLikenesses };
    std::array<std::optional<std::size_t>, kLikenesses> nearest;
    std::array<float, kLikenesses> least;
    least.fill(std::numeric_limits<float>::infinity());
    for_neighbours(visible, pixel, [&](std::size_t other) {
        if (!visible.surface(other)) return;
        const core::SurfacePoint& candidate = visible.points[other];
        const glm::vec3 offset = candidate.position - point.position;
        const float distance2 = glm::dot(offset, offset);
        const bool same_instance = candidate.instance == point.instance;
        const std::size_t likeness = same_surface(point, candidate) ? kSurface
                                     : same_instance                ? kInstance
                                                                    : kAny;
        for (std::size_t i = 0; i <= likeness; ++i) {
            if (!(distance2 < least[i])) continue;
            least[i] = distance2;
            nearest[i] = other;
        }
    });
    for (std::size_t i = kLikenesses; i-- > 0;) {
        if (nearest[i]) return nearest[i];
    }
    return std::nullopt;
}

}  // namespace

bool is_outline(const VisibleSurfaces& visible, std::size_t a, std::size_t b) {
    if (visible.surface(a) != visible.surface(b)) return true;
    if (!visible.surface(a)) return false;
    return !same_surface(visible.points[a], visible.points[b]) ||
           !same_emission(visible.emitted[a], visible.emitted[b]);
}

Outlines::Outlines(int width, int height, int samples) : further_(static_cast<std::uint32_t>(samples - 1)) {
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    film_indices_.assign(pixels, 0);
    if (further_ > 0) marks_.assign(pixels, 0);
}

Outlines::Rays Outlines::sample(const core::RenderInputs& inputs, const SceneLighting& lighting,
                                const VisibleSurfaces& visible) {
    const core::CameraRays camera(inputs.camera, inputs.width, inputs.height);
    const auto width = static_cast<std::size_t>(visible.width);
    samples_.assign(pixels_.size() * further_, OutlineSample{});
    std::atomic<std::uint64_t> shadow_rays{0}, exhausted{0};
    core::parallel_for(pixels_.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        const core::ScopedFlushDenormals flush;
        core::RayStream rays;
        core::HitStream hits;
        VisibleSurfaces seen;
        const std::size_t count = (end - begin) * further_;
        rays.resize(count);
        seen.resize(static_cast<int>(count), 1);
        const auto pixel_of = [&](std::size_t i) {
            return static_cast<std::size_t>(pixels_[begin + i / further_]);
        };
        const auto film_index_of = [&](std::size_t i) {
            return film_indices_[pixel_of(i)] + static_cast<std::uint32_t>(1 + i % further_);
        };
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t pixel = pixel_of(i);
            rays.set(i, film_ray(inputs, camera, static_cast<int>(pixel % width),
                                 static_cast<int>(pixel / width), film_index_of(i)));
        }
        inputs.primary.trace_closest(rays, hits);
        std::uint64_t lost = 0;
        for (std::size_t i = 0; i < count; ++i) {
            lost += see(inputs, lighting, camera, rays.get(i), hits.get(i), i, seen) ? 0 : 1;
        }
        std::vector<glm::vec3> direct(count, glm::vec3(0.0f));
        if (lighting.samples_anything()) {
            const PassRays light = light_surfaces(
                inputs, lighting, seen, 0, count, 1,
                [&](std::size_t i) {
                    const std::size_t pixel = pixel_of(i);
                    return SampleId{pixel_key(inputs.seed, static_cast<int>(pixel % width),
                                              static_cast<int>(pixel / width), kOutlineUse),
                                    film_index_of(i)};
                },
                direct);
            shadow_rays += light.rays;
            lost += light.exhausted;
        }
        for (std::size_t i = 0; i < count; ++i) {
            OutlineSample& sample = samples_[begin * further_ + i];
            sample.pixel = pixels_[begin + i / further_];
            sample.steps = seen.steps[i];
            sample.direct = seen.emitted[i] + direct[i];
            if (!seen.surface(i)) continue;
            sample.normal = seen.points[i].frame.normal;
            sample.albedo = core::approximate_albedo(seen.points[i].brdf);
            sample.depth = seen.depth[i];
            sample.distance = seen.distance[i];
            const auto source = find_source(visible, sample.pixel, seen.points[i]);
            sample.source = source ? static_cast<std::uint32_t>(*source) : OutlineSample::kAlone;
            if (source) sample.tint = tint_between(visible.points[*source], seen.points[i]);
        }
        exhausted += lost;
    });
    return {pixels_.size() * further_, shadow_rays, exhausted};
}

void Outlines::for_pixels(const std::function<void(std::span<const OutlineSample>)>& body) const {
    core::parallel_for(pixels_.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        body({samples_.data() + begin * further_, (end - begin) * further_});
    });
}

void Outlines::end_frame(const VisibleSurfaces& visible) {
    for (const std::uint32_t pixel : pixels_) film_indices_[pixel] += further_;
    const auto width = static_cast<std::size_t>(visible.width);
    std::atomic<bool> found{false};
    core::parallel_for(static_cast<std::size_t>(visible.height), kRowsAtOnce,
                       [&](std::size_t begin, std::size_t end) {
                           for (std::size_t y = begin; y < end; ++y) {
                               for (std::size_t x = 0; x < width; ++x) {
                                   const std::size_t pixel = y * width + x;
                                   ++film_indices_[pixel];
                                   if (further_ == 0 || marks_[pixel]) continue;
                                   if ((x > 0 && is_outline(visible, pixel, pixel - 1)) ||
                                       (x + 1 < width && is_outline(visible, pixel, pixel + 1)) ||
                                       (y > 0 && is_outline(visible, pixel, pixel - width)) ||
                                       (y + 1 < static_cast<std::size_t>(visible.height) &&
                                        is_outline(visible, pixel, pixel + width))) {
                                       marks_[pixel] = 1;
                                       found = true;
                                   }
                               }
                           }
                       });
    if (!found) return;
    pixels_.clear();
    for (std::size_t pixel = 0; pixel < marks_.size(); ++pixel) {
        if (marks_[pixel]) pixels_.push_back(static_cast<std::uint32_t>(pixel));
    }
}

std::uint64_t Outlines::bytes(int width, int height, int samples) {
    const std::uint64_t pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    const std::uint64_t most =
        samples > 1
            ? 1 + sizeof(std::uint32_t) + static_cast<std::uint64_t>(samples - 1) * sizeof(OutlineSample)
            : 0;
    return pixels * (sizeof(std::uint32_t) + most);
}

}  // namespace gather
