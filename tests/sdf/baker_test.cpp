#include "sdf/baker.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>

#include "tests/sdf/baked_shapes.h"
#include "tests/support/shared_data.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

core::Scene two_meshes() {
    core::Scene scene = scene_of(icosphere(2));
    scene.name = "two.glb";
    scene.meshes[0].name = "ball";
    add_instance(scene, add_mesh(scene, box()), translation({3, 0, 0}));
    scene.meshes[1].name = "odd/name: %";
    return scene;
}

TEST(Baker, ReusesWhatFitsAndOnlyThat) {
    const TemporaryFolder folder;
    core::Scene scene = two_meshes();
    sdf::BakeSettings settings;
    settings.resolution = 16;
    const auto reused = [&] {
        const sdf::BakeResult result = sdf::bake_scene(scene, settings, folder.path());
        EXPECT_EQ(result.meshes.size(), 2u);
        std::string pattern;
        for (const sdf::MeshBake& mesh : result.meshes) {
            EXPECT_TRUE(mesh.grid);
            EXPECT_TRUE(fs::exists(mesh.file)) << mesh.file;
            EXPECT_EQ(mesh.file.parent_path(), folder.path());
            EXPECT_EQ(mesh.file_bytes, fs::file_size(mesh.file));
            pattern += mesh.reused ? 'r' : 'b';
        }
        return pattern;
    };
    EXPECT_EQ(reused(), "bb");
    EXPECT_EQ(reused(), "rr");
    scene.meshes[0].positions[0].x += 1e-4f;
    EXPECT_EQ(reused(), "br");
    settings.resolution = 17;
    EXPECT_EQ(reused(), "bb");
    settings.surface_class = sdf::ClassOverride::kSheet;
    EXPECT_EQ(reused(), "bb");
    settings.force = true;
    EXPECT_EQ(reused(), "bb");
}

TEST(Baker, AReusedGridTracesLikeAFreshOne) {
    const TemporaryFolder folder;
    const core::Scene scene = two_meshes();
    sdf::BakeSettings settings;
    settings.resolution = 24;
    const sdf::BakeResult fresh = sdf::bake_scene(scene, settings, folder.path());
    const sdf::BakeResult again = sdf::bake_scene(scene, settings, folder.path());
    ASSERT_TRUE(again.meshes[0].reused);
    const sdf::BrickGrid &a = *fresh.meshes[0].grid, &b = *again.meshes[0].grid;
    ASSERT_EQ(a.block_count(), b.block_count());
    ASSERT_EQ(a.brick_count(), b.brick_count());
    EXPECT_EQ(a.origin(), b.origin());
    for (std::size_t i = 0; i < a.brick_count(); ++i) {
        const sdf::Brick &x = a.brick_at(std::int32_t(i)), &y = b.brick_at(std::int32_t(i));
        ASSERT_EQ(std::memcmp(&x, &y, sizeof(sdf::Brick)), 0);
    }
}

TEST(Baker, ADamagedBakeIsReplacedAndSaid) {
    const TemporaryFolder folder;
    const core::Scene scene = two_meshes();
    sdf::BakeSettings settings;
    settings.resolution = 16;
    const fs::path file = sdf::bake_scene(scene, settings, folder.path()).meshes[0].file;
    const std::string bytes = bytes_of(file);
    std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size() / 2));
    const sdf::MeshBake mended = sdf::bake_scene(scene, settings, folder.path()).meshes[0];
    EXPECT_FALSE(mended.reused);
    ASSERT_EQ(mended.warnings.size(), 1u);
    EXPECT_NE(mended.warnings[0].find("of no use"), std::string::npos);
    EXPECT_TRUE(bytes == bytes_of(file));
}

TEST(Baker, AMeshThatCannotBeBakedFailsAloneAndByName) {
    core::Scene scene = two_meshes();
    for (glm::vec3& p : scene.meshes[0].positions) p.y = p.z = 0.0f;
    const TemporaryFolder folder;
    const sdf::BakeResult result = sdf::bake_scene(scene, {}, folder.path());
    ASSERT_TRUE(result.meshes[0].error);
    EXPECT_FALSE(result.meshes[0].grid);
    EXPECT_NE(std::string(result.meshes[0].error->what()).find("'two.glb': mesh 'ball'"), std::string::npos)
        << result.meshes[0].error->what();
    EXPECT_TRUE(result.meshes[1].grid);
    const auto grids = sdf::grids_by_mesh(scene, result);
    EXPECT_FALSE(grids[0]);
    EXPECT_TRUE(grids[1]);
}

TEST(Baker, VoxelsInWorldUnitsFollowTheLargestScale) {
    core::Scene scene = scene_of(box());
    add_instance(scene, 0, rotation(0.3, {1, 1, 0}) * scaling({1.0, -4.0, 2.0}));
    sdf::BakeSettings settings;
    settings.voxel_world = 0.2;
    // The rotation leaves the largest singular value at 4, but for rounding.
    EXPECT_NEAR(sdf::bake_scene(scene, settings, {}).meshes[0].info().voxel_size, 0.05, 1e-12);
}

TEST(Baker, LimitsMakeFieldsCoarserAndSaySo) {
    const core::Scene scene = scene_of(icosphere(3));
    sdf::BakeSettings settings;
    settings.voxel_world = 1e-3;
    settings.max_dimension = 40;
    const sdf::MeshBake clamped = sdf::bake_scene(scene, settings, {}).meshes[0];
    EXPECT_NEAR(clamped.info().voxel_size, 2.0 / 40, 1e-6);
    EXPECT_EQ(clamped.info().warnings.size(), 1u);

    settings = {};
    settings.resolution = 64;
    const std::size_t unlimited = sdf::bake_scene(scene, settings, {}).meshes[0].memory_bytes;
    settings.max_field_bytes = unlimited / 3;
    const sdf::MeshBake small = sdf::bake_scene(scene, settings, {}).meshes[0];
    EXPECT_LE(small.memory_bytes, settings.max_field_bytes);
    EXPECT_GT(small.memory_bytes, settings.max_field_bytes / 4);
    EXPECT_FALSE(small.info().warnings.empty());
}

TEST(Baker, WrongSettingsAreUsageErrors) {
    const core::Scene scene = scene_of(box());
    const auto refused = [&](const sdf::BakeSettings& settings) {
        try {
            static_cast<void>(sdf::bake_scene(scene, settings, {}));
            ADD_FAILURE() << "was accepted";
        } catch (const core::InputError& error) {
            EXPECT_EQ(error.kind(), core::ErrorKind::kUsage);
        }
    };
    sdf::BakeSettings settings;
    settings.resolution = 0;
    refused(settings);
    settings = {};
    settings.voxel_world = -1.0;
    refused(settings);
    settings = {};
    settings.only_mesh = "no such mesh";
    refused(settings);
}

}  // namespace
}  // namespace tests
