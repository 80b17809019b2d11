// tests/cli/picture_commands_test.cpp: compare, convert and inspect on pictures, as typed.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/inspect_exr.h"
#include "cli/options.h"
#include "core/image/exr.h"
#include "core/scene/texture.h"
#include "core/support/error.h"
#include "core/support/file_bytes.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

struct Outcome {
    int exit_code = 0;
    std::string out, err;  ///< What went to stdout and stderr; the message where an error ended the run.
};

/// Runs a verb in this process, as main does.
Outcome run(const std::vector<std::string>& arguments) {
    cli::Program program;
    CLI::App app;
    cli::add_compare_command(app, program);
    cli::add_convert_command(app, program);
    std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
    Outcome outcome;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    std::string error_text;
    try {
        app.parse(reversed);
        outcome.exit_code = program.exit_code;
    } catch (const CLI::ParseError& error) {
        outcome.exit_code = 64;
        error_text = error.what();
    } catch (const core::InputError& error) {
        outcome.exit_code = static_cast<int>(error.kind());
        error_text = error.what();
    }
    std::fflush(stdout);
    outcome.out = testing::internal::GetCapturedStdout();
    outcome.err = testing::internal::GetCapturedStderr() + error_text;
    return outcome;
}

class PictureCommands : public testing::Test {
protected:
    std::string write(const std::string& name, int width, int height, float value) {
        core::Image image(width, height);
        for (const char* channel : {"R", "G", "B"}) image.add_channel(channel, value);
        return write(name, image);
    }
    std::string write(const std::string& name, const core::Image& image) {
        core::write_exr(folder_.path() / name, image);
        return path(name);
    }
    std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

private:
    tests::TemporaryFolder folder_;
};

TEST_F(PictureCommands, ComparePrintsTheKeysThatScriptsRelyOn) {
    const Outcome outcome =
        run({"compare", write("a.exr", 4, 4, 1.1f), write("b.exr", 4, 4, 1.0f), "--json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json report = nlohmann::json::parse(outcome.out);
    // 1.1f - 1 is good to 1e-7.
    EXPECT_NEAR(report.at("mse").get<double>(), 0.01, 1e-6);
    EXPECT_NEAR(report.at("energy_bias").get<double>(), 10.0, 1e-4);
    for (const char* key :
         {"schema", "rel_mse", "rel_mse_trimmed", "mrse", "mape", "smape", "leak", "flip", "ssim"}) {
        EXPECT_TRUE(report.at(key).is_number()) << key;
    }
    // A value is 1.1, and the reference says nothing about its noise.
    for (const char* key : {"flip_ldr", "rel_mse_corrected"}) EXPECT_TRUE(report.at(key).is_null()) << key;
    EXPECT_TRUE(report.at("warnings").empty());
    for (const char* key : {"50", "95", "99", "99.9"})
        EXPECT_TRUE(report.at("percentiles").at(key).is_number());
    EXPECT_EQ(report.at("nonfinite_pixels"), 0);
}

TEST_F(PictureCommands, CompareTakesTheSecondPictureAsTheReference) {
    const std::string one = write("a.exr", 2, 2, 1.0f), two = write("b.exr", 2, 2, 2.0f);
    const auto bias = [](const Outcome& outcome) {
        return nlohmann::json::parse(outcome.out).at("energy_bias").get<double>();
    };
    EXPECT_NEAR(bias(run({"compare", one, two, "--json"})), -50.0, 1e-6);
    EXPECT_NEAR(bias(run({"compare", two, one, "--json"})), 100.0, 1e-6);
}

TEST_F(PictureCommands, CompareFailsWithTwoWhereAThresholdIsExceeded) {
    const std::string a = write("a.exr", 4, 4, 0.9f), b = write("b.exr", 4, 4, 1.0f);
    EXPECT_EQ(run({"compare", a, b, "--fail-mse", "0.011", "--fail-energy-bias", "11"}).exit_code, 0);
    const Outcome outcome =
        run({"compare", a, b, "--fail-mse", "0.009", "--fail-energy-bias", "9", "--fail-mape", "1"});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_NE(outcome.err.find("--fail-mse allows 0.009"), std::string::npos) << outcome.err;
    // The bias is -10 %: its size counts, not its sign.
    EXPECT_NE(outcome.err.find("--fail-energy-bias allows 9"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find("--fail-mape"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.out.find("relMSE"), std::string::npos);
    for (const char* flag : {"--fail-rel-mse", "--fail-rel-mse-trimmed", "--fail-mrse", "--fail-mape",
                             "--fail-smape", "--fail-p50", "--fail-p95", "--fail-p99", "--fail-p99.9",
                             "--fail-max", "--fail-flip", "--fail-flip-ldr"}) {
        EXPECT_EQ(run({"compare", a, b, flag, "0.0001"}).exit_code, 2) << flag;
        EXPECT_EQ(run({"compare", a, b, flag, "1"}).exit_code, 0) << flag;
    }
}

TEST_F(PictureCommands, CompareFailsALeakThatDoesNotCount) {
    core::Image reference(2, 1), dark(2, 1), right(2, 1);
    for (const char* channel : {"R", "G", "B"}) {
        reference.add_channel(channel, {1.0f, 0.0f});
        dark.add_channel(channel, {0.0f, 0.0f});
        right.add_channel(channel, {1.0f, 0.0f});
    }
    const std::string b = write("reference.exr", reference);
    EXPECT_EQ(run({"compare", write("right.exr", right), b, "--fail-leak", "0.001"}).exit_code, 0);
    // Darkness leaks nothing, and must not pass for it.
    EXPECT_EQ(run({"compare", write("dark.exr", dark), b, "--fail-leak", "0.001"}).exit_code, 2);
}

TEST_F(PictureCommands, CompareFailsWhatIsLessSimilarThanWanted) {
    const std::string a = write("a.exr", 4, 4, 0.5f), b = write("b.exr", 4, 4, 1.0f);
    EXPECT_EQ(run({"compare", a, b, "--fail-ssim", "0.999"}).exit_code, 2);
    EXPECT_EQ(run({"compare", a, b, "--fail-ssim", "0.1"}).exit_code, 0);
    EXPECT_EQ(run({"compare", a, a, "--fail-ssim", "0.999"}).exit_code, 0);
}

TEST_F(PictureCommands, CompareHoldsFlipAgainstThePublishedValue) {
    // Grey 0.5 and 0.6 of the table in tests/core/image/flip_test.cpp; a constant HDR pair shows 0.85 and
    // more.
    const std::string a = write("a.exr", 8, 8, 0.6f), b = write("b.exr", 8, 8, 0.5f);
    const Outcome outcome = run({"compare", a, b, "--json", "--fail-flip-ldr", "0.197"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json report = nlohmann::json::parse(outcome.out);
    EXPECT_NEAR(report.at("flip_ldr").get<double>(), 0.196255, 1e-4);
    EXPECT_NE(report.at("flip"), report.at("flip_ldr"));
    EXPECT_EQ(report.at("flip_details").at("exposures").size(), 1u);
    EXPECT_NEAR(report.at("flip_details").at("max").get<double>(), report.at("flip").get<double>(), 1e-5);
}

TEST_F(PictureCommands, CompareFailsAThresholdOnWhatIsNotDefined) {
    const std::string a = write("a.exr", 4, 4, 1.5f), b = write("b.exr", 4, 4, 1.5f);
    for (const char* flag : {"--fail-flip-ldr", "--fail-rel-mse-corrected"}) {
        const Outcome outcome = run({"compare", a, b, flag, "1"});
        EXPECT_EQ(outcome.exit_code, 2);
        EXPECT_NE(outcome.err.find("is not defined, since"), std::string::npos) << outcome.err;
    }
    // Nobody asked: nothing to complain about.
    const Outcome outcome = run({"compare", a, b});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("not defined: a value lies outside [0, 1]"), std::string::npos) << outcome.out;
}

TEST_F(PictureCommands, CompareTakesTheNoiseOfTheReferenceOut) {
    // Half of the pixels are 1.1 and half 0.9 beside 1: MSE 0.01, of which the variance explains 0.009.
    core::Image test(16, 16), reference(16, 16);
    std::vector<glm::vec3> values;
    for (int i = 0; i < 256; ++i) values.emplace_back(i % 2 == 0 ? 1.1f : 0.9f);
    test.add_color("", values);
    reference.add_color("", std::vector<glm::vec3>(256, glm::vec3(1.0f)));
    reference.add_color("Variance", std::vector<glm::vec3>(256, glm::vec3(0.009f)));
    reference.add_color("Direct", std::vector<glm::vec3>(256, glm::vec3(1.0f)));
    test.add_color("Direct", values);
    const std::string a = write("a.exr", test), b = write("b.exr", reference);
    const nlohmann::json report = nlohmann::json::parse(run({"compare", a, b, "--json"}).out);
    // The noise of the denominator is taken out as well; it is of second order.
    EXPECT_NEAR(report.at("rel_mse_corrected").get<double>(), 0.001, 5e-4);
    EXPECT_NEAR(report.at("rel_mse_corrected_details").at("reference_noise").get<double>(), 0.009 / 1.01,
                1e-6);
    EXPECT_TRUE(nlohmann::json::parse(run({"compare", a, b, "--json", "--layer", "Direct"}).out)
                    .at("rel_mse_corrected")
                    .is_null());
    // Passes where the plain one fails, but the reference is too noisy for either gate.
    EXPECT_EQ(run({"compare", a, b, "--fail-rel-mse", "0.005"}).exit_code, 2);
    const Outcome warned = run({"compare", a, b, "--fail-rel-mse-corrected", "0.005"});
    EXPECT_EQ(warned.exit_code, 1);
    EXPECT_NE(warned.err.find("more than a fifth of what --fail-rel-mse-corrected allows"), std::string::npos)
        << warned.err;
    EXPECT_EQ(run({"compare", a, b, "--fail-rel-mse-corrected", "0.05"}).exit_code, 0);
    EXPECT_EQ(run({"compare", a, b, "--fail-rel-mse-corrected", "0.0001"}).exit_code, 2);
}

TEST_F(PictureCommands, CompareWarnsOfABlackReference) {
    const std::string a = write("a.exr", 4, 4, 1.0f), black = write("b.exr", 4, 4, 0.0f);
    const Outcome outcome = run({"compare", a, black, "--json"});
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.err.find("the reference is black"), std::string::npos) << outcome.err;
    const nlohmann::json report = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(report.at("warnings").size(), 1u);
    EXPECT_GT(report.at("flip").get<double>(), 0.9);
    EXPECT_EQ(run({"compare", a, black, "--fail-mse", "0.1"}).exit_code, 2);
}

TEST_F(PictureCommands, CompareWritesTheFlipMap) {
    core::Image reference(40, 2), test(40, 2);
    std::vector<glm::vec3> values(80, glm::vec3(0.5f));
    reference.add_color("", values);
    for (std::size_t i = 0; i < 80; ++i) {
        if (i % 40 >= 20) values[i] = glm::vec3(0.0f, 0.0f, 1.0f);
    }
    values[39].r = std::numeric_limits<float>::quiet_NaN();
    test.add_color("", values);
    const std::string a = write("a.exr", test), b = write("b.exr", reference);
    // A threshold that fails is when the map is wanted most.
    EXPECT_EQ(run({"compare", a, b, "--flip-map", path("map.png")}).exit_code, 2);
    const core::TextureImage png =
        core::decode_texture_image(core::read_file_bytes(path("map.png"), 1 << 20), "map.png");
    ASSERT_EQ(png.width, 40);
    ASSERT_EQ(png.height, 2);
    const auto pixel = [&](std::size_t i) {
        return std::array<int, 3>{png.rgba[4 * i], png.rgba[4 * i + 1], png.rgba[4 * i + 2]};
    };
    EXPECT_EQ(pixel(0), (std::array<int, 3>{0, 0, 4}));  // Magma of 0.
    EXPECT_GT(pixel(70)[0], 150);
    EXPECT_EQ(pixel(39), (std::array<int, 3>{255, 0, 255}));
    EXPECT_EQ(run({"compare", a, b, "--flip-map", path("map.jpg")}).exit_code, 64);
}

TEST_F(PictureCommands, CompareFailsAnyNonfinitePixelAndSaysSo) {
    core::Image broken(4, 4);
    for (const char* channel : {"R", "G", "B"}) broken.add_channel(channel, 1.0f);
    (*broken.find("G"))[7] = std::numeric_limits<float>::quiet_NaN();
    const std::string a = write("a.exr", broken), b = write("b.exr", 4, 4, 1.0f);
    for (const auto& [test, reference] : {std::pair{a, b}, std::pair{b, a}}) {
        const Outcome outcome = run({"compare", test, reference, "--json"});
        EXPECT_EQ(outcome.exit_code, 2);
        EXPECT_NE(outcome.err.find("1 pixels are not finite"), std::string::npos) << outcome.err;
        const nlohmann::json report = nlohmann::json::parse(outcome.out);
        EXPECT_EQ(report.at("nonfinite_pixels"), 1);
        EXPECT_TRUE(report.at("mse").is_null());
    }
}

TEST_F(PictureCommands, CompareRefusesWhatCannotBeCompared) {
    const std::string a = write("a.exr", 4, 4, 1.0f), b = write("b.exr", 4, 5, 1.0f);
    EXPECT_EQ(run({"compare", a, b}).exit_code, 65);
    EXPECT_EQ(run({"compare", a, path("missing.exr")}).exit_code, 66);
    EXPECT_EQ(run({"compare", a}).exit_code, 64);
    EXPECT_EQ(run({"compare"}).exit_code, 64);
    EXPECT_EQ(run({"compare", a, a, "-o", "out"}).exit_code, 64);
    EXPECT_EQ(run({"compare", a, a, a}).exit_code, 64);
    EXPECT_EQ(run({"compare", a, path("picture.png")}).exit_code, 64);
    EXPECT_EQ(run({"compare", a, a, "--fail-mse", "-1"}).exit_code, 64);
    const Outcome layer = run({"compare", a, a, "--layer", "Direct"});
    EXPECT_EQ(layer.exit_code, 65);
    EXPECT_NE(layer.err.find("Direct.R"), std::string::npos) << layer.err;
}

TEST_F(PictureCommands, CompareReadsALayer) {
    core::Image a(1, 1), b(1, 1);
    a.add_color("", {{1, 1, 1}});
    a.add_color("Direct", {{2, 2, 2}});
    b.add_color("", {{1, 1, 1}});
    b.add_color("Direct", {{5, 5, 5}});
    const Outcome outcome =
        run({"compare", write("a.exr", a), write("b.exr", b), "--json", "--layer", "Direct"});
    EXPECT_EQ(nlohmann::json::parse(outcome.out).at("mse"), 9.0);
}

TEST_F(PictureCommands, ConvertWritesTheExposureThatWasAskedFor) {
    // displayed = 1.2 / (1.2 x 2^1) = 0.5, whose sRGB is 187.5 of 255: 188.
    const Outcome outcome = run({"convert", write("a.exr", 3, 2, 1.2f), path("a.png"), "--exposure", "1",
                                 "--tone-map", "linear", "--json"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out).at("exposure"), 1.0);
    const core::TextureImage png =
        core::decode_texture_image(core::read_file_bytes(path("a.png"), 1 << 20), "a.png");
    ASSERT_EQ(png.width, 3);
    ASSERT_EQ(png.height, 2);
    EXPECT_EQ(png.rgba[0], 188);
    EXPECT_EQ(png.rgba[3], 255);
}

TEST_F(PictureCommands, ConvertExposesByItselfUnlessTold) {
    const Outcome outcome = run({"convert", write("a.exr", 3, 2, 4.0f), path("a.png"), "--json", "--quiet"});
    EXPECT_NEAR(nlohmann::json::parse(outcome.out).at("exposure").get<double>(), 5.0, 1e-6);  // log2(8 x 4)
    EXPECT_EQ(outcome.err, "");
}

TEST_F(PictureCommands, ConvertRefusesByName) {
    const std::string a = write("a.exr", 2, 2, 1.0f);
    EXPECT_EQ(run({"convert", a, path("a.jpg")}).exit_code, 64);
    EXPECT_EQ(run({"convert", a, path("a.png"), "--exposure", "bright"}).exit_code, 64);
    EXPECT_EQ(run({"convert", a, path("a.png"), "--exposure", "nan"}).exit_code, 64);
    EXPECT_EQ(run({"convert", a, path("a.png"), "--tone-map", "filmic"}).exit_code, 64);
    EXPECT_FALSE(fs::exists(path("a.png")));
}

TEST_F(PictureCommands, InspectTellsRangesAndNonfiniteValuesOfEveryChannel) {
    core::Image image(4, 1);
    image.add_channel("R", {1.0f, 2.0f, 6.0f, std::numeric_limits<float>::quiet_NaN()});
    image.add_channel("Depth.Z", std::vector<float>(4, std::numeric_limits<float>::infinity()));
    core::write_exr(path("a.exr"), image, {{"seed", std::string("7\xff")}});
    const nlohmann::json report = cli::inspect_exr(path("a.exr"));
    EXPECT_EQ(report.at("width"), 4);
    EXPECT_EQ(report.at("nan"), 1);
    EXPECT_EQ(report.at("inf"), 4);
    const nlohmann::json& red = report.at("channels").at(0);
    EXPECT_EQ(red.at("name"), "R");
    EXPECT_EQ(red.at("type"), "float");
    EXPECT_EQ(red.at("min"), 1.0);
    EXPECT_EQ(red.at("max"), 6.0);
    EXPECT_EQ(red.at("mean"), 3.0);
    EXPECT_TRUE(report.at("channels").at(1).at("mean").is_null());
    // A byte that is not UTF-8 must not keep the report from being printed.
    EXPECT_EQ(report.at("attributes").at("seed").get<std::string>().front(), '7');
    EXPECT_NO_THROW(report.dump());
    EXPECT_NE(cli::describe_exr(report).find("Depth.Z"), std::string::npos);
    EXPECT_EQ(report.at("warnings").size(), 1u);
}

}  // namespace
