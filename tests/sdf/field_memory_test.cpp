#include "sdf/field_memory.h"

#include <gtest/gtest.h>

#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

/// What a tracer holds beside its fields: an instance and the tree over it.
constexpr std::size_t kBeside = 2'048;

struct Shape {
    const char* name;
    core::Mesh mesh;
};

std::vector<Shape> shapes() {
    return {{"ball", icosphere(5)},
            {"sheet", quad(1.0f, 1.0f, 20, 20)},
            {"thin plate", moved(box({0.5f, 0.5f, 0.002f}), rotation(0.4, {1, 2, 3}))}};
}

TEST(FieldMemory, IsWhatATracerHolds) {
    for (const Shape& shape : shapes()) {
        const core::Scene scene = scene_of(shape.mesh);
        const auto grid = grid_of(shape.mesh, 64);
        const std::size_t foreseen = sdf::field_memory(*grid, shape.mesh.triangles.size()).total();
        const std::size_t held = sdf::SdfTracer(scene, {grid}).bytes();
        EXPECT_GE(held, foreseen - 64) << shape.name;
        EXPECT_LE(held, foreseen + kBeside) << shape.name;
    }
}

TEST(FieldMemory, BoundsHoldInTheTracerAndAreSaid) {
    for (const Shape& shape : shapes()) {
        const core::Scene scene = scene_of(shape.mesh);
        sdf::BakeSettings settings;
        settings.resolution = 96;
        const sdf::MeshBake fine = sdf::bake_scene(scene, settings, {}).meshes[0];
        EXPECT_TRUE(fine.info().warnings.empty() ||
                    fine.info().warnings[0].find("--max-field-bytes") == std::string::npos);
        const std::size_t triangles = sdf::field_memory(*fine.grid, shape.mesh.triangles.size()).triangles;
        for (const std::size_t part : {2, 10}) {
            settings.max_field_bytes = triangles + (fine.memory_bytes - triangles) / part;
            const sdf::BakeResult result = sdf::bake_scene(scene, settings, {});
            const sdf::MeshBake& coarse = result.meshes[0];
            ASSERT_TRUE(coarse.grid) << shape.name;
            EXPECT_GT(coarse.info().voxel_size, fine.info().voxel_size);
            const sdf::SdfTracer tracer(scene, sdf::grids_by_mesh(scene, result));
            EXPECT_LE(tracer.bytes(), settings.max_field_bytes + kBeside) << shape.name;
            EXPECT_GT(tracer.bytes(), settings.max_field_bytes / 4) << shape.name << ": coarser than needed";
            ASSERT_FALSE(coarse.info().warnings.empty());
            const std::string& said = coarse.info().warnings[0];
            EXPECT_NE(said.find(std::to_string(fine.memory_bytes) + " bytes"), std::string::npos) << said;
            EXPECT_NE(said.find("--max-field-bytes allows " + std::to_string(settings.max_field_bytes)),
                      std::string::npos)
                << said;
        }
    }
}

TEST(FieldMemory, TrianglesThatTakeMoreThanTheBoundEndTheBakeOfTheirMeshAlone) {
    core::Scene scene = scene_of(icosphere(5));
    add_instance(scene, add_mesh(scene, box()));
    sdf::BakeSettings settings;
    settings.resolution = 8;
    settings.max_field_bytes = 300'000;
    const sdf::BakeResult result = sdf::bake_scene(scene, settings, {});
    ASSERT_TRUE(result.meshes[0].error);
    EXPECT_EQ(result.meshes[0].error->kind(), core::ErrorKind::kOutOfMemory);
    EXPECT_NE(std::string(result.meshes[0].error->what()).find("for its triangles"), std::string::npos)
        << result.meshes[0].error->what();
    EXPECT_TRUE(result.meshes[1].grid);
}

}  // namespace
}  // namespace tests
