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

/// Layers one behind the other along z, `spacing` voxels apart, of the thicknesses in turn; 0: sheets.
core::Mesh layers(int count, double voxel, double spacing, const std::vector<double>& thicknesses) {
    std::vector<core::Mesh> all;
    for (int i = 0; i < count; ++i) {
        const double thickness = thicknesses[static_cast<std::size_t>(i) % thicknesses.size()];
        const core::Mesh layer = thickness == 0.0
                                     ? quad(0.5f, 0.5f)
                                     : box({0.25f, 0.25f, static_cast<float>(0.5 * thickness * voxel)});
        all.push_back(moved(layer, translation({0, 0, i * spacing * voxel})));
    }
    core::Mesh mesh = all[0];
    for (std::size_t i = 1; i < all.size(); ++i) mesh = merged(mesh, all[i]);
    return mesh;
}

TEST(ThickenedFeatures, AreSeenBehindAsManyTransparentOnesAsThereAre) {
    constexpr double kVoxel = 1.0 / 16;
    const struct {
        const char* name;
        double spacing;
        std::vector<double> thicknesses;
    } stacks[] = {{"plates", 6.0, {3.0}},
                  {"sheets", 1.3, {0.0}},
                  {"thin walls", 4.0, {0.2}},
                  {"plates and thin walls", 6.0, {3.0, 0.2}},
                  {"plates and sheets", 6.0, {3.0, 0.0}}};
    constexpr int kLayers = 70;
    for (const auto& stack : stacks) {
        core::Scene scene = scene_of(layers(kLayers, kVoxel, stack.spacing, stack.thicknesses));
        scene.materials[0].alpha_mode = core::AlphaMode::kBlend;
        scene.materials[0].base_color.a = 0.01f;
        const sdf::SdfTracer fields = tracer_of(scene, kVoxel);
        const core::TriangleTracer triangles(scene);
        TestRandom random(8);
        std::vector<core::Ray> rays;
        for (int i = 0; i < 3000; ++i) {
            const glm::dvec3 tilt(random.uniform(-0.004, 0.004), random.uniform(-0.004, 0.004), 1.0);
            rays.push_back(make_ray({random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), -1.0}, tilt));
            rays.back().seed = static_cast<std::uint32_t>(i);
        }
        const core::RayStream stream = stream_of(rays);
        const core::HitStream expected = closest(triangles, stream), found = closest(fields, stream);
        std::vector<std::uint8_t> occluded(rays.size());
        fields.trace_occluded(stream, occluded);
        int hits = 0, behind = 0, different = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const core::Hit a = expected.get(i), b = found.get(i);
            ASSERT_EQ(b.hit(), occluded[i] != 0) << stack.name;
            ASSERT_NE(b.status, core::HitStatus::kExhausted) << stack.name;
            hits += a.hit();
            behind += a.hit() && a.t > 0.7 * kLayers * stack.spacing * kVoxel;
            different += a.hit() != b.hit() ||
                         (a.hit() && (a.triangle != b.triangle || std::abs(a.t - b.t) > 0.1 * kVoxel));
        }
        EXPECT_GT(hits, 1000) << stack.name;
        EXPECT_GT(behind, 100) << stack.name;
        // At a diagonal the field may name the other triangle, which the seed may have hidden.
        EXPECT_LE(different, 30) << stack.name;
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
