// `fieldlight compare SCENE` from outside: a small comparison of a bundled scene, and what its files say.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "core/image/error_estimate.h"
#include "core/image/exr.h"
#include "core/image/flip.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Outcome {
    int exit_code = -1;
    std::string out, err;
};

std::string text_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

/// A folder in which the program runs.
class Workplace {
public:
    /// Runs a line of the shell in which `fieldlight` is the program.
    Outcome run(const std::string& line) const {
        const std::string command = "cd '" + folder_.path().string() + "' && fieldlight() { '" +
                                    FIELDLIGHT_BINARY + "' \"$@\"; }; { " + line + " ; } > .out 2> .err";
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(path(".out")), text_of(path(".err"))};
    }
    fs::path path(const std::string& name) const { return folder_.path() / name; }

private:
    tests::TemporaryFolder folder_;
};

const std::string kScene = (tests::assets_folder() / "cornell_box.glb").string();
const std::string kSmall = " --size 64x36 --resolutions 32,16 --max-spp 4 --reference-spp 32 --seed 5";

/// What must not depend on the machine's pace or threads: all but times.
json without_times(json report) {
    for (const char* key : {"date", "command", "equal_seconds", "verdict", "winner", "paired", "pareto",
                            "threads", "peak_bytes"}) {
        report.erase(key);
    }
    report["reference"].erase("seconds");
    report["reference"].erase("render_seconds");
    report["reference"].erase("reused");
    for (json& series : report["series"]) {
        for (const char* key : {"seconds", "bake_reused", "bake_recorded", "variance_seconds",
                                "seconds_to_5_percent", "rel_mse_at_equal_time"}) {
            series.erase(key);
        }
        for (json& stage : series["stages"]) stage.erase("seconds");
        for (json& point : series["points"]) {
            for (const char* key : {"seconds", "cpu_seconds", "pareto", "command"}) point.erase(key);
        }
    }
    for (json& geometry : report["geometry"]) {
        geometry.erase("triangle_mrays");
        geometry.erase("field_mrays");
    }
    return report;
}

/// The pictures in a folder of kept references; beside each stands what it cost.
std::vector<fs::path> references(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() == ".exr") files.push_back(entry.path());
    }
    return files;
}

/// One comparison for all tests that only look.
class CompareScene : public testing::Test {
protected:
    static void SetUpTestSuite() {
        place_ = new Workplace;
        first_ = new Outcome(place_->run("fieldlight compare " + kScene + " -o out" + kSmall));
        report_ = new json(json::parse(text_of(place_->path("out/report.json")), nullptr, false));
    }
    static void TearDownTestSuite() {
        delete place_;
        delete first_;
        delete report_;
    }

    void SetUp() override {
        ASSERT_EQ(first_->exit_code, 1) << first_->err;  // The reference is noisy, and that is said.
        ASSERT_TRUE(report_->is_object());
    }

    static core::Image picture(const std::string& name) {
        return core::read_exr(place_->path("out/pictures/" + name + ".exr"));
    }

    static const Workplace* place_;
    static const Outcome* first_;
    static const json* report_;
};

const Workplace* CompareScene::place_ = nullptr;
const Outcome* CompareScene::first_ = nullptr;
const json* CompareScene::report_ = nullptr;

const std::vector<std::string> kMethods = {"triangles", "fields 16", "fields 32"};
const std::vector<std::string> kStems = {"triangles", "fields_16", "fields_32"};

TEST_F(CompareScene, TellsEveryMethodAtEveryRung) {
    const json& report = *report_;
    EXPECT_EQ(report.at("schema"), 1);
    EXPECT_EQ(report.at("scene"), "cornell_box.glb");
    EXPECT_EQ(report.at("width"), 64);
    EXPECT_EQ(report.at("reference").at("reused"), false);
    EXPECT_GT(report.at("reference").at("seconds"), 0.0);
    for (const char* key : {"processor", "isa", "system", "compiler", "flags", "commit"}) {
        EXPECT_FALSE(report.at("machine").at(key).get<std::string>().empty()) << key;
    }
    ASSERT_EQ(report.at("series").size(), kMethods.size());
    for (std::size_t i = 0; i < kMethods.size(); ++i) {
        const json& series = report.at("series").at(i);
        EXPECT_EQ(series.at("method"), kMethods[i]);
        EXPECT_GT(series.at("bytes"), 0);
        EXPECT_EQ(series.at("settings").at("median_voxel").get<double>() > 0.0, i > 0);
        ASSERT_EQ(series.at("points").size(), 3u);
        for (int rung = 0; rung < 3; ++rung) {
            const json& point = series.at("points").at(rung);
            EXPECT_EQ(point.at("samples_per_pixel"), 1 << rung);
            EXPECT_EQ(point.at("seed"), 5 + rung);
            EXPECT_GT(point.at("seconds"), 0.0);
            EXPECT_GT(point.at("cpu_seconds"), 0.0);
            EXPECT_GT(point.at("rays"), 64 * 36 << rung);
            EXPECT_EQ(point.at("metrics").at("nonfinite_pixels"), 0);
            EXPECT_LE(point.at("rel_mse").at("low"), point.at("rel_mse").at("value"));
            EXPECT_GE(point.at("rel_mse").at("high"), point.at("rel_mse").at("value"));
        }
        std::vector<std::string> stages;
        for (const json& stage : series.at("stages")) stages.push_back(stage.at("name"));
        EXPECT_EQ(stages, (std::vector<std::string>{"load", "bake", "build", "primary", "bounce", "shadow",
                                                    "shade"}));
    }
    EXPECT_NE(report.at("reference").at("seed"), 5);
    ASSERT_EQ(report.at("geometry").size(), 2u);
    for (const json& geometry : report.at("geometry")) {
        EXPECT_GT(geometry.at("rays"), 64 * 36);
        EXPECT_GT(geometry.at("steps_per_ray"), 1.0);
        EXPECT_LT(geometry.at("miss_percent"), 5.0);
        EXPECT_LT(geometry.at("beyond_silhouettes_voxels").at("p99"), 1.0);
        EXPECT_GT(geometry.at("field_mrays"), 0.0);
    }
    EXPECT_EQ(report.at("reference").at("render_seconds"), report.at("reference").at("seconds"));
    EXPECT_FALSE(report.at("verdict").get<std::string>().empty());
    // Each two of those that reached the common time: on a busy machine perhaps one alone.
    EXPECT_LE(report.at("paired").size(), 3u);
    EXPECT_TRUE(report.at("winner").is_null() || !report.at("paired").empty());
    for (const json& pair : report.at("paired")) {
        const json& difference = pair.at("rel_mse_difference");
        EXPECT_GE(difference.at("value"), 0.0);
        EXPECT_LE(difference.at("low"), difference.at("value"));
        EXPECT_GE(difference.at("high"), difference.at("value"));
        EXPECT_EQ(pair.at("decided"), difference.at("low") > 0.0);
    }
    EXPECT_TRUE(report.at("winner").is_null() ||
                report.at("winner") == report.at("paired").at(0).at("better"));
    EXPECT_FALSE(report.at("pareto").empty());
    const std::string csv = text_of(place_->path("out/report.csv"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 9);
    const std::string page = text_of(place_->path("out/report.html"));
    EXPECT_NE(page.find("</html>"), std::string::npos);
    for (const std::string& method : kMethods) EXPECT_NE(page.find(method), std::string::npos) << method;
    EXPECT_NE(first_->out.find(report.at("verdict").get<std::string>()), std::string::npos) << first_->out;
    EXPECT_NE(first_->err.find("the reference is noisy"), std::string::npos) << first_->err;
}

TEST_F(CompareScene, ReportsTheNumbersOfThePicturesThatItWrote) {
    const core::Image reference = picture("reference");
    const std::vector<glm::vec3> expected = *reference.color(), variance = *reference.color("Variance");
    double noise = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            noise += double(variance[i][c]) / (double(expected[i][c]) * expected[i][c] + 0.01);
        }
    }
    noise /= 3.0 * double(expected.size());
    // Sums in another order: 1e-9.
    EXPECT_NEAR(report_->at("reference").at("rel_variance").get<double>(), noise, 1e-9 * noise);

    for (std::size_t m = 0; m < kMethods.size(); ++m) {
        SCOPED_TRACE(kMethods[m]);
        const core::Image image = picture(kStems[m]);
        const std::vector<glm::vec3> found = *image.color();
        const json& point = report_->at("series").at(m).at("points").back();
        const json& metrics = point.at("metrics");
        double mse = 0.0, rel_mse = 0.0, energy = 0.0, expected_energy = 0.0;
        for (std::size_t i = 0; i < found.size(); ++i) {
            for (int c = 0; c < 3; ++c) {
                const double r = expected[i][c], difference = found[i][c] - r;
                mse += difference * difference;
                rel_mse += difference * difference / (r * r + 0.01);
            }
            const glm::dvec3 weights(0.2126, 0.7152, 0.0722);
            energy += glm::dot(weights, glm::dvec3(found[i]));
            expected_energy += glm::dot(weights, glm::dvec3(expected[i]));
            const double y = glm::dot(weights, glm::dvec3(found[i])),
                         y_expected = glm::dot(weights, glm::dvec3(expected[i]));
            const double relative = std::abs(y - y_expected) / (y_expected + 0.01);
            // Luminance in float, where both may nearly cancel.
            EXPECT_NEAR((*image.find("RelativeError.Y"))[i], relative,
                        1e-5 * (1.0 + y / (y_expected + 0.01)));
        }
        const double count = 3.0 * double(found.size());
        EXPECT_NEAR(metrics.at("mse").get<double>(), mse / count, 1e-9 * mse / count);
        EXPECT_NEAR(metrics.at("rel_mse").get<double>(), rel_mse / count, 1e-9 * rel_mse / count);
        EXPECT_NEAR(metrics.at("energy_bias").get<double>(), 100.0 * (energy / expected_energy - 1.0), 1e-7);
        const core::ErrorInterval corrected = core::corrected_rel_mse(image, reference);
        EXPECT_EQ(point.at("rel_mse").at("value"), corrected.value);
        EXPECT_EQ(point.at("rel_mse").at("high"), corrected.high);
        const core::FlipResult flip = core::flip_hdr(found, expected, 64, 36);
        EXPECT_EQ(metrics.at("flip"), flip.mean);
        EXPECT_EQ(*image.find("Flip.Y"), flip.map);
        ASSERT_EQ(image.find("Steps.Y") != nullptr, m > 0);
        if (m == 0) continue;
        const std::vector<float>& steps = *image.find("Steps.Y");
        EXPECT_GT(*std::max_element(steps.begin(), steps.end()), 1.0f);
    }
}

TEST_F(CompareScene, PrintsCommandsThatMakeTheSamePixels) {
    std::vector<std::pair<std::string, std::string>> commands = {
        {"reference", report_->at("reference").at("command")}};
    for (std::size_t m = 0; m < kMethods.size(); ++m) {
        commands.emplace_back(kStems[m], report_->at("series").at(m).at("points").back().at("command"));
    }
    for (const auto& [name, command] : commands) {
        SCOPED_TRACE(command);
        const std::size_t begin = command.find("-o ") + 3;
        const std::string file = command.substr(begin, command.find(' ', begin) - begin);
        const Outcome outcome = place_->run(command);
        ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
        const core::Image again = core::read_exr(place_->path(file)), before = picture(name);
        std::vector<std::string> channels = {"R", "G", "B", "A"};
        if (name == "reference") channels.emplace_back("Variance.R");
        for (const std::string& channel : channels) {
            EXPECT_EQ(*again.find(channel), *before.find(channel)) << channel;
        }
    }
}

TEST_F(CompareScene, ReusesReferenceAndFieldsAndFindsTheSameOnOneThread) {
    const Outcome second =
        place_->run("fieldlight compare " + kScene + " -o out --threads 1 --json" + kSmall);
    ASSERT_EQ(second.exit_code, 1) << second.err;
    EXPECT_NE(second.err.find("of an earlier run is used"), std::string::npos) << second.err;
    const json report = json::parse(text_of(place_->path("out/report.json")));
    EXPECT_EQ(json::parse(second.out), report) << "--json prints the file";
    EXPECT_EQ(report.at("reference").at("reused"), true);
    EXPECT_EQ(report.at("reference").at("seconds"), 0.0) << "of this run";
    EXPECT_EQ(report.at("reference").at("render_seconds"), report_->at("reference").at("seconds"));
    EXPECT_EQ(report.at("threads"), 1);
    EXPECT_EQ(without_times(report), without_times(*report_));
    const std::string page = text_of(place_->path("out/report.html"));
    EXPECT_NE(page.find("which recorded their price"), std::string::npos);
    EXPECT_NE(page.find(" s in an earlier run, reused"), std::string::npos);
    EXPECT_NE(page.find(report.at("geometry_rays").get<std::string>()), std::string::npos);
    for (std::size_t m = 1; m < kMethods.size(); ++m) {
        const json &before = report_->at("series").at(m), &now = report.at("series").at(m);
        EXPECT_EQ(now.at("bake_recorded"), true);
        EXPECT_EQ(now.at("bake_reused"), false);
        EXPECT_EQ(now.at("seconds").at("bake"), before.at("seconds").at("bake"))
            << "the price of fields is what baking them took";
    }
}

TEST_F(CompareScene, SaysWhereItDoesNotKnowThePriceOfFields) {
    fs::copy(place_->path("out/fields"), place_->path("kept"), fs::copy_options::recursive);
    std::ofstream(place_->path("kept/16/bake_seconds.json")) << "{\"seconds\": 7";
    fs::remove(place_->path("kept/32/floor_0.vdb"));
    const Outcome outcome =
        place_->run("fieldlight compare " + kScene + " -o priced --bake-dir kept" + kSmall);
    const json report = json::parse(text_of(place_->path("priced/report.json")));
    for (std::size_t m = 1; m < kMethods.size(); ++m) {
        EXPECT_EQ(report.at("series").at(m).at("bake_reused"), true) << kMethods[m];
        EXPECT_EQ(report.at("series").at(m).at("bake_recorded"), false) << kMethods[m];
    }
    EXPECT_NE(outcome.out.find("not the whole price"), std::string::npos) << outcome.out;
    EXPECT_EQ(without_times(report), without_times(*report_)) << "at any thread count, in another folder";
}

TEST_F(CompareScene, SaysWhereItDoesNotKnowThePriceOfTheReference) {
    fs::create_directory(place_->path("unpriced"));
    fs::copy(place_->path("out/reference"), place_->path("unpriced/reference"), fs::copy_options::recursive);
    fs::path record = references(place_->path("unpriced/reference")).at(0);
    record.replace_extension(".json");
    ASSERT_TRUE(fs::exists(record));
    std::ofstream(record) << "{\"schema\":1,\"of\":\"another\",\"seconds\":7}";
    const Outcome outcome =
        place_->run("fieldlight compare " + kScene + " -o unpriced --bake-dir out/fields" + kSmall);
    const json report = json::parse(text_of(place_->path("unpriced/report.json")));
    EXPECT_EQ(report.at("reference").at("reused"), true) << outcome.err;
    EXPECT_TRUE(report.at("reference").at("render_seconds").is_null());
    const std::string page = text_of(place_->path("unpriced/report.html"));
    EXPECT_NE(page.find("which did not record its time"), std::string::npos);
}

TEST_F(CompareScene, RendersADamagedReferenceAgain) {
    fs::copy(place_->path("out"), place_->path("damaged"), fs::copy_options::recursive);
    const std::vector<fs::path> kept = references(place_->path("damaged/reference"));
    ASSERT_EQ(kept.size(), 1u);
    const std::string whole = text_of(kept[0]);
    std::string flipped = whole;
    flipped[flipped.size() * 2 / 3] ^= 0x10;
    // Whole and of the right picture, but for one value.
    core::ExrFile other = core::read_exr_file(kept[0]);
    (*other.image.find("G"))[7] += 1.0f;
    const auto& attributes = other.info.attributes;
    core::write_exr(
        kept[0], other.image,
        {{"referenceKey", attributes.at("referenceKey")}, {"pixelHash", attributes.at("pixelHash")}});
    const std::string altered = text_of(kept[0]);
    for (const std::string& bad :
         {flipped, altered, whole.substr(0, whole.size() / 2), std::string("not a picture")}) {
        std::ofstream(kept[0], std::ios::binary) << bad;
        const Outcome outcome = place_->run("fieldlight compare " + kScene + " -o damaged" + kSmall);
        EXPECT_NE(outcome.err.find("rendered again"), std::string::npos) << outcome.err;
        EXPECT_TRUE(text_of(kept[0]) == whole) << "the file is as it was";
        const json report = json::parse(text_of(place_->path("damaged/report.json")));
        EXPECT_EQ(report.at("reference").at("reused"), false);
        EXPECT_EQ(without_times(report), without_times(*report_));
    }
}

TEST_F(CompareScene, KeepsAReferenceForEachPicture) {
    const std::string tiny = "fieldlight compare " + kScene +
                             " -o many --bake-dir out/fields --resolutions 16 --max-spp 1 --size 16x12 "
                             "--reference-spp 8 ";
    std::size_t count = 0;
    for (const char* other : {"", "--size 12x16", "--reference-spp 9", "--bounces 1", "--seed 1",
                              "--sky 1,1,1", "--eye 1,2,30 --look-at 0,2,0"}) {
        // A flag given twice is an error, so that what changes must not stand in the common part.
        std::string line = tiny;
        for (const std::string flag : {"--size ", "--reference-spp "}) {
            if (std::string(other).find(flag) == std::string::npos) continue;
            const std::size_t begin = line.find(flag);
            line.erase(begin, line.find(' ', begin + flag.size()) + 1 - begin);
        }
        const Outcome outcome = place_->run(line + other);
        const json report = json::parse(text_of(place_->path("many/report.json")));
        EXPECT_EQ(report.at("reference").at("reused"), false) << other << outcome.err;
        EXPECT_EQ(references(place_->path("many/reference")).size(), ++count) << other;
    }
}

TEST_F(CompareScene, SetsTheGatherAgainstThePathTracer) {
    const std::string line = "fieldlight compare " + kScene +
                             " -o both --bake-dir out/fields --size 64x36 --resolutions 32 --max-spp 4 "
                             "--reference-spp 64 --seed 5 --renderers path,gather --quality draft";
    const Outcome outcome = place_->run(line);
    ASSERT_EQ(outcome.exit_code, 1) << outcome.err;  // Of the reference's noise.
    const json report = json::parse(text_of(place_->path("both/report.json")));
    EXPECT_EQ(report.at("bounces"), 1) << "the gather has no more, so that nobody has";
    const std::vector<std::string> methods = {"triangles", "fields 32", "gather triangles",
                                              "gather fields 32"};
    ASSERT_EQ(report.at("series").size(), methods.size());
    EXPECT_EQ(report.at("geometry").size(), 1u) << "rays know nothing of the renderer";
    const core::Image reference = core::read_exr(place_->path("both/pictures/reference.exr"));
    for (std::size_t m = 0; m < methods.size(); ++m) {
        SCOPED_TRACE(methods[m]);
        const json& series = report.at("series").at(m);
        EXPECT_EQ(series.at("method"), methods[m]);
        EXPECT_EQ(series.at("settings").at("renderer"), m < 2 ? "path" : "gather");
        EXPECT_EQ(series.at("settings").at("tracer"), m % 2 ? "sdf" : "triangle");
        ASSERT_EQ(series.at("points").size(), 3u);
        EXPECT_GT(series.at("points").at(2).at("rays").get<double>(),
                  2.5 * series.at("points").at(0).at("rays").get<double>())
            << "a rung takes its samples or frames";
        std::set<std::string> stages;
        for (const json& stage : series.at("stages")) stages.insert(stage.at("name"));
        EXPECT_EQ(stages.count("trace_probes"), m < 2 ? 0u : 1u);
        // What four frames of probes share is far more than four paths a pixel find.
        const json& last = series.at("points").back();
        if (m >= 2) {
            EXPECT_LT(last.at("rel_mse").at("value").get<double>(), 0.5 * report.at("series")
                                                                              .at(m - 2)
                                                                              .at("points")
                                                                              .back()
                                                                              .at("rel_mse")
                                                                              .at("value")
                                                                              .get<double>());
        }
        const std::string command = last.at("command");
        EXPECT_EQ(command.find("--renderer gather") != std::string::npos, m >= 2) << command;
        const Outcome again = place_->run(command);
        ASSERT_EQ(again.exit_code, 0) << again.err;
        const std::size_t begin = command.find("-o ") + 3;
        const core::Image made =
            core::read_exr(place_->path(command.substr(begin, command.find(' ', begin) - begin)));
        std::string stem = methods[m];
        std::replace(stem.begin(), stem.end(), ' ', '_');
        const core::Image kept = core::read_exr(place_->path("both/pictures/" + stem + ".exr"));
        for (const char* channel : {"R", "G", "B"}) EXPECT_EQ(*made.find(channel), *kept.find(channel));
    }
    EXPECT_NE(outcome.err.find("gather fields 32, 4 frames"), std::string::npos) << outcome.err;
    EXPECT_NE(text_of(place_->path("both/report.html")).find("4 frames"), std::string::npos);
}

TEST_F(CompareScene, MeasuresWhatASettingOfTheGatherCosts) {
    const auto compare = [&](const std::string& folder, const std::string& more) {
        const Outcome outcome =
            place_->run("fieldlight compare " + kScene + " -o " + folder +
                        " --bake-dir out/fields --size 64x36 --resolutions 32 --max-spp 1 "
                        "--reference-spp 64 --seed 5 --renderers gather" +
                        more);
        EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
        return json::parse(text_of(place_->path(folder + "/report.json")));
    };
    const json usual = compare("usual", ""), fewer = compare("fewer", " --set screen_probes.spacing=32");
    ASSERT_EQ(usual.at("series").size(), 2u);
    for (std::size_t m = 0; m < 2; ++m) {
        const json &before = usual.at("series").at(m).at("points").at(0),
                   &after = fewer.at("series").at(m).at("points").at(0);
        EXPECT_LT(after.at("rays"), before.at("rays"));
        EXPECT_NE(after.at("command").get<std::string>().find("screen_probes.spacing=32"), std::string::npos);
    }
    const json direct = compare("direct", " --bounces 0");
    EXPECT_EQ(direct.at("bounces"), 0);
}

TEST_F(CompareScene, EndsTheLadderWithItsBudget) {
    const Outcome outcome = place_->run("fieldlight compare " + kScene +
                                        " -o short --bake-dir out/fields --time-budget 1e-6" + kSmall);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    const json report = json::parse(text_of(place_->path("short/report.json")));
    for (const json& series : report.at("series")) EXPECT_EQ(series.at("points").size(), 1u);
    EXPECT_NE(outcome.err.find("--time-budget"), std::string::npos) << outcome.err;
}

TEST(CompareSceneErrors, RefuseWrongFlags) {
    const Workplace place;
    const auto code = [&](const std::string& arguments) {
        const Outcome outcome = place.run("fieldlight compare " + arguments);
        EXPECT_FALSE(outcome.err.empty()) << arguments;
        return outcome.exit_code;
    };
    EXPECT_EQ(code(kScene + kSmall), 64);
    EXPECT_EQ(code(kScene + " " + kScene + " -o out"), 64);
    for (const char* wrong :
         {"--resolutions 16,16", "--resolutions 2", "--max-spp 0", "--reference-spp 7", "--size 0x9",
          "--camera nobody", "--layer Direct", "--fail-mse 1", "--flip-map x.png", "--sun 1,2",
          "--time-budget 0", "--renderers nobody", "--renderers path,path", "--renderers gather --bounces 2",
          "--renderers gather --set screen_probes.nothing=1", "--quality draft",
          "--set screen_probes.spacing=32"}) {
        EXPECT_EQ(code(kScene + " -o out " + wrong), 64) << wrong;
    }
    for (const char* wrong :
         {"--size 8x8", "--sky 1,1,1", "--max-spp 4", "-o out", "--renderers gather", "--quality draft"}) {
        EXPECT_EQ(code(std::string("a.exr b.exr ") + wrong), 64) << wrong;
    }
    EXPECT_FALSE(fs::exists(place.path("out"))) << "a failed run leaves nothing";
}

}  // namespace
