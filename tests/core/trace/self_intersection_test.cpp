#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/trace/surface.h"
#include "core/trace/triangle_tracer.h"
#include "tests/support/analytic_scenes.h"

namespace tests {
namespace {

struct Placement {
    double scale;
    double distance;  ///< Of the object from the world's origin.
    double camera;    ///< Of the rays' origins from the object, in its sizes.
};

/// Traces rays at a convex shape, lets them bounce off with `part` of the hit's offset, and counts those that
/// meet the shape again.
struct Bounces {
    int count = 0;
    int self_hit_count = 0;
};
Bounces bounce(const core::Mesh& mesh, const Placement& at, bool flatten, double part, int count,
               bool stretched) {
    const glm::dvec3 center = at.distance * glm::normalize(glm::dvec3(1.0, -0.7, 0.4));
    glm::dmat4 matrix = translation(center) * rotation(0.8, {1, 2, 3}) * scaling(glm::dvec3(at.scale));
    if (stretched) matrix = matrix * scaling({1.0, 0.05, 3.0});
    const core::Scene scene = scene_of(mesh, matrix);
    const core::TriangleTracer tracer(scene, {.packet_width = 0, .instruction_set = {}, .flatten = flatten});
    TestRandom random(7);
    core::RayStream rays;
    rays.resize(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const glm::dvec3 from = center + at.camera * at.scale * random.direction();
        const glm::dvec3 inside(matrix *
                                glm::dvec4(0.8 * std::cbrt(random.uniform()) * random.direction(), 1.0));
        rays.set(i, make_ray(from, inside - from));
    }
    core::HitStream hits;
    tracer.trace_closest(rays, hits);
    core::RayStream bounces;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        core::Hit hit = hits.get(i);
        // A ray that nicks an edge within rounding may report its exit, and leaves for the inside.
        if (!hit.hit() || !hit.front) continue;
        hit.offset *= static_cast<float>(part);
        const core::SurfacePoint point = core::surface_at(scene, rays.get(i), hit);
        bounces.push_back(
            make_ray(point.origin_above(), random.cosine_direction(glm::dvec3(point.geometric_normal))));
    }
    Bounces result;
    tracer.trace_closest(bounces, hits);
    for (std::size_t i = 0; i < bounces.size(); ++i) {
        ++result.count;
        result.self_hit_count += hits.get(i).hit() ? 1 : 0;
    }
    return result;
}

std::vector<Placement> placements() {
    std::vector<Placement> result;
    for (const double scale : {1e-3, 1.0, 1e3, 1e5}) {
        for (const double distance : {0.0, 1.0, 1e2, 1e5}) {
            // Farther away than this the shape itself falls between two floats of the rays' origins.
            if (distance > 1e4 * scale) continue;
            for (const double camera : {5.0, 500.0}) result.push_back({scale, distance, camera});
        }
    }
    return result;
}

TEST(SelfIntersection, NoBounceMeetsItsOwnSurfaceAtAnyScaleOrPlace) {
    for (const core::Mesh& mesh : {icosphere(3), box()}) {
        for (const Placement& at : placements()) {
            for (const bool flatten : {false, true}) {
                for (const bool stretched : {false, true}) {
                    const Bounces all = bounce(mesh, at, flatten, 1.0, 4000, stretched);
                    EXPECT_EQ(all.self_hit_count, 0)
                        << mesh.name << " scale " << at.scale << " distance " << at.distance << " camera "
                        << at.camera << (flatten ? " flattened" : "") << (stretched ? " stretched" : "");
                }
            }
        }
    }
}

TEST(SelfIntersection, TheOffsetIsNoMoreThanRoundingNeeds) {
    // A tenth of it must fail somewhere, or the offset would eat contact shadows without a reason.
    int self_hit_count = 0;
    for (const Placement& at : placements()) {
        self_hit_count += bounce(box(), at, false, 0.1, 1000, false).self_hit_count;
    }
    EXPECT_GT(self_hit_count, 0);
}

}  // namespace
}  // namespace tests
