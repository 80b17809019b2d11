#include "core/trace/triangle_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "tests/support/analytic_scenes.h"

namespace tests {
namespace {

TEST(TriangleTracer, NormalsSurviveTinyAndHugeScalesOfMeshAndInstance) {
    // Scales multiply to 1, so that the rays are ordinary whatever the spaces between are like.
    for (const double scale : {1e-20, 1e-6, 1.0, 1e6, 1e18}) {
        const core::Scene scene =
            scene_of(moved(box(), scaling(glm::dvec3(scale))), scaling(glm::dvec3(1.0 / scale)));
        for (const bool flatten : {false, true}) {
            const core::TriangleTracer tracer(scene,
                                              {.packet_width = 0, .instruction_set = {}, .flatten = flatten});
            core::HitStream hits;
            tracer.trace_closest(stream_of({make_ray({0.1, 0.2, 3.0}, {0, 0, -1})}), hits);
            ASSERT_TRUE(hits.get(0).hit()) << scale;
            EXPECT_NEAR(hits.t[0], 2.5f, 1e-5f) << scale;
            EXPECT_NEAR(hits.normal_z[0], 1.0f, 1e-6f) << scale;
            EXPECT_TRUE(hits.offset[0] > 0.0f && hits.offset[0] < 1e-4f) << scale << " " << hits.offset[0];
        }
    }
}

TEST(TriangleTracer, WholeWorldsMayBeTinyOrHuge) {
    for (const double scale : {1e-12, 1e-6, 1e6, 1e12}) {
        const core::Scene scene = scene_of(box(), scaling(glm::dvec3(scale)));
        const core::TriangleTracer tracer(scene);
        core::HitStream hits;
        tracer.trace_closest(stream_of({make_ray(scale * glm::dvec3(0.1, 0.2, 3.0), {0, 0, -1})}), hits);
        ASSERT_TRUE(hits.get(0).hit()) << scale;
        EXPECT_NEAR(hits.t[0] / scale, 2.5, 1e-5) << scale;
        EXPECT_NEAR(hits.normal_z[0], 1.0f, 1e-6f) << scale;
    }
}

TEST(TriangleTracer, RefusesByNameWhatFloatsCannotHold) {
    // Embree ends the program when a ray leaves its range, so such scenes must not reach it.
    const auto refusal = [](const core::Scene& scene) -> std::string {
        try {
            const core::TriangleTracer tracer(scene);
        } catch (const core::InputError& error) {
            EXPECT_EQ(error.kind(), core::ErrorKind::kBadData);
            return error.what();
        }
        return "";
    };
    const glm::dmat4 far_off = translation({1e18, 0.0, 0.0});
    for (const glm::dmat4& transform :
         {scaling(glm::dvec3(1e-37)), scaling(glm::dvec3(1e30)), scaling({1e-20, 1.0, 1e20}), far_off}) {
        EXPECT_NE(refusal(scene_of(box(), transform)).find("can be traced"), std::string::npos);
    }
    core::Scene mixed = scene_of(box(), scaling(glm::dvec3(1e-10)));
    EXPECT_EQ(refusal(mixed), "");
    mixed.instances.push_back(core::make_instance("large", 0, {0}, scaling(glm::dvec3(1e10))));
    EXPECT_NE(refusal(mixed).find(mixed.instances[0].name), std::string::npos);
}

TEST(TriangleTracer, RaysFromBeyondItsRangeMiss) {
    const core::Scene scene = scene_of(box(), scaling(glm::dvec3(1e-10)));
    const core::TriangleTracer tracer(scene);
    core::HitStream hits;
    tracer.trace_closest(stream_of({make_ray({0, 0, 1e-9}, {0, 0, -1}), make_ray({0, 0, 1e12}, {0, 0, -1}),
                                    make_ray({0, 0, 1e30}, {0, 0, -1}), make_ray({3e38, 0, 0}, {-1, 0, 0})}),
                         hits);
    EXPECT_TRUE(hits.get(0).hit());
    for (std::size_t i = 1; i < 4; ++i) EXPECT_FALSE(hits.get(i).hit()) << i;
}

TEST(TriangleTracer, TrianglesWithoutAreaAreNeverHit) {
    core::Mesh mesh = quad(2.0f, 2.0f);
    // A sliver through the middle, collinear only in exact arithmetic, a point, and the quad behind them.
    const auto first = static_cast<unsigned>(mesh.positions.size());
    for (const glm::vec3& p : {glm::vec3(-1, 0, 0.5f), glm::vec3(0, 0, 0.5f), glm::vec3(1, 0, 0.5f)}) {
        mesh.positions.push_back(p);
        mesh.normals.emplace_back(0, 0, 1);
        mesh.uvs[0].emplace_back(0, 0);
    }
    mesh.triangles.insert(mesh.triangles.begin(),
                          {{first, first + 1, first + 2}, {first + 1, first + 1, first + 1}});
    mesh = make_mesh("slivers", mesh.positions, mesh.normals, mesh.uvs[0], mesh.triangles);
    const core::Scene scene = scene_of(mesh, rotation(0.3, {0, 0, 1}));
    const core::TriangleTracer tracer(scene);
    std::vector<core::Ray> rays;
    TestRandom random(1);
    for (int i = 0; i < 1000; ++i) {
        const glm::dvec3 target(scene.instances[0].world_from_local *
                                glm::dvec4(random.uniform(-0.9, 0.9), 0.0, 0.5, 1.0));
        const glm::dvec3 from = target + glm::dvec3(0.2 * random.direction().x, 0.1, 1.0);
        rays.push_back(make_ray(from, target - from));
    }
    core::HitStream hits;
    tracer.trace_closest(stream_of(rays), hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(hits.get(i).hit());
        EXPECT_GE(hits.triangle[i], 2u);
        EXPECT_NEAR(hits.normal_z[i], 1.0f, 1e-6f);
    }
}

TEST(TriangleTracer, FlattenedAndTwoLevelTreesNameTheSameTriangles) {
    core::Scene scene = scene_of(merged(icosphere(2), box()));
    const std::uint32_t other = add_mesh(scene, torus(1.0f, 0.3f, 24, 12));
    add_instance(scene, other, translation({0, 0, 3}) * scaling({1, -1, 1}));
    add_instance(scene, other, translation({0, 3, 0}) * rotation(1.0, {1, 0, 0}));
    const core::TriangleTracer flat(scene);
    const core::TriangleTracer levels(scene, {.packet_width = 0, .instruction_set = {}, .flatten = false});
    const core::RayStream rays = random_lines({0, 1, 1}, 3.0, 5000, 3);
    core::HitStream a, b;
    flat.trace_closest(rays, a);
    levels.trace_closest(rays, b);
    int different = 0, hit_count = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(a.status[i], b.status[i]);
        if (!a.get(i).hit()) continue;
        ++hit_count;
        EXPECT_NEAR(a.t[i], b.t[i], 1e-5f);
        EXPECT_EQ(a.front[i], b.front[i]);
        EXPECT_EQ(a.instance[i], b.instance[i]);
        different += a.triangle[i] != b.triangle[i] ? 1 : 0;
    }
    EXPECT_GT(hit_count, 500);
    // A ray through an edge belongs to either triangle.
    EXPECT_LE(different, 2);
}

TEST(TriangleTracer, StreamsOnManyThreadsGiveTheSameBits) {
    const core::Scene scene = scene_of(torus(1.0f, 0.4f));
    const core::TriangleTracer tracer(scene);
    const std::size_t stream_count = 32;
    std::vector<core::RayStream> rays;
    std::vector<core::HitStream> alone(stream_count), together(stream_count);
    for (std::size_t i = 0; i < stream_count; ++i) {
        rays.push_back(random_lines(glm::dvec3(0.0), 1.5, 300 + i, static_cast<std::uint32_t>(i)));
        tracer.trace_closest(rays[i], alone[i]);
    }
    core::with_thread_limit(4, [&] {
        core::parallel_for(stream_count, 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) tracer.trace_closest(rays[i], together[i]);
        });
    });
    for (std::size_t i = 0; i < stream_count; ++i) {
        for (std::size_t ray = 0; ray < rays[i].size(); ++ray) {
            ASSERT_EQ(alone[i].status[ray], together[i].status[ray]);
            if (!alone[i].get(ray).hit()) continue;
            EXPECT_EQ(alone[i].t[ray], together[i].t[ray]);
            EXPECT_EQ(alone[i].triangle[ray], together[i].triangle[ray]);
        }
    }
}

TEST(TriangleTracer, AnEmptySceneIsHitByNothing) {
    core::Scene scene;
    const core::TriangleTracer tracer(scene);
    core::HitStream hits;
    tracer.trace_closest(stream_of({make_ray({0, 0, 0}, {0, 0, 1})}), hits);
    EXPECT_FALSE(hits.get(0).hit());
}

TEST(TriangleTracer, MeasuresItsMemory) {
    const core::Scene small = scene_of(icosphere(2)), large = scene_of(icosphere(5));
    const std::size_t small_bytes = core::TriangleTracer(small).bytes();
    const std::size_t large_bytes = core::TriangleTracer(large).bytes();
    // Vertices, indices and normals alone are 30 bytes a triangle; the trees of 64 times the triangles
    // outweigh whatever is constant.
    EXPECT_GT(large_bytes, large.meshes[0].triangles.size() * 30);
    EXPECT_GT(large_bytes, 8 * small_bytes);
}

TEST(TriangleTracer, RefusesOptionsThatItCannotMeet) {
    const core::Scene scene = scene_of(quad());
    for (const core::TriangleTracerOptions& options :
         {core::TriangleTracerOptions{.packet_width = 3, .instruction_set = {}, .flatten = true},
          core::TriangleTracerOptions{.packet_width = -1, .instruction_set = {}, .flatten = true}}) {
        EXPECT_THROW(core::TriangleTracer(scene, options), core::InputError);
    }
}

}  // namespace
}  // namespace tests
