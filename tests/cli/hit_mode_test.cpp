// tests/cli/hit_mode_test.cpp: --hit-mode and --sample-bits: what they change, and where it is told.
#include <gtest/gtest.h>

#include <cmath>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/image/exr.h"
#include "tests/support/program_run.h"
#include "tests/support/shared_data.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

const std::string kScene = (assets_folder() / "instances.glb").string();

class HitModeFlag : public testing::Test {
protected:
    ProgramRun render(const std::string& name, std::vector<std::string> more) const {
        std::vector<std::string> arguments = {
            "render", kScene,         "-o",    (folder_.path() / name).string(),
            "--json", "--size",       "48x36", "--accumulate",
            "2",      "--resolution", "24",    "--aov",
            "Depth"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_program(arguments);
    }
    fs::path path(const std::string& name) const { return folder_.path() / name; }

private:
    TemporaryFolder folder_;
};

TEST_F(HitModeFlag, StandsInTheStatisticsAndInThePicture) {
    std::vector<std::vector<float>> depths;
    for (const std::string mode : {"eps", "secant", "cubic"}) {
        const ProgramRun run = render(mode + ".exr", {"--primary", "sdf", "--hit-mode", mode});
        ASSERT_EQ(run.exit_code, 0) << run.err;
        EXPECT_EQ(nlohmann::json::parse(run.out).at("hit_mode"), mode);
        const core::ExrFile picture = core::read_exr_file(path(mode + ".exr"));
        EXPECT_EQ(picture.info.attributes.at("hitMode"), mode);
        depths.push_back(*picture.image.find("Depth.Z"));
    }
    EXPECT_NE(depths[0], depths[2]);
    EXPECT_NE(depths[1], depths[2]);
}

TEST_F(HitModeFlag, IsCubicByDefaultAndNothingWhereNoFieldIsTraced) {
    const ProgramRun fields = render("fields.exr", {});
    ASSERT_EQ(fields.exit_code, 0) << fields.err;
    EXPECT_EQ(nlohmann::json::parse(fields.out).at("hit_mode"), "cubic");
    const ProgramRun triangles = render("triangles.exr", {"--tracer", "triangle"});
    ASSERT_EQ(triangles.exit_code, 0) << triangles.err;
    EXPECT_TRUE(nlohmann::json::parse(triangles.out).at("hit_mode").is_null());
    EXPECT_EQ(core::read_exr_file(path("triangles.exr")).info.attributes.count("hitMode"), 0u);
}

TEST_F(HitModeFlag, OtherNamesAreRefused) {
    const ProgramRun run = render("x.exr", {"--hit-mode", "sphere"});
    EXPECT_EQ(run.exit_code, 64);
    EXPECT_NE(run.err.find("--hit-mode"), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(path("x.exr")));
}

TEST_F(HitModeFlag, TheHelpSaysWhatModesCostAndGive) {
    for (const char* verb : {"render", "compare"}) {
        const std::string help = run_program({verb, "--help"}).out;
        EXPECT_NE(help.find("--hit-mode"), std::string::npos) << verb;
        EXPECT_NE(help.find("0.01 voxel"), std::string::npos) << verb;
    }
}

TEST_F(HitModeFlag, SamplesOfEightBitsGiveAnotherPictureOfTheSameScene) {
    const ProgramRun fine = render("fine.exr", {"--primary", "sdf"}),
                     coarse = render("coarse.exr", {"--primary", "sdf", "--sample-bits", "8"});
    ASSERT_EQ(fine.exit_code, 0) << fine.err;
    ASSERT_EQ(coarse.exit_code, 0) << coarse.err;
    EXPECT_EQ(nlohmann::json::parse(fine.out).at("sample_bits"), 16);
    EXPECT_EQ(nlohmann::json::parse(coarse.out).at("sample_bits"), 8);
    const core::ExrFile a = core::read_exr_file(path("fine.exr")),
                        b = core::read_exr_file(path("coarse.exr"));
    EXPECT_EQ(b.info.attributes.at("sampleBits"), "8");
    const std::vector<float>&depth_a = *a.image.find("Depth.Z"), &depth_b = *b.image.find("Depth.Z");
    ASSERT_EQ(depth_a.size(), depth_b.size());
    EXPECT_NE(depth_a, depth_b);
    std::size_t apart = 0;
    for (std::size_t i = 0; i < depth_a.size(); ++i) apart += !(std::abs(depth_a[i] - depth_b[i]) < 0.02f);
    EXPECT_LE(apart, depth_a.size() / 50);
    EXPECT_EQ(render("x.exr", {"--sample-bits", "12"}).exit_code, 64);
}

TEST_F(HitModeFlag, IsOneOfComparisonsSettings) {
    const ProgramRun run = run_program({"compare", kScene, "-o", path("out").string(), "--json", "--size",
                                        "32x24", "--resolutions", "16", "--max-spp", "1", "--reference-spp",
                                        "8", "--hit-mode", "secant"});
    ASSERT_LE(run.exit_code, 1) << run.err;
    const nlohmann::json report = nlohmann::json::parse(run.out);
    EXPECT_TRUE(report.at("series").at(0).at("settings").at("hit_mode").is_null());
    EXPECT_EQ(report.at("series").at(1).at("settings").at("hit_mode"), "secant");
    const std::string command = report.at("series").at(1).at("points").at(0).at("command");
    EXPECT_NE(command.find("--hit-mode secant"), std::string::npos) << command;
    EXPECT_EQ(run_program({"compare", "a.exr", "b.exr", "--hit-mode", "eps"}).exit_code, 64);
}

}  // namespace
}  // namespace tests
