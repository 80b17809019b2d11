// The report as JSON and CSV, and command lines that a shell reads back.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "cli/render_line.h"
#include "cli/report.h"

namespace {

/// Fields of RFC 4180, line by line.
std::vector<std::vector<std::string>> parse_csv(const std::string& text) {
    std::vector<std::vector<std::string>> lines(1, {""});
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '"') {
            if (quoted && i + 1 < text.size() && text[i + 1] == '"') {
                lines.back().back() += text[i++];
            } else {
                quoted = !quoted;
            }
        } else if (!quoted && text[i] == ',') {
            lines.back().emplace_back();
        } else if (!quoted && text[i] == '\r') {
            EXPECT_EQ(text[++i], '\n');
            lines.push_back({""});
        } else {
            lines.back().back() += text[i];
        }
    }
    EXPECT_EQ(lines.back(), std::vector<std::string>{""}) << "the last line is ended, too";
    lines.pop_back();
    return lines;
}

cli::Report sample_report() {
    cli::Report report;
    cli::ReportSeries series;
    series.method = "fields \"64\", coarse";
    series.tracer = "sdf";
    series.resolution = 64;
    series.load_seconds = 1.0;
    series.bake_seconds = 2.0;
    series.build_seconds = 4.0;
    series.seconds_to_5_percent = cli::Estimate{3.0, 2.0, std::numeric_limits<double>::infinity()};
    cli::ReportPoint point;
    point.samples_per_pixel = 4;
    point.seconds = 0.1;
    point.rel_mse = {0.25, 0.125, 0.5};
    point.flip = std::numeric_limits<double>::quiet_NaN();
    point.pareto = true;
    point.command = "fieldlight render 'my, scene.glb'\n--spp 4";
    series.points = {point, point};
    series.points[1].pareto = false;
    report.series = {series};
    report.paired = {{"triangles", series.method, {0.5, 0.25, 0.75}, true}};
    report.winner = "triangles";
    report.pictures.push_back({"reference", "pictures/reference.exr", {glm::vec3(1.0f)}, {}, {}, {}});
    return report;
}

TEST(ReportFiles, CsvHasALineAPointThatReadsBack) {
    const auto lines = parse_csv(cli::report_csv(sample_report()));
    ASSERT_EQ(lines.size(), 3u);
    for (const auto& line : lines) ASSERT_EQ(line.size(), lines[0].size());
    const auto cell = [&](const std::string& column) -> std::string {
        for (std::size_t i = 0; i < lines[0].size(); ++i) {
            if (lines[0][i] == column) return lines[1][i];
        }
        return "no such column";
    };
    EXPECT_EQ(cell("method"), "fields \"64\", coarse");
    EXPECT_EQ(cell("command"), "fieldlight render 'my, scene.glb'\n--spp 4");
    EXPECT_EQ(cell("seconds"), "0.1");
    EXPECT_EQ(cell("cold_seconds"), "7.1");
    EXPECT_EQ(cell("rel_mse_high"), "0.5");
    EXPECT_EQ(cell("flip"), "") << "what is not a number is empty";
    EXPECT_EQ(cell("pareto"), "1");
}

TEST(ReportFiles, JsonHoldsTheKeysThatScriptsRelyOn) {
    const nlohmann::json json = nlohmann::json::parse(cli::report_json(sample_report()).dump());
    EXPECT_EQ(json.at("schema"), 1);
    const nlohmann::json& series = json.at("series").at(0);
    EXPECT_EQ(series.at("settings").at("resolution"), 64);
    EXPECT_TRUE(series.at("floor").is_null());
    EXPECT_EQ(series.at("seconds_to_5_percent").at("value"), 3.0);
    EXPECT_TRUE(series.at("seconds_to_5_percent").at("high").is_null()) << "JSON has no infinity";
    const nlohmann::json& point = series.at("points").at(0);
    for (const char* key : {"seconds", "cpu_seconds", "rays", "metrics", "command"}) {
        EXPECT_TRUE(point.contains(key)) << key;
    }
    EXPECT_TRUE(point.at("metrics").at("flip").is_null());
    EXPECT_TRUE(point.at("metrics").at("percentiles").contains("99.9"));
    EXPECT_FALSE(point.at("metrics").contains("ssim")) << "that is of two pictures alone";
    EXPECT_EQ(json.at("winner"), "triangles");
    EXPECT_EQ(json.at("paired").at(0).at("worse"), "fields \"64\", coarse");
    EXPECT_EQ(json.at("paired").at(0).at("rel_mse_difference").at("low"), 0.25);
    EXPECT_EQ(json.at("paired").at(0).at("decided"), true);
    ASSERT_EQ(json.at("pareto").size(), 1u);
    EXPECT_EQ(json.at("pareto").at(0).at("samples_per_pixel"), 4);
    EXPECT_EQ(json.at("pictures").at(0).at("exr"), "pictures/reference.exr");
    EXPECT_FALSE(json.at("pictures").at(0).contains("radiance"));
}

TEST(RenderLine, SurvivesAShell) {
    const std::vector<std::string> arguments = {"plain",   "two words", "it's", "$HOME",
                                                "a\"b\\c", "",          "*",    "--sun=-3,4,5"};
    const std::string line = cli::shell_line(arguments);
    ASSERT_EQ(line.rfind("fieldlight ", 0), 0u);
    FILE* pipe = popen(("printf '<%s>' " + line.substr(11)).c_str(), "r");
    std::array<char, 512> buffer{};
    const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe);
    pclose(pipe);
    std::string expected;
    for (const std::string& argument : arguments) expected += "<" + argument + ">";
    EXPECT_EQ(std::string(buffer.data(), count), expected);
}

TEST(RenderLine, SaysAllThatDecidesThePixelsAndNoMore) {
    cli::RenderOptions options;
    options.renderer = cli::RendererKind::kPath;
    options.scene.file = "my room.glb";
    options.output = "x.exr";
    options.tracer = options.primary = cli::TracerKind::kTriangle;
    options.width = 64;
    options.height = 36;
    options.samples_per_pixel = 4;
    options.seed = 9;
    EXPECT_EQ(cli::render_line(options, false),
              "fieldlight render 'my room.glb' -o x.exr --tracer triangle --primary triangle --size 64x36 "
              "--renderer path --spp 4 --seed 9");
    options.tracer = options.primary = cli::TracerKind::kSdf;
    options.bake.resolution = 32;
    options.bake_folder = "fields/32";
    options.bounces = 0;
    options.scene.scene = "attic";
    options.scene.sky = "1,2,3";
    options.scene.sky_rotation_degrees = 30.5;
    options.scene.sun = "-10,20,3000";
    options.scene.eye = "-1,0,0";
    options.scene.look_at = "0,0,0";
    options.scene.fov_degrees = 60.0;
    options.aovs = {"Steps", "Depth"};
    EXPECT_EQ(cli::render_line(options, true),
              "fieldlight render 'my room.glb' -o x.exr --tracer sdf --primary sdf --hit-mode cubic "
              "--sample-bits 16 "
              "--resolution 32 "
              "--bake-dir fields/32 --size 64x36 --renderer path --spp 4 --bounces 0 --seed 9 --scene=attic "
              "--sky=1,2,3 "
              "--sky-rotation=30.5 --sun=-10,20,3000 --eye=-1,0,0 --look-at=0,0,0 --fov=60 --aov Depth,Steps "
              "--allow-external");
    options = {};
    options.scene.file = "room.glb";
    options.output = "x.exr";
    options.tracer = options.primary = cli::TracerKind::kTriangle;
    options.gather.frames = 4;
    options.gather.screen_probes.spatial_filter = false;
    options.effects = gather::parse_effects("screen_probes,sun");
    EXPECT_EQ(cli::render_line(options, false),
              "fieldlight render room.glb -o x.exr --tracer triangle --primary triangle --size 1280x720 "
              "--renderer gather --accumulate 4 --bounces 1 --set screen_probes.spatial_filter=off "
              "--effects sun,screen_probes --seed 0");
}

}  // namespace
