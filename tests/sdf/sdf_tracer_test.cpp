#include "sdf/sdf_tracer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sdf/baker.h"
#include "sdf/transform_scale.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

std::unique_ptr<sdf::SdfTracer> tracer_of(const core::Scene& scene, int resolution) {
    sdf::BakeSettings settings;
    settings.resolution = resolution;
    return std::make_unique<sdf::SdfTracer>(scene,
                                            sdf::grids_by_mesh(scene, sdf::bake_scene(scene, settings, {})));
}

core::HitStream closest(const sdf::SdfTracer& tracer, const core::RayStream& rays) {
    core::HitStream hits;
    tracer.trace_closest(rays, hits);
    return hits;
}

TEST(SdfTracer, NoRayEscapesAClosedSphere) {
    const core::Scene scene = scene_of(icosphere(4));
    const auto tracer = tracer_of(scene, 48);
    TestRandom random(1);
    std::vector<core::Ray> rays;
    for (int i = 0; i < 100'000; ++i) {
        rays.push_back(make_ray(0.8 * std::cbrt(random.uniform()) * random.direction(), random.direction()));
    }
    const core::HitStream hits = closest(*tracer, stream_of(rays));
    std::size_t escapes = 0, front = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        escapes += !hits.get(i).hit();
        front += hits.get(i).front;
    }
    EXPECT_EQ(escapes, 0u);
    EXPECT_EQ(front, 0u);
    EXPECT_EQ(tracer->statistics().rays, rays.size());
    EXPECT_EQ(tracer->statistics().exhausted, 0u);
    EXPECT_GT(tracer->statistics().steps, rays.size());
}

TEST(SdfTracer, RaysAimedAtTheLatticeOfARoomDoNotEscape) {
    // From the centre of a room straight at sample points, cell edges and faces of its walls.
    const core::Scene scene = scene_of(reversed(box()));
    const auto tracer = tracer_of(scene, 32);
    std::vector<core::Ray> rays;
    for (int axis = 0; axis < 3; ++axis) {
        for (int i = -32; i <= 32; ++i) {
            for (int j = -32; j <= 32; ++j) {
                glm::dvec3 target;
                target[axis] = 0.5;
                target[(axis + 1) % 3] = i / 64.0;
                target[(axis + 2) % 3] = j / 64.0;
                rays.push_back(make_ray(glm::dvec3(0.0), target));
                rays.push_back(make_ray(glm::dvec3(0.0), -target));
            }
        }
    }
    const core::HitStream hits = closest(*tracer, stream_of(rays));
    for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(hits.get(i).hit()) << i;
        EXPECT_TRUE(hits.get(i).front);
    }
}

TEST(SdfTracer, SheetsHaveNoHolesInsideTheirBorder) {
    for (const double angle : {0.0, 0.37, 0.785398}) {
        const core::Mesh mesh = moved(quad(1.0f, 1.0f), rotation(angle, {1.0, 0.7, 0.2}));
        const core::Scene scene = scene_of(mesh);
        const auto tracer = tracer_of(scene, 40);
        const double h = 1.5 / 40;
        TestRandom random(5);
        const glm::dmat3 turn(rotation(angle, {1.0, 0.7, 0.2}));
        std::vector<core::Ray> rays;
        std::vector<glm::dvec3> targets;
        for (int i = 0; i < 30'000; ++i) {
            const glm::dvec3 target =
                turn * glm::dvec3(random.uniform(-0.5 + h, 0.5 - h), random.uniform(-0.5 + h, 0.5 - h), 0.0);
            const glm::dvec3 origin = target + 2.0 * random.direction();
            targets.push_back(target);
            rays.push_back(make_ray(origin, target - origin));
        }
        const core::HitStream hits = closest(*tracer, stream_of(rays));
        const glm::dvec3 normal = turn * glm::dvec3(0, 0, 1);
        std::size_t misses = 0, wrong_side = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const core::Hit hit = hits.get(i);
            misses += !hit.hit();
            if (!hit.hit()) continue;
            wrong_side += hit.front != (glm::dot(normal, glm::dvec3(rays[i].direction)) < 0.0);
            // Barycentrics give a point of the sheet itself.
            const glm::uvec3& corner = mesh.triangles[hit.triangle];
            const glm::vec3 point =
                mesh.positions[corner.x] +
                hit.barycentrics.x * (mesh.positions[corner.y] - mesh.positions[corner.x]) +
                hit.barycentrics.y * (mesh.positions[corner.z] - mesh.positions[corner.x]);
            ASSERT_NEAR(glm::dot(glm::dvec3(point), normal), 0.0, 1e-6);
        }
        EXPECT_EQ(misses, 0u) << "at angle " << angle;
        EXPECT_EQ(wrong_side, 0u) << "at angle " << angle;
    }
}

TEST(SdfTracer, RaysThatLeaveASheetDoNotMeetItAgain) {
    const core::Scene scene = scene_of(quad(1.0f, 1.0f), rotation(0.5, {1, 2, 3}) * scaling({2.0, 1.0, 1.0}));
    const auto tracer = tracer_of(scene, 32);
    const core::RayStream rays = random_lines(glm::dvec3(0.0), 1.2, 60'000, 4);
    const core::HitStream hits = closest(*tracer, rays);
    TestRandom random(6);
    std::vector<core::Ray> bounces;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Hit hit = hits.get(i);
        if (!hit.hit()) continue;
        const core::Ray ray = rays.get(i);
        const glm::dvec3 normal(hit.normal);
        bounces.push_back(make_ray(
            glm::dvec3(ray.origin) + double(hit.t) * glm::dvec3(ray.direction) + double(hit.offset) * normal,
            random.cosine_direction(normal)));
    }
    ASSERT_GT(bounces.size(), 5000u);
    std::vector<std::uint8_t> occluded(bounces.size());
    tracer->trace_occluded(stream_of(bounces), occluded);
    std::size_t self_hits = 0;
    for (const std::uint8_t one : occluded) self_hits += one;
    EXPECT_EQ(self_hits, 0u) << "of " << bounces.size();
}

TEST(SdfTracer, ARayThatStartsWithinAShellHitsOnlyIfItMeetsTheSheet) {
    const core::Scene scene = scene_of(quad(1.0f, 1.0f));
    const auto tracer = tracer_of(scene, 32);
    const double inside_shell = 0.3 / 32;
    const auto hit = [&](const core::Ray& ray) { return closest(*tracer, stream_of({ray})).get(0); };
    EXPECT_TRUE(hit(make_ray({0.01, 0.02, inside_shell}, {0.1, 0.2, -1.0})).hit());
    EXPECT_TRUE(hit(make_ray({0.01, 0.02, inside_shell}, {0.1, 0.2, -1.0})).front);
    EXPECT_FALSE(hit(make_ray({0.01, 0.02, inside_shell}, {0.1, 0.2, 1.0})).hit());
    EXPECT_TRUE(hit(make_ray({0.01, 0.02, -inside_shell}, {0.1, 0.2, 1.0})).hit());
    EXPECT_FALSE(hit(make_ray({0.01, 0.02, -inside_shell}, {0.1, 0.2, 1.0})).front);
    EXPECT_FALSE(hit(make_ray({0.01, 0.02, -inside_shell}, {0.1, 0.2, -1.0})).hit());
}

TEST(SdfTracer, TransparentSheetsLetRaysOnToWhatIsBehind) {
    core::Scene scene = scene_of(quad(1.0f, 1.0f));
    scene.materials[0].alpha_mode = core::AlphaMode::kBlend;
    scene.materials[0].base_color.a = 0.5f;
    add_instance(scene, 0, translation({0, 0, -1}), add_material(scene, lambert(glm::vec3(0.5f))));
    const auto tracer = tracer_of(scene, 32);
    std::vector<core::Ray> rays;
    const int count = 4000;
    for (int i = 0; i < count; ++i) {
        rays.push_back(make_ray({0.1, 0.13, 2.0}, {0.01, 0.02, -1}, 10.0f, std::uint32_t(i) * 2654435761u));
    }
    const core::HitStream hits = closest(*tracer, stream_of(rays));
    int first = 0, second = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(hits.get(i).hit());
        (hits.instance[i] == 0 ? first : second) += 1;
    }
    // One decision a ray, not one for each side of the shell: five standard deviations of the binomial.
    EXPECT_NEAR(first, count / 2, 5.0 * std::sqrt(count * 0.25));
    EXPECT_EQ(first + second, count);
}

TEST(SdfTracer, ThinWallsStopEveryRay) {
    // A wall of a twentieth of a voxel, in random orientations.
    TestRandom random(12);
    for (int turn = 0; turn < 6; ++turn) {
        const glm::dmat4 matrix = rotation(random.uniform(0.0, 3.0), random.direction());
        const core::Scene scene = scene_of(moved(box({0.5f, 0.5f, 0.0006f}), matrix));
        const auto tracer = tracer_of(scene, 40);
        std::vector<core::Ray> rays;
        for (int i = 0; i < 4000; ++i) {
            const glm::dvec3 target(
                matrix * glm::dvec4(random.uniform(-0.45, 0.45), random.uniform(-0.45, 0.45), 0, 1));
            const glm::dvec3 origin = target + 2.0 * random.direction();
            rays.push_back(make_ray(origin, target - origin));
        }
        std::vector<std::uint8_t> occluded(rays.size());
        tracer->trace_occluded(stream_of(rays), occluded);
        std::size_t passed = 0;
        for (const std::uint8_t one : occluded) passed += !one;
        EXPECT_EQ(passed, 0u) << "turn " << turn;
    }
}

TEST(SdfTracer, HolesOfASolidAreHoles) {
    // A ball without its cap: rays through the opening meet the inside of the far wall, as on triangles, and
    // not the lid with which the winding number closes the ball.
    core::Mesh ball = icosphere(4);
    std::erase_if(ball.triangles, [&](const glm::uvec3& corner) {
        return ball.positions[corner.x].y > 0.8f && ball.positions[corner.y].y > 0.8f &&
               ball.positions[corner.z].y > 0.8f;
    });
    ball = make_mesh("bowl", ball.positions, ball.normals, {}, ball.triangles);
    const core::Scene scene = scene_of(ball);
    const auto tracer = tracer_of(scene, 64);
    for (const double x : {-0.2, 0.0, 0.13, 0.25}) {
        const core::Hit hit = closest(*tracer, stream_of({make_ray({x, 3.0, 0.05}, {0, -1, 0})})).get(0);
        ASSERT_TRUE(hit.hit());
        EXPECT_FALSE(hit.front);
        EXPECT_NEAR(hit.t, 3.0 + std::sqrt(1.0 - x * x - 0.0025), 0.02);
    }
}

TEST(SdfTracer, InstancesAnswerLikeTheTransformedRay) {
    // Every affine map, mirrors and shear among them: t is that of the ray taken into local space.
    glm::dmat4 shear(1.0);
    shear[1][0] = 2.0;
    const core::Mesh mesh = torus(1.0f, 0.4f, 48, 24);
    const core::Scene plain = scene_of(mesh);
    const auto reference = tracer_of(plain, 48);
    for (const glm::dmat4& matrix :
         {scaling({-1.0, 1.0, 1.0}), scaling({1.0, 10.0, 0.1}), shear,
          translation({100, -20, 3}) * rotation(1.0, {1, 2, 3}) * scaling({-0.01, 0.02, 0.03})}) {
        const core::Scene scene = scene_of(mesh, matrix);
        const auto tracer = tracer_of(scene, 48);
        TestRandom random(3);
        std::vector<core::Ray> world, local;
        std::vector<double> stretch;
        for (int i = 0; i < 2000; ++i) {
            const glm::dvec3 origin = 3.0 * random.direction();
            const glm::dvec3 direction = 0.9 * random.direction() - origin;
            local.push_back(make_ray(origin, direction));
            const glm::dvec3 world_origin(matrix * glm::dvec4(origin, 1.0));
            const glm::dvec3 world_direction = glm::dmat3(matrix) * glm::normalize(direction);
            stretch.push_back(glm::length(world_direction));
            world.push_back(make_ray(world_origin, world_direction));
        }
        const core::HitStream a = closest(*reference, stream_of(local)),
                              b = closest(*tracer, stream_of(world));
        int different = 0, compared = 0;
        for (std::size_t i = 0; i < local.size(); ++i) {
            if (a.get(i).hit() != b.get(i).hit()) {
                ++different;
                continue;
            }
            if (!a.get(i).hit()) continue;
            // Float rays round differently in the two spaces: a few ulp of the coordinates over the cosine.
            const double cosine = -glm::dot(a.get(i).normal, local[i].direction);
            if (cosine < 0.1) continue;
            ++compared;
            const double reach = glm::length(world[i].origin) + b.t[i];
            const double slack =
                8.0 * 0x1p-23 * (reach / stretch[i] + 4.0) / cosine *
                sdf::largest_singular_value(glm::dmat3(scene.instances[0].local_from_world)) * stretch[i];
            ASSERT_NEAR(b.t[i] / stretch[i], a.t[i], 1e-6 + slack) << "ray " << i;
            EXPECT_EQ(a.get(i).front, b.get(i).front);
            EXPECT_LE(glm::dot(b.get(i).normal, world[i].direction), 0.0f);
        }
        EXPECT_LE(different, 4);
        EXPECT_GT(compared, 500);
    }
}

TEST(SdfTracer, ManyOverlappingInstancesEqualTheNearestOfEachAlone) {
    core::Scene scene = scene_of(icosphere(2));
    scene.instances.clear();
    TestRandom random(17);
    for (int i = 0; i < 60; ++i) {
        add_instance(scene, 0,
                     translation(0.7 * random.direction()) *
                         rotation(random.uniform(0, 3), random.direction()) *
                         scaling(glm::dvec3(random.uniform(0.1, 0.6), random.uniform(0.1, 0.6), 0.3)));
    }
    sdf::BakeSettings settings;
    settings.resolution = 24;
    const auto grids = sdf::grids_by_mesh(scene, sdf::bake_scene(scene, settings, {}));
    const sdf::SdfTracer all(scene, grids);
    const core::RayStream rays = random_lines(glm::dvec3(0.0), 1.3, 500, 2);
    const core::HitStream hits = closest(all, rays);
    std::vector<core::Hit> expected(rays.size());
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        core::Scene one = scene;
        one.instances = {scene.instances[i]};
        const core::HitStream alone = closest(sdf::SdfTracer(one, grids), rays);
        for (std::size_t k = 0; k < rays.size(); ++k) {
            core::Hit hit = alone.get(k);
            hit.instance = i;
            if (hit.hit() && (!expected[k].hit() || hit.t < expected[k].t)) expected[k] = hit;
        }
    }
    for (std::size_t k = 0; k < rays.size(); ++k) {
        ASSERT_EQ(hits.get(k).hit(), expected[k].hit());
        if (!expected[k].hit()) continue;
        EXPECT_EQ(hits.t[k], expected[k].t);
        EXPECT_EQ(hits.instance[k], expected[k].instance);
    }
}

TEST(SdfTracer, MeshesWithoutAFieldAreNotThere) {
    const core::Scene scene = scene_of(box());
    const sdf::SdfTracer tracer(scene, {nullptr});
    EXPECT_FALSE(closest(tracer, stream_of({make_ray({0, 0, 3}, {0, 0, -1})})).get(0).hit());
}

TEST(SdfTracer, FarCamerasSeeTheSameSurface) {
    const core::Scene scene = scene_of(icosphere(4));
    const auto tracer = tracer_of(scene, 64);
    const double near = closest(*tracer, stream_of({make_ray({0.1, 0.2, 10.0}, {0, 0, -1})})).t[0] - 10.0;
    for (const double distance : {1e2, 1e3, 1e4, 1e5}) {
        const core::Hit hit =
            closest(*tracer, stream_of({make_ray({0.1, 0.2, distance}, {0, 0, -1})})).get(0);
        ASSERT_TRUE(hit.hit());
        // The float that holds t: 4 ulp.
        EXPECT_NEAR(hit.t - distance, near, 1e-6 + 4.0 * distance * 0x1p-24) << distance;
    }
}

TEST(TransformScale, IsTheLargestSingularValue) {
    EXPECT_NEAR(sdf::largest_singular_value(glm::dmat3(scaling({1.0, -7.0, 3.0}))), 7.0, 1e-12);
    EXPECT_NEAR(sdf::largest_singular_value(glm::dmat3(
                    rotation(1.0, {1, 2, 3}) * scaling({1e-6, 2e-6, 5e-6}) * rotation(2.0, {3, 1, 0}))),
                5e-6, 1e-17);
    EXPECT_EQ(sdf::largest_singular_value(glm::dmat3(0.0)), 0.0);
    EXPECT_NEAR(sdf::largest_singular_value(glm::dmat3(2.5)), 2.5, 1e-12);
}

}  // namespace
}  // namespace tests
