// tests/cli/bake_command_test.cpp: bake, and inspect of what it wrote, as typed.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/inspect_vdb.h"
#include "cli/options.h"
#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

struct Outcome {
    int exit_code = 0;
    std::string out, message;
};

Outcome run(std::vector<std::string> arguments) {
    cli::Program program;
    CLI::App app;
    cli::add_bake_command(app, program);
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
    Outcome outcome;
    testing::internal::CaptureStdout();
    try {
        app.parse(reversed);
        outcome.exit_code = program.exit_code;
    } catch (const CLI::ParseError& error) {
        outcome.exit_code = 64;
        outcome.message = error.what();
    } catch (const core::InputError& error) {
        outcome.exit_code = static_cast<int>(error.kind());
        outcome.message = error.what();
    }
    std::fflush(stdout);
    outcome.out = testing::internal::GetCapturedStdout();
    return outcome;
}

const std::string kScene = (tests::assets_folder() / "cornell_box.glb").string();

TEST(BakeCommand, WritesOneFileAMeshAndReportsEveryKey) {
    const tests::TemporaryFolder folder;
    const std::vector<std::string> arguments = {"bake",   kScene,    "-o",           folder.path().string(),
                                                "--json", "--quiet", "--resolution", "24"};
    const Outcome first = run(arguments);
    ASSERT_EQ(first.exit_code, 0) << first.message;
    const nlohmann::json report = nlohmann::json::parse(first.out);
    EXPECT_EQ(report["schema"], 1);
    EXPECT_GE(report["seconds"].get<double>(), 0.0);
    ASSERT_FALSE(report["meshes"].empty());
    for (const nlohmann::json& mesh : report["meshes"]) {
        EXPECT_GT(mesh["triangles"].get<int>(), 0);
        const std::string surface = mesh["class"];
        EXPECT_TRUE(surface == "solid" || surface == "sheet" || surface == "mixed") << surface;
        EXPECT_GT(mesh["voxel"].get<double>(), 0.0);
        EXPECT_EQ(mesh["bytes"].get<std::uintmax_t>(), fs::file_size(mesh["file"].get<std::string>()));
        EXPECT_LE(mesh["error_voxels"]["mean"].get<double>(), mesh["error_voxels"]["max"].get<double>());
        EXPECT_LE(mesh["error_field_voxels"]["mean"].get<double>(),
                  mesh["error_field_voxels"]["p99"].get<double>());
        EXPECT_LE(mesh["error_field_voxels"]["p99"].get<double>(),
                  mesh["error_field_voxels"]["max"].get<double>());
        EXPECT_EQ(mesh["sign_mismatches"]["wrong"], 0);
        if (surface == "sheet") {
            EXPECT_EQ(mesh["sign_mismatches"]["samples"], 0);
        }
        EXPECT_GT(mesh["memory_bytes"].get<int>(), 0);
        EXPECT_EQ(mesh["dropped_faces"], 0);
        EXPECT_TRUE(mesh["warnings"].is_array());
        EXPECT_FALSE(mesh["reused"].get<bool>());

        const nlohmann::json inspected = cli::inspect_vdb(mesh["file"].get<std::string>());
        ASSERT_EQ(inspected["grids"].size(), 2u);
        EXPECT_EQ(inspected["grids"][0]["voxel"], mesh["voxel"]);
        EXPECT_EQ(inspected["grids"][0]["nan_samples"], 0);
        EXPECT_EQ(inspected["grids"][0]["metadata"]["fieldlight_class"], surface);
        EXPECT_GT(inspected["grids"][0]["active_voxels"].get<int>(), 0);
        const nlohmann::json& metadata = inspected["grids"][0]["metadata"];
        EXPECT_NEAR(std::stod(metadata["fieldlight_error_field_voxels_p99"].get<std::string>()),
                    mesh["error_field_voxels"]["p99"].get<double>(), 1e-5);
        EXPECT_EQ(metadata["fieldlight_sign_samples"],
                  std::to_string(mesh["sign_mismatches"]["samples"].get<int>()));
        EXPECT_EQ(metadata["fieldlight_sign_mismatches"], "0");
    }
    const nlohmann::json again = nlohmann::json::parse(run(arguments).out);
    for (const nlohmann::json& mesh : again["meshes"]) EXPECT_TRUE(mesh["reused"].get<bool>());
}

TEST(BakeCommand, WrongFlagsAreRefused) {
    const tests::TemporaryFolder folder;
    const std::string out = folder.path().string();
    EXPECT_EQ(run({"bake", kScene}).exit_code, 64);
    EXPECT_EQ(run({"bake", kScene, "-o", out, "--resolution", "0"}).exit_code, 64);
    EXPECT_EQ(run({"bake", kScene, "-o", out, "--resolution", "9", "--voxel", "1"}).exit_code, 64);
    EXPECT_EQ(run({"bake", kScene, "-o", out, "--class", "gas"}).exit_code, 64);
    EXPECT_EQ(run({"bake", kScene, "-o", out, "--quiet", "--mesh", "nowhere"}).exit_code, 64);
}

}  // namespace
