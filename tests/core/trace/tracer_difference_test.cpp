// Tracers that differ by a known amount: triangles against the same triangles moved.
#include "core/trace/tracer_difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "core/trace/triangle_tracer.h"
#include "tests/support/analytic_scenes.h"

namespace {

using core::RayStream;
using core::Scene;
using core::TracerDifference;

constexpr double kVoxel = 0.1;

/// A floor of 10 x 10 in z = 0 that faces +Z, placed by `matrix`.
Scene floor_at(const glm::dmat4& matrix = glm::dmat4(1.0)) {
    return tests::scene_of(tests::quad(10.0f, 10.0f), matrix);
}

TracerDifference compare(const Scene& reference, const Scene& tested, const RayStream& rays,
                         double voxel = kVoxel, std::uint32_t seed = 1) {
    const core::TriangleTracer expected(reference), found(tested);
    const std::vector<double> voxels(reference.meshes.size(), voxel);
    return core::compare_tracers({reference, expected, found, voxels}, rays, seed);
}

/// Slanted rays that meet z = 0 within `half` of (x, 0).
RayStream slanted_rays(int count, double half, double x = 0.0) {
    tests::TestRandom random(5);
    std::vector<core::Ray> rays;
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 target(x + random.uniform(-half, half), random.uniform(-half, half), 0.0);
        const glm::dvec3 from(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), 2.0);
        rays.push_back(tests::make_ray(target + from, -from));
    }
    return tests::stream_of(rays);
}

TEST(TracerDifference, IsNothingBetweenEqualTracers) {
    Scene scene;
    tests::add_material(scene, tests::lambert(glm::vec3(0.5f)));
    const std::uint32_t ball = tests::add_mesh(scene, tests::icosphere(3));
    tests::add_instance(scene, ball);
    tests::add_instance(scene, ball, tests::translation({2.5, 0.0, 0.0}));
    const RayStream rays = tests::random_lines(glm::dvec3(1.0, 0.0, 0.0), 3.0, 20'000, 3);
    const TracerDifference found = compare(scene, scene, rays);
    EXPECT_EQ(found.rays, 20'000u);
    EXPECT_GT(found.either, 2'000u);
    EXPECT_LT(found.either, 18'000u);
    EXPECT_GT(found.silhouettes, 0u);
    EXPECT_GT(found.shadow_rays, 1'000u);
    EXPECT_EQ(found.misses + found.false_hits + found.disagree_beyond + found.shadow_disagree, 0u);
    EXPECT_EQ(found.exhausted, 0u);
    EXPECT_EQ(found.voxels.max, 0.0);
    EXPECT_GT(found.reference_rays_per_second, 0.0);
    EXPECT_GT(found.tested_rays_per_second, 0.0);
}

TEST(TracerDifference, MeasuresDistanceAcrossTheSurfaceInVoxels) {
    // 0.3 below, in voxels of 0.1, however slanted the ray is. Floats of about 3 hold 0.3 to 1e-6.
    const TracerDifference found =
        compare(floor_at(), floor_at(tests::translation({0.0, 0.0, -0.3})), slanted_rays(5'000, 2.0));
    EXPECT_EQ(found.either, 5'000u);
    EXPECT_EQ(found.silhouettes, 0u);
    for (const core::DistanceQuantiles& voxels : {found.voxels, found.voxels_beyond}) {
        EXPECT_NEAR(voxels.p50, 3.0, 1e-4);
        EXPECT_NEAR(voxels.p99, 3.0, 1e-4);
        EXPECT_NEAR(voxels.max, 3.0, 1e-4);
    }
    EXPECT_NEAR(found.normal_degrees, 0.0, 1e-6);
}

TEST(TracerDifference, CountsVoxelsOfThePlacedMesh) {
    // Twice as large and stretched along the ray's normal by 4: a local voxel of 0.1 is 0.4 there.
    const glm::dmat4 stretched = tests::scaling({2.0, 2.0, 4.0});
    const TracerDifference found =
        compare(floor_at(stretched), floor_at(tests::translation({0.0, 0.0, -0.2}) * stretched),
                tests::stream_of(std::vector<core::Ray>(64, tests::make_ray({0.5, 0.3, 2.0}, {0, 0, -1}))));
    EXPECT_NEAR(found.voxels.p50, 0.5, 1e-5);
}

TEST(TracerDifference, TellsMissesFromFalseHits) {
    // One of the two floors stands elsewhere in the tested tracer.
    const auto floors = [](double x) {
        Scene scene = floor_at();
        tests::add_instance(scene, 0, tests::translation({x, 0.0, 0.0}));
        return scene;
    };
    RayStream rays = slanted_rays(100, 2.0);
    const RayStream more = slanted_rays(300, 2.0, 20.0);
    for (std::size_t i = 0; i < more.size(); ++i) rays.push_back(more.get(i));
    rays.push_back(tests::make_ray({0, 0, 1}, {0, 0, 1}));
    const TracerDifference missed = compare(floors(20.0), floors(500.0), rays);
    EXPECT_EQ(missed.either, 400u);
    EXPECT_EQ(missed.misses, 300u);
    EXPECT_EQ(missed.false_hits, 0u);
    EXPECT_EQ(missed.disagree_beyond, 300u);
    EXPECT_DOUBLE_EQ(missed.miss_percent(), 75.0);
    const TracerDifference invented = compare(floors(500.0), floors(20.0), rays);
    EXPECT_EQ(invented.misses, 0u);
    EXPECT_EQ(invented.false_hits, 300u);
    EXPECT_DOUBLE_EQ(invented.false_hit_percent(), 75.0);
    EXPECT_DOUBLE_EQ(invented.disagree_beyond_percent(), 75.0);
}

TEST(TracerDifference, JudgesByTheVoxelOfWhatWasHitInstead) {
    // The tested tracer lacks the upper floor and sees the one below: a distance, in that one's voxels.
    const auto with_upper_floor_at = [](const glm::dvec3& place) {
        Scene scene = floor_at();
        tests::add_instance(scene, tests::add_mesh(scene, tests::quad(10.0f, 10.0f)),
                            tests::translation(place));
        return scene;
    };
    const Scene scene = with_upper_floor_at({0.0, 0.0, 0.5}), lower = with_upper_floor_at({1000.0, 0.0, 0.5});
    const core::TriangleTracer expected(scene), found(lower);
    const std::vector<double> voxels = {kVoxel, 0.0};
    const TracerDifference difference =
        core::compare_tracers({scene, expected, found, voxels}, slanted_rays(100, 1.0), 1);
    EXPECT_NEAR(difference.voxels.p50, 5.0, 1e-4);
}

TEST(TracerDifference, SetsApartWhatIsWithinAVoxelOfASilhouette) {
    // Along x, straight down on a floor that ends at x = 5: 40 rays a voxel, of which those in (4.9, 5.1) are
    // near; the floor of the tested tracer ends at 4.95.
    std::vector<core::Ray> rays;
    for (int i = 0; i < 400; ++i)
        rays.push_back(tests::make_ray({4.5 + 0.0025 * (i + 0.5), 0, 1}, {0, 0, -1}));
    const TracerDifference found =
        compare(floor_at(), floor_at(tests::translation({-0.05, 0.0, 0.0})), tests::stream_of(rays));
    EXPECT_EQ(found.either, 200u);
    EXPECT_EQ(found.silhouettes, 40u);
    EXPECT_EQ(found.misses, 20u);
    EXPECT_EQ(found.disagree_beyond, 0u);
    const TracerDifference farther =
        compare(floor_at(), floor_at(tests::translation({-0.15, 0.0, 0.0})), tests::stream_of(rays));
    EXPECT_EQ(farther.misses, 60u);
    EXPECT_EQ(farther.disagree_beyond, 20u);
    EXPECT_DOUBLE_EQ(farther.disagree_beyond_percent(), 12.5);
}

TEST(TracerDifference, MeasuresTheAngleBetweenNormals) {
    const double degrees = 3.0;
    const TracerDifference found = compare(
        floor_at(), floor_at(tests::rotation(glm::radians(degrees), {1, 0, 0})), slanted_rays(500, 1.0));
    EXPECT_NEAR(found.normal_degrees, degrees, 1e-3);  // acos of a float near 1 is good to 1e-3.
}

TEST(TracerDifference, ComparesShadowsOfHitsTowardsWhereRaysWent) {
    // A lid over a small part of a floor. Queries between points of the floor are not asked, those to the sky
    // go straight up and meet the lid, which the tested tracer lacks.
    Scene scene = floor_at();
    const Scene bare = scene;
    tests::add_instance(scene, tests::add_mesh(scene, tests::quad(1.0f, 1.0f)),
                        tests::translation({0.0, 0.0, 1.0}));
    tests::TestRandom random(2);
    std::vector<core::Ray> rays;
    for (int i = 0; i < 2'000; ++i) {
        rays.push_back(
            tests::make_ray({random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), 0.5}, {0, 0, -1}));
        rays.push_back(tests::make_ray({8.0, 0.0, 1.0}, {0, 0, 1}));
    }
    const core::TriangleTracer expected(scene), found(bare);
    const std::vector<double> voxels(2, kVoxel);
    const TracerDifference difference =
        core::compare_tracers({scene, expected, found, voxels}, tests::stream_of(rays), 7);
    // Half of 2,000 draws meet the sky; four standard deviations of the binomial are 89.
    EXPECT_NEAR(static_cast<double>(difference.shadow_rays), 1'000.0, 89.0);
    EXPECT_EQ(difference.shadow_disagree, difference.shadow_rays);
    EXPECT_EQ(difference.misses + difference.false_hits, 0u);
    EXPECT_DOUBLE_EQ(difference.shadow_disagree_percent(), 100.0);
}

TEST(TracerDifference, DoesNotDependOnThreads) {
    const Scene scene = tests::scene_of(tests::torus(1.0f, 0.4f));
    const Scene moved = tests::scene_of(tests::torus(1.0f, 0.4f), tests::translation({0.01, 0.02, 0.0}));
    const RayStream rays = tests::random_lines(glm::dvec3(0.0), 1.5, 30'000, 9);
    std::vector<TracerDifference> found;
    for (const int threads : {1, 3}) {
        core::with_thread_limit(threads, [&] { found.push_back(compare(scene, moved, rays)); });
    }
    EXPECT_EQ(found[0].misses, found[1].misses);
    EXPECT_EQ(found[0].silhouettes, found[1].silhouettes);
    EXPECT_EQ(found[0].shadow_rays, found[1].shadow_rays);
    EXPECT_EQ(found[0].shadow_disagree, found[1].shadow_disagree);
    EXPECT_EQ(found[0].voxels.p99, found[1].voxels.p99);
    EXPECT_EQ(found[0].normal_degrees, found[1].normal_degrees);
    EXPECT_GT(found[0].shadow_disagree, 0u);
    EXPECT_GT(found[0].misses, 0u);
}

TEST(TracerDifference, StopsWhenAsked) {
    const Scene scene = floor_at();
    const core::TriangleTracer tracer(scene);
    const std::vector<double> voxels = {kVoxel};
    EXPECT_THROW(
        core::compare_tracers({scene, tracer, tracer, voxels}, slanted_rays(10, 1.0), 1, [] { return true; }),
        core::Interrupted);
}

TEST(PictureRays, AreCameraRaysThenCosineBounces) {
    // From inside a closed room every ray hits: as many rays again with each bounce.
    const Scene room = tests::scene_of(tests::reversed(tests::box(glm::vec3(2.0f))));
    const core::TriangleTracer tracer(room);
    const std::vector<double> voxels = {kVoxel};
    const core::Camera camera = core::look_at({0, 0, 1.5}, {0, 0, 0}, {0, 1, 0}, 0.8);
    const int width = 80, height = 60;
    const std::size_t pixels = 80 * 60;
    const RayStream rays = core::picture_rays({room, tracer, tracer, voxels}, camera, width, height, 2, 11);
    ASSERT_EQ(rays.size(), 3 * pixels);

    const core::CameraRays whole(camera, width, height);
    double cosine_sum = 0.0;
    core::HitStream hits;
    tracer.trace_closest(rays, hits);
    for (std::size_t i = 0; i < pixels; ++i) {
        const core::Ray corner = whole.ray(glm::vec2(i % 80, i / 80));
        const core::Ray opposite = whole.ray(glm::vec2(i % 80 + 1, i / 80 + 1));
        const glm::vec3 direction = rays.get(i).direction;
        EXPECT_GE(direction.x, corner.direction.x - 1e-2f) << i;
        EXPECT_LE(direction.x, opposite.direction.x + 1e-2f) << i;
        EXPECT_EQ(rays.get(i).origin, corner.origin);
        // The first bounce of pixel i leaves where its camera ray came to.
        const core::Ray bounce = rays.get(pixels + i);
        const glm::vec3 point = rays.get(i).origin + hits.get(i).t * direction;
        EXPECT_LT(glm::length(bounce.origin - point), 1e-4f) << i;
        cosine_sum += glm::dot(bounce.direction, hits.get(i).normal);
    }
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_TRUE(hits.get(i).hit()) << i;
    // The mean cosine of a cosine lobe is 2/3, its deviation 0.236: four standard errors.
    EXPECT_NEAR(cosine_sum / double(pixels), 2.0 / 3.0, 4 * 0.236 / std::sqrt(double(pixels)));
}

TEST(PictureRays, EndWhereTheyLeaveTheScene) {
    const Scene scene = floor_at();
    const core::TriangleTracer tracer(scene);
    const std::vector<double> voxels = {kVoxel};
    const core::Camera down = core::look_at({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, 0.8);
    EXPECT_EQ(core::picture_rays({scene, tracer, tracer, voxels}, down, 8, 8, 4, 1).size(), 2 * 64u);
}

}  // namespace
