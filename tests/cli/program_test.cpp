// The program as a person or a script meets it: exit codes, messages, files.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "core/image/exr.h"
#include "tests/support/shared_data.h"

namespace {

struct Outcome {
    int exit_code = -1;
    std::string text;  ///< stdout and stderr.
};

Outcome run(const std::string& arguments) {
    Outcome outcome;
    FILE* pipe = popen((std::string(FIELDLIGHT_BINARY) + " " + arguments + " 2>&1").c_str(), "r");
    std::array<char, 4096> buffer;
    while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
        outcome.text.append(buffer.data(), count);
    }
    const int status = pclose(pipe);
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return outcome;
}

std::string cornell() {
    return (tests::assets_folder() / "cornell_box.glb").string();
}

TEST(Program, TellsItsVerbsAndFlags) {
    const Outcome help = run("--help");
    EXPECT_EQ(help.exit_code, 0);
    for (const char* verb : {"bake", "render", "compare", "convert", "inspect"}) {
        EXPECT_NE(help.text.find(verb), std::string::npos) << verb;
        const Outcome verb_help = run(std::string(verb) + " --help");
        EXPECT_EQ(verb_help.exit_code, 0);
        EXPECT_NE(verb_help.text.find("Example"), std::string::npos) << verb << " --help shows no example";
        EXPECT_NE(verb_help.text.find("--json"), std::string::npos) << verb;
    }
}

TEST(Program, SaysWhichRendererIsNotBuiltYet) {
    const Outcome outcome = run("render " + cornell() + " -o x.exr --renderer screen-denoiser");
    EXPECT_EQ(outcome.exit_code, 64);
    EXPECT_NE(outcome.text.find("screen-denoiser"), std::string::npos);
    EXPECT_NE(outcome.text.find("not built yet"), std::string::npos);
}

TEST(Program, RefusesWrongFlags) {
    const tests::TemporaryFolder folder;
    const std::string out = " -o " + (folder.path() / "x.exr").string();
    const std::string quick = " --size 8x8 --spp 1 --tracer triangle";
    for (const char* wrong :
         {" --size 0x9", " --spp 0", " --sun 1,2", " --sky red", " --crop 0,0,9,9", " --eye 0,0,0",
          " --camera nobody", " --aov Colour", " --eye 0,0,0 --look-at 0,0,0", " --bounces -1"}) {
        const Outcome outcome = run("render " + cornell() + out + quick + wrong);
        EXPECT_EQ(outcome.exit_code, 64) << wrong << ": " << outcome.text;
        EXPECT_FALSE(outcome.text.empty());
    }
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "x.exr")) << "a failed run leaves no file";
}

TEST(Program, RendersWhatItPromises) {
    const tests::TemporaryFolder folder;
    const std::string out = (folder.path() / "x.exr").string();
    const std::string stats = (folder.path() / "x.json").string();
    const Outcome outcome =
        run("render " + cornell() + " -o " + out + " --stats " + stats +
            " --png --size 32x24 --spp 8 --resolution 24 --aov Depth,Normal,Variance,Steps");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.text;
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "x.png"));
    const nlohmann::json statistics = nlohmann::json::parse(std::ifstream(stats));
    for (const char* key :
         {"schema", "version", "command", "scene", "width", "height", "tracer", "renderer", "threads", "isa",
          "seconds", "passes", "rays", "rays_per_pixel", "sdf", "memory", "nonfinite_pixels", "saturated"}) {
        EXPECT_TRUE(statistics.contains(key)) << key;
    }
    EXPECT_EQ(statistics["tracer"], "sdf");
    EXPECT_GT(statistics["sdf"]["steps"].get<long>(), 0);
    EXPECT_GT(statistics["memory"]["sdf_bytes"].get<long>(), 0);

    const Outcome inspected = run("inspect " + out + " --json");
    ASSERT_EQ(inspected.exit_code, 0);
    for (const char* channel : {"\"R\"", "\"A\"", "Depth.Z", "Normal.X", "Variance.G", "Steps.Y"}) {
        EXPECT_NE(inspected.text.find(channel), std::string::npos) << channel;
    }
    EXPECT_NE(inspected.text.find("worldToCamera"), std::string::npos);
}

TEST(Program, BakesNothingForTriangles) {
    const tests::TemporaryFolder folder;
    const std::string out = (folder.path() / "x.exr").string();
    const std::string stats = (folder.path() / "x.json").string();
    ASSERT_EQ(run("render " + cornell() + " -o " + out + " --stats " + stats +
                  " --size 16x16 --spp 1 --tracer triangle --primary triangle")
                  .exit_code,
              0);
    const nlohmann::json statistics = nlohmann::json::parse(std::ifstream(stats));
    EXPECT_EQ(statistics["memory"]["sdf_bytes"], 0);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "cornell_box.bake"));
}

TEST(Program, CropsWhatTheWholePictureShows) {
    const tests::TemporaryFolder folder;
    const std::string whole = (folder.path() / "whole.exr").string();
    const std::string crop = (folder.path() / "crop.exr").string();
    const std::string common = " --size 32x32 --spp 4 --tracer triangle --quiet -o ";
    ASSERT_EQ(run("render " + cornell() + common + whole).exit_code, 0);
    ASSERT_EQ(run("render " + cornell() + common + crop + " --crop 8,4,16,12").exit_code, 0);
    const core::Image all = core::read_exr(whole);
    const core::Image part = core::read_exr(crop);
    ASSERT_EQ(part.width(), 16);
    ASSERT_EQ(part.height(), 12);
    // A ray's neighbours in its packet may move its hit by rounding, and with it a path that grazes an edge.
    int different = 0;
    for (std::size_t y = 0; y < 12; ++y) {
        for (std::size_t x = 0; x < 16; ++x) {
            const float expected = (*all.find("G"))[(y + 4) * 32 + x + 8];
            if (std::abs((*part.find("G"))[y * 16 + x] - expected) > 1e-4f * (expected + 0.01f)) ++different;
        }
    }
    EXPECT_LE(different, 2);
}

}  // namespace
