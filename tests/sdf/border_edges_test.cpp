#include "sdf/border_edges.h"

#include <gtest/gtest.h>

#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

TEST(BorderEdges, AreThoseOfOneTriangleAlone) {
    const core::Mesh closed = icosphere(2);
    EXPECT_EQ(sdf::find_border_edges({closed.positions, closed.triangles}),
              std::vector<std::uint8_t>(closed.triangles.size(), 0));

    // Two triangles that share the edge between the second and third corner of the first, whose own copies of
    // those corners only lie at the same places.
    core::Mesh pair;
    pair.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    pair.triangles = {{0, 1, 2}, {3, 4, 5}};
    EXPECT_EQ(sdf::find_border_edges({pair.positions, pair.triangles}), (std::vector<std::uint8_t>{6, 5}));
}

TEST(BorderEdges, SheetsAreAsWideAsTheirTriangles) {
    // The shell reaches half a voxel beyond the border; rays that pass there must miss as on triangles.
    const core::Scene scene = scene_of(moved(quad(1.0f, 1.0f, 3, 3), rotation(0.4, {1, 2, 3})));
    sdf::BakeSettings settings;
    settings.resolution = 24;
    const sdf::SdfTracer tracer(scene, sdf::grids_by_mesh(scene, sdf::bake_scene(scene, settings, {})));
    const glm::dmat3 turn(rotation(0.4, {1, 2, 3}));
    TestRandom random(31);
    std::vector<core::Ray> rays;
    std::vector<bool> expected;
    while (rays.size() < 20'000) {
        const glm::dvec2 target(random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6));
        const glm::dvec3 direction = random.direction();
        if (std::abs(direction.z) < 0.1) continue;
        rays.push_back(make_ray(turn * (glm::dvec3(target, 0.0) - 2.0 * direction), turn * direction));
        expected.push_back(std::max(std::abs(target.x), std::abs(target.y)) < 0.5);
    }
    std::vector<std::uint8_t> occluded(rays.size());
    tracer.trace_occluded(stream_of(rays), occluded);
    int different = 0, beyond = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        different += (occluded[i] != 0) != expected[i];
        beyond += !expected[i];
    }
    EXPECT_GT(beyond, 1000);
    // Near a corner a ray may come in over one border and pass beyond another, out of the cell's sight.
    EXPECT_LE(different, 20);
}

}  // namespace
}  // namespace tests
