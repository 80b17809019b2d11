// tests/cli/inspect_scene_test.cpp: inspect on scenes, as typed.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/options.h"
#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace {

/// What the verb prints on stdout.
std::string inspect(std::vector<std::string> arguments) {
    cli::Program program;
    CLI::App app;
    cli::add_inspect_command(app, program);
    arguments.insert(arguments.begin(), "inspect");
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
    testing::internal::CaptureStdout();
    try {
        app.parse(reversed);
    } catch (...) {
        testing::internal::GetCapturedStdout();
        throw;
    }
    return testing::internal::GetCapturedStdout();
}

TEST(InspectScene, CountsInstancesOfGpuInstancing) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/teapots_galore/TeapotsGalore.gltf");
    const auto json = nlohmann::json::parse(inspect({file.string(), "--json"}));
    EXPECT_EQ(json["schema"], 1);
    EXPECT_EQ(json["instances"], 1900);
    EXPECT_EQ(json["triangles"], 7656770);
    EXPECT_EQ(json["meshes"], 2);
    EXPECT_EQ(json["cameras"], 1);
    EXPECT_EQ(json["extensions"], nlohmann::json({"EXT_mesh_gpu_instancing"}));
}

TEST(InspectScene, GivesBoundsAndWarnings) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/glass_vase_flowers/GlassVaseFlowers.glb");
    const auto json = nlohmann::json::parse(inspect({file.string(), "--json"}));
    EXPECT_EQ(json["warnings"].size(), 2u);
    // The size that the scenes' README gives, to its four digits.
    const double expected[] = {0.2173, 0.2032, 0.1425};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(json["bounds"][1][axis].get<double>() - json["bounds"][0][axis].get<double>(),
                    expected[axis], 6e-5);
    }
}

TEST(InspectScene, WritesTextForAPerson) {
    FIELDLIGHT_NEED_SHARED(file, "scenes/multiple_scenes/MultipleScenes.gltf");
    EXPECT_NE(inspect({file.string()}).find("triangles   2\n"), std::string::npos);
    EXPECT_NE(inspect({file.string(), "--scene", "0"}).find("triangles   1\n"), std::string::npos);
}

TEST(InspectScene, RefusesFilesItDoesNotKnow) {
    EXPECT_THROW(inspect({"notes.txt"}), core::InputError);
    EXPECT_THROW(inspect({"absent.glb"}), core::InputError);
}

}  // namespace
