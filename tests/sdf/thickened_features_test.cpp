// Sheets and thin walls are held by a shell of half a voxel on either side. What a ray sees must be the
// surface within: as thin and as wide as its triangles.
#include <gtest/gtest.h>

#include "core/trace/triangle_tracer.h"
#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

sdf::SdfTracer tracer_of(const core::Scene& scene, double voxel) {
    sdf::BakeSettings settings;
    settings.voxel_world = voxel;
    return sdf::SdfTracer(scene, sdf::grids_by_mesh(scene, sdf::bake_scene(scene, settings, {})));
}

core::HitStream closest(const core::Tracer& tracer, const core::RayStream& rays) {
    core::HitStream hits;
    tracer.trace_closest(rays, hits);
    return hits;
}

/// A wavy sheet with a border, over the unit square.
core::Mesh wave() {
    core::Mesh mesh = quad(1.0f, 1.0f, 24, 24);
    for (glm::vec3& position : mesh.positions) {
        position.z = 0.08f * std::sin(9.0f * position.x) * std::cos(7.0f * position.y);
    }
    return make_mesh("wave", mesh.positions, {}, {}, mesh.triangles);
}

/// Two sheets a quarter of a voxel apart, whose shells are one.
core::Mesh double_sheet(double voxel) {
    return merged(quad(1.0f, 1.0f, 3, 3), moved(quad(0.6f, 0.6f, 3, 3), translation({0, 0, 0.25 * voxel})));
}

struct Case {
    const char* name;
    core::Mesh mesh;
    double voxel;
};

std::vector<Case> cases() {
    constexpr double kVoxel = 1.0 / 24;
    return {{"sheet", quad(1.0f, 1.0f, 3, 3), kVoxel},
            {"wave", wave(), kVoxel},
            {"double sheet", double_sheet(kVoxel), kVoxel},
            {"plate of a fifth of a voxel", box({0.5f, 0.5f, static_cast<float>(0.1 * kVoxel)}), kVoxel},
            {"plate, turned over", reversed(box({0.5f, 0.5f, static_cast<float>(0.1 * kVoxel)})), kVoxel},
            {"rod of half a voxel",
             box({0.5f, static_cast<float>(0.25 * kVoxel), static_cast<float>(0.25 * kVoxel)}), kVoxel}};
}

TEST(ThickenedFeatures, AreAsThinAndAsWideAsTheirTriangles) {
    for (const Case& one : cases()) {
        const core::Scene scene = scene_of(moved(one.mesh, rotation(0.4, {1, 2, 3})),
                                           translation({3, -1, 2}) * scaling({1.5, 1.0, 0.7}));
        const sdf::SdfTracer fields = tracer_of(scene, one.voxel);
        const core::TriangleTracer triangles(scene);
        const core::RayStream rays = random_lines(glm::dvec3(3, -1, 2), 1.2, 60'000, 31);
        const core::HitStream expected = closest(triangles, rays), found = closest(fields, rays);
        int hits = 0, different = 0, other_triangle = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const core::Hit a = expected.get(i), b = found.get(i);
            hits += a.hit();
            different += a.hit() != b.hit();
            if (!a.hit() || !b.hit()) continue;
            // Rays that meet an edge may name either of its triangles.
            other_triangle += a.triangle != b.triangle;
            if (a.triangle != b.triangle) continue;
            ASSERT_NEAR(a.t, b.t, 1e-5) << one.name;
            ASSERT_EQ(a.front, b.front) << one.name;
            ASSERT_GT(glm::dot(a.normal, b.normal), 0.99999f) << one.name;
        }
        EXPECT_GT(hits, 100) << one.name;
        // Both tracers round; a ray in 1e4 passes an edge within their rounding at most.
        EXPECT_LE(different, 2) << one.name;
        EXPECT_LE(other_triangle, 6) << one.name;
    }
}

TEST(ThickenedFeatures, AnyHitAgreesWithClosestHitHoweverARayEnds) {
    // Rays that start and end anywhere, within the shell too.
    for (const Case& one : cases()) {
        const core::Scene scene = scene_of(moved(one.mesh, rotation(0.4, {1, 2, 3})));
        const sdf::SdfTracer fields = tracer_of(scene, one.voxel);
        const core::TriangleTracer triangles(scene);
        TestRandom random(5);
        std::vector<core::Ray> rays;
        const glm::dmat3 turn(rotation(0.4, {1, 2, 3}));
        for (int i = 0; i < 40'000; ++i) {
            const glm::dvec3 start(random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6),
                                   one.voxel * random.uniform(-1.0, 1.0));
            rays.push_back(make_ray(turn * start, turn * random.direction(),
                                    static_cast<float>(one.voxel * random.uniform(0.0, 4.0))));
        }
        const core::RayStream stream = stream_of(rays);
        std::vector<std::uint8_t> occluded(rays.size()), expected(rays.size());
        fields.trace_occluded(stream, occluded);
        triangles.trace_occluded(stream, expected);
        const core::HitStream hits = closest(fields, stream);
        int different = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            ASSERT_EQ(hits.get(i).hit(), occluded[i] != 0) << one.name;
            different += occluded[i] != expected[i];
        }
        EXPECT_LE(different, 2) << one.name;
    }
}

TEST(ThickenedFeatures, ALampJustUnderACeilingIsSeen) {
    // Two instances: the lamp lies within the ceiling's shell.
    constexpr double kVoxel = 1.0 / 32;
    core::Scene scene = scene_of(quad(1.0f, 1.0f));
    const std::uint32_t lamp = add_mesh(scene, quad(0.3f, 0.3f));
    add_instance(scene, lamp, translation({0, 0, 0.2 * kVoxel}), 0);
    const sdf::SdfTracer fields = tracer_of(scene, kVoxel);
    const core::Hit hit = closest(fields, stream_of({make_ray({0.02, 0.03, 1.0}, {0, 0.1, -1})})).get(0);
    ASSERT_TRUE(hit.hit());
    EXPECT_EQ(hit.instance, 1u);
}

}  // namespace
}  // namespace tests
