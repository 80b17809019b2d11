#include "tests/bench/bench_rays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/support/error.h"
#include "tests/support/analytic_scenes.h"

namespace tests {
namespace {

/// The even bits of a Morton code.
int even_bits(std::uint32_t code) {
    int result = 0;
    for (int bit = 0; bit < 16; ++bit) result |= static_cast<int>(code >> (2 * bit) & 1) << bit;
    return result;
}

std::vector<core::Ray> primary_rays(const BenchScene& scene, int side) {
    const glm::dvec3 forward = glm::normalize(scene.target - scene.eye);
    const glm::dvec3 right = glm::normalize(glm::cross(forward, glm::dvec3(0.0, 1.0, 0.0)));
    const glm::dvec3 up = glm::cross(right, forward);
    const double reach = std::tan(0.5 * scene.field_of_view);
    TestRandom random(1);
    std::vector<core::Ray> rays;
    const auto count = static_cast<std::uint32_t>(side) * static_cast<std::uint32_t>(side);
    for (std::uint32_t code = 0; code < count; ++code) {
        const double x = (2.0 * (even_bits(code) + random.uniform()) / side - 1.0) * reach;
        const double y = (2.0 * (even_bits(code >> 1) + random.uniform()) / side - 1.0) * reach;
        rays.push_back(make_ray(scene.eye, forward + x * right - y * up,
                                std::numeric_limits<float>::infinity(), random.bits()));
    }
    return rays;
}

/// A point just off a surface, and which way is out.
struct Start {
    glm::dvec3 position;
    glm::dvec3 normal;
};

std::vector<Start> starts_of(const std::vector<core::Ray>& rays, const BenchRayStarts& tracers) {
    core::HitStream hits;
    tracers.triangles.trace_closest(stream_of(rays), hits);
    std::vector<Start> starts;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Hit hit = hits.get(i);
        if (!hit.hit()) continue;
        const glm::dvec3 normal(hit.normal);
        const double offset = std::max(hit.offset, tracers.fields.start_offset(hit.instance));
        starts.push_back(
            {glm::dvec3(rays[i].origin) + double(hit.t) * glm::dvec3(rays[i].direction) + offset * normal,
             normal});
    }
    if (starts.empty()) {
        throw core::InputError(core::ErrorKind::kBadData, "no primary ray of the benchmark hits its mesh");
    }
    return starts;
}

/// Every start in turn, until there are enough rays.
std::vector<core::Ray> bounce_rays(const std::vector<Start>& starts, std::size_t count) {
    TestRandom random(2);
    std::vector<core::Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
        const Start& start = starts[i % starts.size()];
        rays.push_back(make_ray(start.position, random.cosine_direction(start.normal),
                                std::numeric_limits<float>::infinity(), random.bits()));
    }
    for (std::size_t i = rays.size(); i > 1; --i) {
        std::swap(rays[i - 1], rays[random.bits() % i]);
    }
    return rays;
}

std::vector<core::Ray> occlusion_rays(const std::vector<Start>& starts, std::size_t count, double radius) {
    TestRandom random(3);
    std::vector<core::Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
        // Fewer starts than rays: several rays of one start follow each other.
        const Start& start = starts[i * starts.size() / count];
        glm::dvec3 direction = random.direction();
        if (glm::dot(direction, start.normal) < 0.0) direction = -direction;
        const double length = radius * std::cbrt(random.uniform());
        rays.push_back(make_ray(start.position, direction, static_cast<float>(length), random.bits()));
    }
    return rays;
}

}  // namespace

std::size_t BenchRays::size() const {
    std::size_t total = 0;
    for (const core::RayStream& piece : pieces) total += piece.size();
    return total;
}

BenchRays make_bench_rays(const std::string& kind, const BenchScene& scene, const BenchRayStarts& starts,
                          int side) {
    std::vector<core::Ray> rays = primary_rays(scene, side);
    const std::size_t count = rays.size();
    BenchRays result;
    if (kind == "primary") {
        result.is_coherent = true;
    } else if (kind == "bounce") {
        rays = bounce_rays(starts_of(rays, starts), count);
    } else if (kind == "occlusion") {
        const double diagonal = glm::length(core::world_bounds(scene.scene).extent());
        rays = occlusion_rays(starts_of(rays, starts), count, 0.1 * diagonal);
        result.is_occlusion = true;
    } else {
        throw core::InputError(core::ErrorKind::kUsage, fmt::format("no rays '{}'", kind));
    }
    for (std::size_t begin = 0; begin < count; begin += kPieceRays) {
        const auto first = rays.begin() + static_cast<std::ptrdiff_t>(begin);
        const auto last = rays.begin() + static_cast<std::ptrdiff_t>(std::min(begin + kPieceRays, count));
        result.pieces.push_back(stream_of({first, last}));
    }
    return result;
}

}  // namespace tests
