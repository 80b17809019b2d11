// Case 37: whole frames against triangles: the figures, and bounds on them.
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "core/scene/scene_loader.h"
#include "core/trace/tracer_difference.h"
#include "core/trace/triangle_tracer.h"
#include "tests/stability/hard_case.h"
#include "tests/support/shared_data.h"

namespace tests {
namespace {

core::Camera camera_at(const glm::dvec3& eye, const glm::dvec3& target) {
    core::Camera camera;
    camera.world_from_camera = glm::inverse(glm::lookAt(eye, target, glm::dvec3(0, 1, 0)));
    return camera;
}

/// A floor, a ball, a ring and a turned box.
core::Scene still_life() {
    core::Scene scene;
    add_material(scene, lambert(glm::vec3(0.5f)));
    add_instance(scene, add_mesh(scene, box({3.0f, 0.1f, 3.0f})), translation({0, -0.1, 0}));
    add_instance(scene, add_mesh(scene, icosphere(5, 0.6f)), translation({-0.8, 0.6, 0.2}));
    add_instance(scene, add_mesh(scene, torus(0.5f, 0.18f, 96, 48)),
                 translation({0.7, 0.5, 0.6}) * rotation(1.1, {1, 0.2, 0}));
    add_instance(scene, add_mesh(scene, box(glm::vec3(0.4f))),
                 translation({0.5, 0.4, -1.0}) * rotation(0.6, {0, 1, 0}) * scaling({1.0, 1.0, 1.5}));
    return scene;
}

TEST(Case19, ShippedScenesExhaustNoRay) {
    for (const char* name : {"cornell_box", "two_rooms", "instances", "glossy", "thin_walls"}) {
        const BakedScene baked(core::load_scene_file(assets_folder() / (std::string(name) + ".glb")), 64);
        const core::DoubleBounds bounds = core::world_bounds(baked.scene());
        const core::RayStream rays = random_lines(bounds.center(), 0.5 * glm::length(bounds.extent()),
                                                  static_cast<std::size_t>(ray_count(10'000, 200'000)), 3);
        for_each_way([&](const Way& way) {
            const core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
            std::size_t exhausted = 0, found = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                exhausted += hits.status[i] == core::HitStatus::kExhausted;
                found += hits.get(i).hit();
            }
            // 1e-4 were allowed.
            EXPECT_EQ(exhausted, 0u) << name << ", " << way;
            EXPECT_GT(found, rays.size() / 50) << name;
        });
    }
}

TEST(Case37, FramesAgreeWithTriangles) {
    const core::Camera camera = camera_at({1.5, 1.8, 3.2}, {0, 0.3, 0});
    const int side = ray_count(96, 256);
    for (const int resolution : {48, 96}) {
        const BakedScene baked(still_life(), resolution);
        const core::TriangleTracer triangles(baked.scene());
        std::vector<double> voxels;
        for (std::uint32_t mesh = 0; mesh < baked.scene().meshes.size(); ++mesh)
            voxels.push_back(baked.voxel(mesh));
        for_each_way([&](const Way& way) {
            const core::TracerPair pair{baked.scene(), triangles, baked.tracer(way.mode), voxels};
            for (const int bounces : {0, 2}) {
                const core::RayStream rays = core::picture_rays(pair, camera, side, side, bounces, 1);
                const core::TracerDifference found = core::compare_tracers(pair, rays, 1);
                RecordProperty(testing::PrintToString(resolution) + way.target +
                                   std::to_string(static_cast<int>(way.mode)) + std::to_string(bounces),
                               std::to_string(found.voxels_beyond.p99));
                if (std::getenv("FIELDLIGHT_FIGURES")) {
                    std::cerr << resolution << " voxels, " << way << ", " << bounces << " bounces: disagree "
                              << found.disagree_percent() << " %, beyond silhouettes "
                              << found.disagree_beyond_percent() << " %, depth p50 " << found.voxels.p50
                              << " p99 " << found.voxels.p99 << " max " << found.voxels.max << ", beyond p99 "
                              << found.voxels_beyond.p99 << " max " << found.voxels_beyond.max
                              << " h, normals " << found.normal_degrees << " degrees, "
                              << found.tested_rays_per_second * 1e-6 << " Mrays/s (triangles "
                              << found.reference_rays_per_second * 1e-6 << ")\n";
                }
                EXPECT_GT(found.either, rays.size() / 3);
                EXPECT_EQ(found.exhausted, 0u) << way;
                EXPECT_LE(found.disagree_percent(), 1.0) << way;
                EXPECT_LE(found.disagree_beyond_percent(), 0.02) << way;
                EXPECT_LE(found.voxels_beyond.p50, 0.02) << way;
                EXPECT_LE(found.voxels_beyond.p99, 0.25) << way;
                EXPECT_LE(found.normal_degrees, 2.0) << way;
            }
        });
    }
}

}  // namespace
}  // namespace tests
