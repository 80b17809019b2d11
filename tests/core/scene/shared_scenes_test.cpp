#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>

#include "core/scene/gltf_loader.h"
#include "core/scene/tangent_space.h"
#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace {

struct ExpectedScene {
    const char* file;
    std::uint64_t triangles;
    std::size_t instances;
};

/// The columns `tris` and `inst` of the shared scenes' own README.
constexpr ExpectedScene kExpected[] = {
    {"cornell_bevy/CornellBox.glb", 36, 4},
    {"zdm2_level/zdm2.glb", 58772, 1},
    {"living_room_godot/living_room.glb", 5088, 2},
    {"studio_babylon/studio.gltf", 18514, 25},
    {"emissive_strength_test/EmissiveStrengthTest.glb", 90, 6},
    {"lights_punctual_lamp/LightsPunctualLamp.gltf", 6000, 3},
    {"mixed_lighting_bevy/MixedLightingExample.gltf", 40898, 6},
    {"irradiance_volume_bevy/IrradianceVolumeExample.glb", 32, 1},
    {"teapots_galore/TeapotsGalore.gltf", 7656770, 1900},
    {"retro_ufo/retroufo.glb", 16428, 77},
    {"cesium_milk_truck/CesiumMilkTruck.glb", 3624, 3},
    {"box_animated/BoxAnimated.glb", 254, 2},
    {"interpolation_test/InterpolationTest.glb", 110, 10},
    {"volumetric_fog_room_bevy/VolumetricFogExample.glb", 360, 1},
    {"sheen_cloth/SheenCloth.gltf", 115200, 1},
    {"flight_helmet/FlightHelmet.gltf", 94722, 6},
    {"suzanne/Suzanne.gltf", 3936, 1},
    {"negative_scale_test/NegativeScaleTest.glb", 7724, 11},
    {"orientation_test/OrientationTest.glb", 524, 13},
    {"metal_rough_spheres_notex/MetalRoughSpheresNoTextures.glb", 1040409, 102},
    {"toy_car/ToyCar.gltf", 108936, 3},
    {"glass_vase_flowers/GlassVaseFlowers.glb", 14036, 4},
    {"alpha_blend_mode_test/AlphaBlendModeTest.glb", 61, 9},
    {"scallop/scallop.glb", 120000, 1},
    {"menger_sponge3/mengerSponge3.glb", 21598, 1},
    {"box_not_manifold/boxNotManifold.glb", 12, 1},
    {"self_intersect_a/self_intersectA.glb", 17160, 1},
    {"hourglass_nonmanifold_vertex/hourglass_ico.glb", 40, 1},
    {"fan3_nonmanifold_edge/fan3.glb", 3, 1},
    {"dutch_ship_medium/dutch_ship_medium_1k.gltf", 69162, 3},
    {"tree_godot/scene.gltf", 778, 2},
    {"vertex_color_test/VertexColorTest.glb", 36, 2},
    {"texture_transform_multi/TextureTransformMultiTest.glb", 3956, 29},
    {"texture_settings_test/TextureSettingsTest.glb", 72, 10},
    {"mesh_primitive_modes/MeshPrimitiveModes.gltf", 16, 7},
    {"simple_sparse_accessor/SimpleSparseAccessor.gltf", 12, 1},
    {"box_interleaved/BoxInterleaved.glb", 12, 1},
    {"box_with_spaces/Box With Spaces.gltf", 12, 1},
    {"multiple_scenes/MultipleScenes.gltf", 2, 1},
    {"recursive_skeletons/RecursiveSkeletons.glb", 6384, 84},
    {"unsupported/heart_draco/heart_draco.glb", 180, 1},
    {"unsupported/box_meshopt/BoxMeshopt.glb", 12, 1},
    {"unsupported/morph_cube_quantized/AnimatedMorphCube.gltf", 12, 1},
};

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// What core::Scene promises of a mesh.
void expect_valid(const core::Mesh& mesh) {
    const std::size_t vertex_count = mesh.positions.size();
    ASSERT_EQ(mesh.normals.size(), vertex_count);
    ASSERT_TRUE(mesh.tangents.empty() || mesh.tangents.size() == vertex_count);
    for (const auto& uvs : mesh.uvs) ASSERT_TRUE(uvs.empty() || uvs.size() == vertex_count);
    ASSERT_TRUE(mesh.colors.empty() || mesh.colors.size() == vertex_count);
    ASSERT_EQ(mesh.part_of_triangle.size(), mesh.triangles.size());
    std::size_t bad = 0;
    for (const glm::uvec3& triangle : mesh.triangles) {
        for (int corner = 0; corner < 3; ++corner) bad += triangle[corner] >= vertex_count;
    }
    // 1e-5: normalised in double, stored in float.
    for (const glm::vec3& normal : mesh.normals) bad += !(std::abs(glm::length(normal) - 1.0f) < 1e-5f);
    for (const glm::vec4& tangent : mesh.tangents) {
        bad += !(std::abs(glm::length(glm::vec3(tangent)) - 1.0f) < 1e-5f) || std::abs(tangent.w) != 1.0f;
    }
    EXPECT_EQ(bad, 0u) << mesh.name;
}

TEST(SharedScenes, LoadWithTheTrianglesAndInstancesOfTheirReadme) {
    FIELDLIGHT_NEED_SHARED(scenes, "scenes");
    for (const ExpectedScene& expected : kExpected) {
        SCOPED_TRACE(expected.file);
        const core::Scene scene = core::load_gltf(scenes / expected.file);
        EXPECT_EQ(core::drawn_triangle_count(scene), expected.triangles);
        EXPECT_EQ(scene.instances.size(), expected.instances);
        for (const core::Mesh& mesh : scene.meshes) expect_valid(mesh);
        for (const core::Instance& instance : scene.instances) {
            ASSERT_LT(instance.mesh, scene.meshes.size());
            ASSERT_EQ(instance.materials.size(), scene.meshes[instance.mesh].parts.size());
            for (const std::uint32_t material : instance.materials)
                ASSERT_LT(material, scene.materials.size());
        }
    }
}

TEST(SharedScenes, OfOneHundredAndTwoSpheresHaveFiveMeshes) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/metal_rough_spheres_notex/MetalRoughSpheresNoTextures.glb");
    EXPECT_EQ(core::load_gltf(file).meshes.size(), 5u);
}

TEST(SharedScenes, NameTheSkippedPointsAndLines) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/mesh_primitive_modes/MeshPrimitiveModes.gltf");
    const core::Scene scene = core::load_gltf(file);
    ASSERT_EQ(scene.warnings.size(), 4u);
    EXPECT_NE(scene.warnings[0].find("'mesh with POINTS' primitive 0 has mode POINTS"), std::string::npos);
}

TEST(SharedScenes, ChooseAmongSeveralScenesByNumber) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/multiple_scenes/MultipleScenes.gltf");
    EXPECT_EQ(core::drawn_triangle_count(core::load_gltf(file, {.scene = "0"})), 1u);
    EXPECT_EQ(core::drawn_triangle_count(core::load_gltf(file, {.scene = "1"})), 2u);
    EXPECT_THROW(core::load_gltf(file, {.scene = "2"}), core::InputError);
}

TEST(SharedScenes, WarnThatSkinsAreIgnored) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/recursive_skeletons/RecursiveSkeletons.glb");
    const core::Scene scene = core::load_gltf(file);
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("skins are ignored"), std::string::npos);
}

TEST(SharedScenes, KeepEightCamerasAndFiveLights) {
    FIELDLIGHT_NEED_SHARED(scenes, "scenes");
    EXPECT_EQ(core::load_gltf(scenes / "toy_car/ToyCar.gltf").cameras.size(), 8u);
    EXPECT_EQ(core::load_gltf(scenes / "lights_punctual_lamp/LightsPunctualLamp.gltf").lights.size(), 5u);
}

/// The asset shows one picture twice: through a turned texture transform, and through plain coordinates
/// ("Sample"), which the transform must land on.
TEST(SharedScenes, TurnTextureCoordinatesOntoTheSample) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/texture_transform_multi/TextureTransformMultiTest.glb");
    const core::Scene scene = core::load_gltf(file);
    const auto corners = [&](const std::string& mesh_name) {
        std::vector<glm::vec2> result;
        for (const core::Instance& instance : scene.instances) {
            const core::Mesh& mesh = scene.meshes[instance.mesh];
            if (mesh.name != mesh_name) continue;
            const core::TextureUse& use = scene.materials[instance.materials[0]].base_color_texture;
            for (const glm::vec2& uv : mesh.uvs[static_cast<std::size_t>(use.uv_set)]) {
                result.push_back(use.uv_from_mesh_uv * glm::vec3(uv, 1.0f));
            }
        }
        return result;
    };
    const std::vector<glm::vec2> sample = corners("BaseColorSample");
    const std::vector<glm::vec2> turned = corners("BaseColorUV0");
    ASSERT_EQ(sample.size(), 4u);
    ASSERT_EQ(turned.size(), 4u);
    // The asset's author aligned the two by hand, to 3 of 512 texels.
    for (std::size_t i = 0; i < 4; ++i) EXPECT_LT(glm::length(sample[i] - turned[i]), 0.01f);
}

/// Files with TANGENT made by other programs (MikkTSpace): ours must agree. Both average over faces; ours
/// does not ask for shared edges, and the files' are rounded.
TEST(SharedScenes, TangentsAgreeWithThoseThatFilesBring) {
    FIELDLIGHT_NEED_SHARED(scenes, "scenes");
    for (const char* file : {"flight_helmet/FlightHelmet.gltf", "sheen_cloth/SheenCloth.gltf",
                             "lights_punctual_lamp/LightsPunctualLamp.gltf"}) {
        const core::Scene scene = core::load_gltf(scenes / file);
        std::size_t corner_count = 0;
        std::size_t agreeing = 0;
        for (const core::Mesh& mesh : scene.meshes) {
            if (mesh.tangents.empty()) continue;
            const auto corners =
                core::corner_tangents(mesh.positions, mesh.normals, mesh.uvs[0], mesh.triangles);
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
                for (int c = 0; c < 3; ++c) {
                    const glm::vec4& brought = mesh.tangents[mesh.triangles[t][c]];
                    const glm::vec4& made = corners[3 * t + static_cast<std::size_t>(c)];
                    ++corner_count;
                    // cos 10 degrees.
                    agreeing += brought.w == made.w && glm::dot(glm::vec3(brought), glm::vec3(made)) > 0.985f;
                }
            }
        }
        ASSERT_GT(corner_count, 1000u);
        EXPECT_GT(static_cast<double>(agreeing) / static_cast<double>(corner_count), 0.97) << file;
    }
}

TEST(SharedScenes, InvalidFilesLoadOrAreRefusedQuickly) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/invalid");
    int loaded = 0;
    int refused = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".gltf" && extension != ".glb") continue;
        const auto start = std::chrono::steady_clock::now();
        try {
            const core::Scene scene = core::load_gltf(entry.path());
            for (const core::Mesh& mesh : scene.meshes) expect_valid(mesh);
            core::scene_hash(scene);
            ++loaded;
        } catch (const core::InputError& error) {
            EXPECT_NE(std::string(error.what()).find(entry.path().filename().string()), std::string::npos)
                << error.what();
            ++refused;
        }
        EXPECT_LT(seconds_since(start), 2.0) << entry.path();
    }
    EXPECT_EQ(loaded + refused, 169);
}

TEST(SharedScenes, BrokenFilesAreRefusedByName) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/invalid");
    for (const char* file :
         {"assimp/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb",
          "assimp/IndexOutOfRange/IndexOutOfRange.gltf", "assimp/IndexOutOfRange/AllIndicesOutOfRange.gltf",
          "assimp/MissingBin/BoxTextured.gltf", "assimp/RecursiveNodes/RecursiveNodes.gltf",
          "assimp/wrongTypes/badUint.gltf", "khronos_validator/base/node/node_loop.gltf",
          "khronos_validator/base/node/node_loop_scene.gltf", "khronos_validator/base/glb/chunk_too_big.glb",
          "khronos_validator/base/glb/unknown_chunk.glb"}) {
        if (!std::filesystem::exists(folder / file)) {
            ADD_FAILURE() << file << " is missing";
            continue;
        }
        EXPECT_THROW(core::load_gltf(folder / file), core::InputError) << file;
    }
}

/// The column `size` of the README, to its four decimals.
TEST(SharedScenes, CompressedFilesHaveTheSizeOfTheirReadme) {
    FIELDLIGHT_NEED_SHARED(scenes, "scenes/unsupported");
    const std::pair<const char*, glm::dvec3> expected[] = {
        {"heart_draco/heart_draco.glb", {0.0803, 0.0672, 0.0396}},
        {"box_meshopt/BoxMeshopt.glb", {1.0, 1.0, 1.0}}};
    for (const auto& [file, size] : expected) {
        const glm::dvec3 extent = core::world_bounds(core::load_gltf(scenes / file)).extent();
        // Half of the last decimal, and half a step of 14 bits at either end.
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(extent[axis], size[axis], 1.2e-4) << file;
    }
}

TEST(SharedScenes, QuantisedMeshesAreRead) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/unsupported/morph_cube_quantized/AnimatedMorphCube.gltf");
    const core::Scene scene = core::load_gltf(file);
    EXPECT_EQ(core::drawn_triangle_count(scene), 12u);
    // Its README gives a box of 2 x 2 x 2; int16 steps are 2 / 65534.
    const glm::dvec3 extent = core::world_bounds(scene).extent();
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(extent[axis], 2.0, 1e-4);
}

}  // namespace
