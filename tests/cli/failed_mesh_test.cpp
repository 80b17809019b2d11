// tests/cli/failed_mesh_test.cpp: a mesh that cannot be baked fails alone and by name.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "tests/support/program_run.h"
#include "tests/support/shared_data.h"

namespace tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A cube, and before it a mesh that cannot be baked.
constexpr const char* kBlock =
    "o block\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "f -5 -6 -7 -8\nf -4 -3 -2 -1\nf -8 -7 -3 -4\nf -6 -5 -1 -2\nf -7 -6 -2 -3\nf -5 -8 -4 -1\n";
/// All its points on a line.
constexpr const char* kThread = "o thread\nv 2 0 0\nv 3 0 0\nv 4 0 0\nf -3 -2 -1\n";

/// More triangles than the bytes below.
std::string fine_ball() {
    constexpr int kRows = 60, kColumns = 60;
    std::string text = "o ball\n";
    for (int row = 0; row <= kRows; ++row) {
        for (int column = 0; column < kColumns; ++column) {
            const double v = std::numbers::pi * (row + 0.01) / (kRows + 0.02);
            const double u = 2.0 * std::numbers::pi * column / kColumns;
            text += "v " + std::to_string(std::sin(v) * std::cos(u)) + " " + std::to_string(std::cos(v)) +
                    " " + std::to_string(std::sin(v) * std::sin(u)) + "\n";
        }
    }
    for (int row = 0; row < kRows; ++row) {
        for (int column = 0; column < kColumns; ++column) {
            const auto vertex = [&](int r, int c) { return std::to_string(r * kColumns + c % kColumns + 1); };
            text += "f " + vertex(row, column) + " " + vertex(row, column + 1) + " " +
                    vertex(row + 1, column + 1) + " " + vertex(row + 1, column) + "\n";
        }
    }
    return text;
}
constexpr const char* kBytes = "150000";

class FailedMesh : public testing::Test {
protected:
    ProgramRun run(const std::string& scene, std::vector<std::string> arguments) const {
        std::ofstream(folder_.path() / "scene.obj") << scene;
        return run_program(arguments, {.folder = folder_.path()});
    }
    bool exists(const std::string& name) const { return fs::exists(folder_.path() / name); }

private:
    TemporaryFolder folder_;
};

/// The objects of `bake --json` by the name of their mesh.
std::map<std::string, json> meshes_of(const ProgramRun& run) {
    std::map<std::string, json> meshes;
    const json report = json::parse(run.out);
    for (const json& mesh : report.at("meshes")) meshes[mesh.at("name").get<std::string>()] = mesh;
    return meshes;
}

TEST_F(FailedMesh, EndsABakeWithItsCodeOnceAllOthersAreBaked) {
    const std::string scene = std::string(kThread) + kBlock;
    const ProgramRun outcome = run(scene, {"bake", "scene.obj", "-o", "out", "--json", "--resolution", "8"});
    EXPECT_EQ(outcome.exit_code, 65) << outcome.err;
    EXPECT_NE(outcome.err.find("'scene.obj': mesh 'thread': none of its 1 faces can be baked"),
              std::string::npos)
        << outcome.err;
    const auto meshes = meshes_of(outcome);
    EXPECT_TRUE(meshes.at("thread").contains("error"));
    EXPECT_TRUE(exists(meshes.at("block").at("file")));
}

TEST_F(FailedMesh, ThatFitsNoBoundEndsABakeWith71OnceAllOthersAreBaked) {
    const ProgramRun outcome = run(fine_ball() + kBlock, {"bake", "scene.obj", "-o", "out", "--json",
                                                          "--resolution", "8", "--max-field-bytes", kBytes});
    EXPECT_EQ(outcome.exit_code, 71) << outcome.err;
    EXPECT_NE(outcome.err.find("'scene.obj': mesh 'ball': its field takes"), std::string::npos)
        << outcome.err;
    const auto meshes = meshes_of(outcome);
    EXPECT_TRUE(meshes.at("ball").contains("error"));
    ASSERT_TRUE(exists(meshes.at("block").at("file")));
    EXPECT_LE(meshes.at("block").at("memory_bytes"), 150'000);
}

TEST_F(FailedMesh, IsSaidToBeMissingFromAPicture) {
    const std::string scene = std::string(kThread) + kBlock;
    const ProgramRun outcome = run(scene, {"render", "scene.obj", "-o", "x.exr", "--size", "16x12",
                                           "--accumulate", "1", "--resolution", "8", "--json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("mesh 'thread': none of its 1 faces can be baked"), std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.err.find("it is missing from everything traced through fields"), std::string::npos);
    EXPECT_EQ(json::parse(outcome.out).at("missing_meshes"), json::array({"thread"}));
    EXPECT_TRUE(exists("x.exr"));
}

TEST_F(FailedMesh, ThatMemoryHasNoRoomForMakesNoPicture) {
    const ProgramRun outcome =
        run(fine_ball() + kBlock, {"render", "scene.obj", "-o", "x.exr", "--size", "16x12", "--accumulate",
                                   "1", "--resolution", "8", "--max-field-bytes", kBytes});
    EXPECT_EQ(outcome.exit_code, 71) << outcome.err;
    EXPECT_NE(outcome.err.find("mesh 'ball'"), std::string::npos) << outcome.err;
    EXPECT_FALSE(exists("x.exr"));
}

TEST_F(FailedMesh, FieldsOfAPictureKeepTheirBound) {
    const std::vector<std::string> arguments = {"render",       "scene.obj", "-o",           "x.exr",
                                                "--size",       "16x12",     "--accumulate", "1",
                                                "--resolution", "64",        "--json"};
    const auto sdf_bytes = [](const ProgramRun& outcome) {
        EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
        return json::parse(outcome.out).at("memory").at("sdf_bytes").get<std::uint64_t>();
    };
    EXPECT_GT(sdf_bytes(run(kBlock, arguments)), 1'000'000u);
    std::vector<std::string> bounded = arguments;
    bounded.insert(bounded.end(), {"--max-field-bytes", "1000000"});
    const ProgramRun outcome = run(kBlock, bounded);
    // The instance and the tree over it come to that.
    EXPECT_LE(sdf_bytes(outcome), 1'002'048u);
    EXPECT_NE(outcome.err.find("--max-field-bytes allows 1000000; a voxel of"), std::string::npos)
        << outcome.err;
}

}  // namespace
}  // namespace tests
