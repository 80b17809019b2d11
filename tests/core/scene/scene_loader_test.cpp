#include "core/scene/scene_loader.h"

#include <gtest/gtest.h>

#include "core/scene/obj_file.h"
#include "core/scene/ply_file.h"
#include "core/scene/stl_file.h"
#include "tests/core/scene/gltf_builder.h"
#include "tests/core/scene/mesh_text.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

std::string cube_gltf() {
    tests::GltfBuilder builder;
    std::vector<float> positions;
    std::vector<std::uint16_t> indices;
    for (const auto& p : tests::kCubeCorners) {
        for (const int coordinate : p) positions.push_back(static_cast<float>(coordinate));
    }
    for (const auto& f : tests::kCubeFaces) {
        for (const int corner : {f[0], f[1], f[2], f[0], f[2], f[3]}) {
            indices.push_back(static_cast<std::uint16_t>(corner));
        }
    }
    const int position = builder.add_floats("VEC3", positions);
    const int index = builder.add_indices(indices);
    builder.add("nodes",
                fmt::format(R"({{"mesh":{}}})",
                            builder.add_mesh(fmt::format(R"({{"attributes":{{"POSITION":{}}},"indices":{}}})",
                                                         position, index))));
    return builder.json();
}

std::vector<std::pair<std::string, std::string>> cubes() {
    return {{"cube.gltf", cube_gltf()},
            {"cube.obj", tests::cube_obj()},
            {"text.ply", tests::cube_ply_text()},
            {"little.ply", tests::cube_ply_binary(false)},
            {"big.ply", tests::cube_ply_binary(true)},
            {"text.stl", tests::cube_stl_text()},
            {"binary.STL", tests::cube_stl_binary("solid")}};
}

std::string error(const fs::path& path, const core::LoadOptions& options = {}) {
    return tests::input_error_of([&] { core::load_scene_file(path, options); });
}

TEST(SceneLoader, ACubeIsTheSameInEveryFormat) {
    const tests::TemporaryFolder folder;
    std::vector<tests::Triangle> expected;
    for (const auto& [name, contents] : cubes()) {
        tests::write_text(folder.path() / name, contents);
        const core::Scene scene = core::load_scene_file(folder.path() / name);
        const std::vector<tests::Triangle> triangles = tests::triangles_of(scene);
        if (expected.empty()) expected = triangles;
        EXPECT_EQ(triangles.size(), 12u) << name;
        EXPECT_EQ(triangles, expected) << name;
        EXPECT_EQ(scene.name, name);
        ASSERT_EQ(scene.meshes.size(), 1u) << name;
        EXPECT_EQ(scene.meshes[0].positions.size(), 36u) << name << ": flat faces share no vertex";
        EXPECT_TRUE(tests::is_consistent(scene)) << name;
        const core::DoubleBounds bounds = core::world_bounds(scene);
        EXPECT_EQ(bounds.minimum, glm::dvec3(0.0)) << name;
        EXPECT_EQ(bounds.maximum, glm::dvec3(1.0)) << name;
    }
}

TEST(SceneLoader, EndingsAreKnownInAnyCase) {
    for (const char* name : {"a.gltf", "a.GLB", "b/c.obj", "a.Ply", "a.b.STL"}) {
        EXPECT_TRUE(core::is_scene_file(name)) << name;
        EXPECT_NE(error(name).find("(kind 66)"), std::string::npos) << error(name);
    }
    for (const char* name : {"a.fbx", "a", "", "a.obj.gz", ".obj", "obj", "a.exr"}) {
        EXPECT_FALSE(core::is_scene_file(name)) << name;
        EXPECT_NE(error(name).find("end in .gltf, .glb, .obj, .ply or .stl (kind 64)"), std::string::npos)
            << error(name);
    }
}

TEST(SceneLoader, ContentsOfAnotherEndingAreNamed) {
    const tests::TemporaryFolder folder;
    tests::write_text(folder.path() / "a.obj", tests::cube_ply_text());
    EXPECT_NE(error(folder.path() / "a.obj").find("holds .ply by its first bytes"), std::string::npos);
    tests::write_text(folder.path() / "a.stl", cube_gltf());
    EXPECT_NE(error(folder.path() / "a.stl").find("holds .gltf by its first bytes"), std::string::npos);
    fs::create_directories(folder.path() / "folder.obj");
    EXPECT_NE(error(folder.path() / "folder.obj").find("not a regular file"), std::string::npos);
}

TEST(SceneLoader, OnlyGltfHasScenesToChooseFrom) {
    const tests::TemporaryFolder folder;
    tests::write_text(folder.path() / "a.obj", tests::cube_obj());
    EXPECT_NE(
        error(folder.path() / "a.obj", {.scene = "1"}).find("only glTF files hold several scenes (kind 64)"),
        std::string::npos);
}

/// Reads what may be damaged: a consistent scene or an InputError that names the file, and nothing else.
void read_damaged(const std::string& name, const std::string& contents, const std::string& what) {
    const std::vector<std::uint8_t> bytes = tests::bytes_of(contents);
    try {
        const core::Scene scene = name.ends_with(".obj")   ? core::read_obj(bytes, name, {})
                                  : name.ends_with(".ply") ? core::read_ply(bytes, name)
                                                           : core::read_stl(bytes, name);
        EXPECT_TRUE(tests::is_consistent(scene)) << name << " " << what;
    } catch (const core::InputError& error) {
        EXPECT_NE(std::string(error.what()).find("'" + name + "'"), std::string::npos) << error.what();
    }
}

TEST(SceneLoader, FilesCutAnywhereAreReadOrRefused) {
    for (const auto& [name, contents] : cubes()) {
        if (name == "cube.gltf") continue;
        for (std::size_t size = 0; size < contents.size(); ++size) {
            read_damaged(name, contents.substr(0, size), fmt::format("cut to {} bytes", size));
        }
    }
}

TEST(SceneLoader, FilesWithAnyByteChangedAreReadOrRefused) {
    for (const auto& [name, contents] : cubes()) {
        if (name == "cube.gltf") continue;
        for (std::size_t i = 0; i < contents.size(); ++i) {
            for (const char byte : {'\0', '\n', ' ', '-', '9', '\\', '/', '\x7f', '\xff'}) {
                std::string damaged = contents;
                damaged[i] = byte;
                read_damaged(name, damaged, fmt::format("with byte {} set to {}", i, static_cast<int>(byte)));
            }
        }
    }
}

}  // namespace
