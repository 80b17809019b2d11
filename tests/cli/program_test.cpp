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
#include <vector>

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
    for (const char* verb : {"bake", "render", "compare", "plan", "convert", "inspect"}) {
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
    const std::string quick = " --size 8x8 --tracer triangle";
    for (const char* wrong :
         {" --size 0x9", " --renderer path --spp 0", " --accumulate 0", " --quality best", " --set x",
          " --sun 1,2", " --sky red", " --crop 0,0,9,9", " --eye 0,0,0", " --camera nobody", " --aov Colour",
          " --eye 0,0,0 --look-at 0,0,0", " --bounces -1"}) {
        const Outcome outcome = run("render " + cornell() + out + quick + wrong);
        EXPECT_EQ(outcome.exit_code, 64) << wrong << ": " << outcome.text;
        EXPECT_FALSE(outcome.text.empty());
    }
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "x.exr")) << "a failed run leaves no file";
}

/// Renders, and expects what every picture brings whatever made it. @return the statistics
nlohmann::json render_with(const tests::TemporaryFolder& folder, const std::string& flags) {
    const std::string out = (folder.path() / "x.exr").string();
    const std::string stats = (folder.path() / "x.json").string();
    const Outcome outcome = run("render " + cornell() + " -o " + out + " --stats " + stats +
                                " --png --size 32x24 --resolution 24 " + flags);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    if (outcome.exit_code != 0) return {};
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "x.png"));
    nlohmann::json statistics = nlohmann::json::parse(std::ifstream(stats));
    for (const char* key : {"schema", "version", "command", "scene", "width", "height", "tracer", "renderer",
                            "threads", "isa", "seconds", "passes", "rays", "sdf", "rays_per_pixel", "memory",
                            "effects", "saturated", "nonfinite_pixels"}) {
        EXPECT_TRUE(statistics.contains(key)) << key;
    }
    for (const char* key : {"peak_bytes", "sdf_bytes", "probe_bytes"}) {
        EXPECT_TRUE(statistics["memory"].contains(key)) << key;
    }
    for (const char* key : {"load", "bake", "build", "render", "write"}) {
        EXPECT_TRUE(statistics["seconds"].contains(key)) << key;
    }
    EXPECT_EQ(statistics["tracer"], "sdf");
    EXPECT_GT(statistics["sdf"]["steps"].get<long>(), 0);
    EXPECT_GT(statistics["memory"]["sdf_bytes"].get<long>(), 0);
    return statistics;
}

void expect_channels(const core::Image& image, const std::vector<std::string>& channels) {
    for (const std::string& channel : channels) EXPECT_NE(image.find(channel), nullptr) << channel;
}

TEST(Program, ListsEverySettingOfAQuality) {
    const Outcome listed = run("render --quality ultra --help-settings");
    EXPECT_EQ(listed.exit_code, 0);
    for (const char* told :
         {"--accumulate = 64 ", "draft 4, medium 16, high 32, ultra 64", "screen_probes.spacing = 8 ",
          "draft 16, medium 16, high 8, ultra 8", "integrate.near_field_radius = 1 "}) {
        EXPECT_NE(listed.text.find(told), std::string::npos) << told;
    }
    EXPECT_NE(run("render --help-settings").text.find("screen_probes.spacing = 16 "), std::string::npos);
}

TEST(Program, RendersWhatItPromises) {
    const tests::TemporaryFolder folder;
    const nlohmann::json statistics =
        render_with(folder,
                    "--accumulate 2 --aov Depth,Normal,BentNormal,Probes,RaysPerTexel,ProbeHitDistance,"
                    "ProbeWeight,FilmSamples,Steps");
    EXPECT_EQ(statistics["renderer"], "gather") << "the default";
    EXPECT_GT(statistics["memory"]["probe_bytes"].get<long>(), 0);

    const core::ExrFile picture = core::read_exr_file(folder.path() / "x.exr");
    expect_channels(picture.image,
                    {"R", "A", "Depth.Z", "Normal.X", "BentNormal.X", "Probes.R", "RaysPerTexel.Y",
                     "ProbeHitDistance.Z", "ProbeWeight.Y", "FilmSamples.Y", "Steps.Y"});
    const Outcome inspected = run("inspect " + (folder.path() / "x.exr").string() + " --json");
    for (const char* told : {"\"R\"", "Depth.Z", "worldToCamera"}) {
        EXPECT_NE(inspected.text.find(told), std::string::npos) << told;
    }
    const auto& attributes = picture.info.attributes;
    for (const char* name : {"worldToCamera", "worldToNDC", "samplesPerPixel", "seed", "sceneHash"}) {
        EXPECT_EQ(attributes.count(name), 1u) << name;
    }
    EXPECT_EQ(attributes.at("renderer"), "gather");
    EXPECT_EQ(attributes.at("bounces"), "1");
    EXPECT_EQ(attributes.at("screen_probes.spacing"), "16");
    for (const auto& [name, effect] : statistics["effects"].items()) {
        EXPECT_FALSE(effect["reason"].get<std::string>().empty()) << name;
        if (!effect["on"].get<bool>()) continue;
        EXPECT_NE((" " + attributes.at("plan") + " ").find(" " + name + " "), std::string::npos) << name;
    }
}

TEST(Program, EffectsThatAreOffCostNothing) {
    const tests::TemporaryFolder folder;
    for (const char* flags :
         {"", "--accumulate 1", "--effects emissive_sampling", "--set screen_probes.spatial_filter=off"}) {
        SCOPED_TRACE(flags);
        const nlohmann::json statistics = render_with(folder, std::string("--quality draft ") + flags);
        EXPECT_EQ(statistics["effects"].size(), 14u);
        for (const auto& [name, effect] : statistics["effects"].items()) {
            if (effect["on"].get<bool>()) continue;
            EXPECT_EQ(effect["seconds"].get<double>(), 0.0) << name;
            EXPECT_EQ(effect["rays"], 0) << name;
            EXPECT_EQ(effect["bytes"], 0) << name;
            EXPECT_TRUE(effect["passes"].empty()) << name;
        }
        const bool probes = statistics["effects"]["screen_probes"]["on"].get<bool>();
        EXPECT_EQ(statistics["memory"]["probe_bytes"].get<long>() > 0, probes);
        EXPECT_GT(statistics["effects"]["emissive_sampling"]["rays"].get<long>(), 0);
    }
}

TEST(Program, RendersByThePathTracerToo) {
    const tests::TemporaryFolder folder;
    const nlohmann::json statistics =
        render_with(folder, "--renderer path --spp 8 --bounces 3 --aov Depth,Variance");
    EXPECT_EQ(statistics["renderer"], "path");
    EXPECT_EQ(statistics["samples_per_pixel"], 8);
    EXPECT_EQ(statistics["memory"]["probe_bytes"], 0);
    const core::ExrFile picture = core::read_exr_file(folder.path() / "x.exr");
    expect_channels(picture.image, {"R", "A", "Depth.Z", "Variance.G"});
    EXPECT_EQ(picture.info.attributes.at("bounces"), "3");
}

TEST(Program, ABudgetOfTimeAloneDecidesHowMuchIsDone) {
    const tests::TemporaryFolder folder;
    for (const char* renderer : {"gather", "path"}) {
        const std::string flags = std::string("--renderer ") + renderer + " --time-budget ";
        // Past the default number of frames or samples, whatever time the machine needs for that.
        const double limit = renderer == std::string("path") ? 64.0 : 16.0;
        double done = 0.0;
        for (const char* seconds : {"0.3 ", "3 ", "30 "}) {
            if (done > limit) break;
            done = render_with(folder, flags + seconds)["samples_per_pixel"].get<double>();
        }
        EXPECT_GT(done, limit) << renderer;
        const std::string most = renderer == std::string("path") ? "--spp 2" : "--accumulate 2";
        EXPECT_EQ(render_with(folder, flags + "30 " + most)["samples_per_pixel"], 2) << renderer;
    }
}

TEST(Program, BakesNothingForTriangles) {
    const tests::TemporaryFolder folder;
    const std::string out = (folder.path() / "x.exr").string();
    const std::string stats = (folder.path() / "x.json").string();
    ASSERT_EQ(run("render " + cornell() + " -o " + out + " --stats " + stats +
                  " --size 16x16 --accumulate 1 --tracer triangle --primary triangle")
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
    for (const char* renderer : {"--accumulate 2", "--renderer path --spp 4"}) {
        SCOPED_TRACE(renderer);
        const std::string common =
            std::string(" --size 32x32 --tracer triangle --quiet ") + renderer + " -o ";
        ASSERT_EQ(run("render " + cornell() + common + whole).exit_code, 0);
        ASSERT_EQ(run("render " + cornell() + common + crop + " --crop 8,4,16,12").exit_code, 0);
        const core::Image all = core::read_exr(whole);
        const core::Image part = core::read_exr(crop);
        ASSERT_EQ(part.width(), 16);
        ASSERT_EQ(part.height(), 12);
        // A ray's neighbours in its packet may move its hit by rounding, and with it a path that grazes an
        // edge.
        int different = 0;
        for (std::size_t y = 0; y < 12; ++y) {
            for (std::size_t x = 0; x < 16; ++x) {
                const float expected = (*all.find("G"))[(y + 4) * 32 + x + 8];
                const float found = (*part.find("G"))[y * 16 + x];
                if (std::abs(found - expected) > 1e-4f * (expected + 0.01f)) ++different;
            }
        }
        EXPECT_LE(different, 2);
    }
}

}  // namespace
