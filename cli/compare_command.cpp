#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/compare_scene_flags.h"
#include "cli/options.h"
#include "cli/picture_file.h"
#include "cli/picture_metrics.h"
#include "core/image/error_estimate.h"
#include "core/image/flip.h"
#include "core/image/metrics.h"
#include "core/image/png.h"
#include "core/image/ssim.h"
#include "core/scene/scene_loader.h"
#include "core/support/error.h"

namespace cli {

namespace {

constexpr int kExitWarned = 1, kExitThresholdFailed = 2;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Everything that is measured of two pictures.
struct Comparison {
    PictureMetrics metrics;
    core::FlipResult flip;
    double reference_noise = kNaN;  ///< relMSE that the reference's variance makes; as metrics.corrected.
    bool black_reference = false;
};

struct CompareOptions {
    std::vector<std::string> inputs;
    std::string layer;
    std::string flip_map;
    CompareSceneFlags scene;
    /// In the order of picture_metrics(). Not in braces, which would hold one limit.
    std::vector<std::optional<double>> limits = std::vector<std::optional<double>>(picture_metrics().size());
};

[[noreturn]] void fail(const std::string& message) {
    throw core::InputError(core::ErrorKind::kUsage, message);
}

void check_scene(const CompareOptions& options) {
    if (options.inputs.size() != 1) fail("compare SCENE: takes one scene and nothing else");
    if (!options.layer.empty()) fail("compare: --layer belongs to two pictures");
    if (!options.flip_map.empty()) fail("compare: --flip-map belongs to two pictures");
    for (std::size_t i = 0; i < options.limits.size(); ++i) {
        if (!options.limits[i]) continue;
        fail(fmt::format("compare: {} belongs to two pictures", picture_metrics()[i].flag));
    }
}

void check_pictures(const CompareOptions& options) {
    const std::vector<std::string> given = options.scene.given();
    if (!given.empty()) {
        fail(
            fmt::format("compare: {} belongs to scenes; two pictures are compared on stdout", given.front()));
    }
    if (options.inputs.size() != 2) {
        fail(
            "compare: two pictures are needed, the one under test and its reference, or one scene "
            "(.gltf or .glb)");
    }
    if (!options.flip_map.empty() && std::filesystem::path(options.flip_map).extension() != ".png") {
        fail(fmt::format("--flip-map '{}': only .png can be written", options.flip_map));
    }
}

Comparison measure(const CompareOptions& options, const PictureLayer& test, const PictureLayer& reference) {
    const int width = test.image.width(), height = test.image.height();
    Comparison comparison;
    PictureMetrics& metrics = comparison.metrics;
    metrics.image = core::compare_images(test.radiance, reference.radiance);
    comparison.flip = core::flip_hdr(test.radiance, reference.radiance, width, height);
    metrics.flip = comparison.flip.mean;
    if (core::is_low_dynamic_range(test.radiance) && core::is_low_dynamic_range(reference.radiance)) {
        metrics.flip_ldr = core::flip_ldr(test.radiance, reference.radiance, width, height).mean;
    }
    metrics.ssim = core::ssim(test.radiance, reference.radiance, width, height);
    // The variance belongs to the beauty.
    if (options.layer.empty() && reference.image.color("Variance")) {
        metrics.corrected = core::corrected_rel_mse(test.image, reference.image);
        comparison.reference_noise = core::noise_rel_mse(reference.image);
    }
    comparison.black_reference =
        std::none_of(reference.radiance.begin(), reference.radiance.end(),
                     [](const glm::vec3& color) { return core::luminance(color) > 0.0f; });
    return comparison;
}

nlohmann::json report_of(const Comparison& comparison) {
    nlohmann::json report = metrics_json(comparison.metrics, true);
    report["schema"] = 1;
    const core::LeakMetric& leak = comparison.metrics.image.leak;
    report["leak_details"] = {{"mean", leak.mean},
                              {"p99.9", leak.p99_9},
                              {"dark_pixels", leak.dark_pixels},
                              {"lit_bias", leak.lit_bias_percent},
                              {"counts", leak.counts}};
    const core::FlipResult& flip = comparison.flip;
    report["flip_details"] = {{"weighted_median", flip.weighted_median},
                              {"first_quartile", flip.first_quartile},
                              {"third_quartile", flip.third_quartile},
                              {"min", flip.min},
                              {"max", flip.max},
                              {"exposures", flip.exposures}};
    report["rel_mse_corrected_details"] = {{"low", comparison.metrics.corrected.low},
                                           {"high", comparison.metrics.corrected.high},
                                           {"reference_noise", comparison.reference_noise}};
    return report;
}

std::string table_of(const Comparison& comparison) {
    std::string text;
    const core::ImageMetrics& metrics = comparison.metrics.image;
    for (const PictureMetric& row : picture_metrics()) {
        const double value = row.value(comparison.metrics);
        const bool undefined = std::isnan(value) && metrics.nonfinite_pixels == 0 && row.undefined;
        const std::string line =
            undefined ? fmt::format("{:<21} {:>12}   not defined: {}", row.label, "-", row.undefined)
                      : fmt::format("{:<21} {:>12.6g}   {}", row.label, value, row.definition);
        text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
    }
    if (!std::isnan(comparison.metrics.corrected.value)) {
        text += fmt::format("{:<21} {:>12}   {:.6g} to {:.6g}; the reference's noise makes {:.6g}\n",
                            "  95 % interval", "", comparison.metrics.corrected.low,
                            comparison.metrics.corrected.high, comparison.reference_noise);
    }
    const core::FlipResult& flip = comparison.flip;
    text += fmt::format(
        "{:<21} {:>12.6g}   weighted: half of the error lies in pixels up to this; quartiles {:.6g} and "
        "{:.6g}; "
        "from {:.6g} to {:.6g}\n",
        "FLIP, median", flip.weighted_median, flip.first_quartile, flip.third_quartile, flip.min, flip.max);
    const core::LeakMetric& leak = metrics.leak;
    text += fmt::format(
        "{:<21} {:>12.6g}   over {} dark pixels; P99.9 {:.6g}; {}\n", "leak, mean", leak.mean,
        leak.dark_pixels, leak.p99_9,
        leak.counts ? "the lit side is right within 2 %"
                    : fmt::format("does not count: the lit side is off by {:.3g} %", leak.lit_bias_percent));
    text += fmt::format("{:<21} {:>12}   in the test {}, in the reference {}\n", "non-finite pixels",
                        metrics.nonfinite_pixels, metrics.nonfinite_test_pixels,
                        metrics.nonfinite_reference_pixels);
    return text;
}

/// Why one number is beyond its threshold, or nothing.
std::optional<std::string> failure_of(const PictureMetric& row, double threshold,
                                      const Comparison& comparison) {
    const double value = row.value(comparison.metrics);
    if (std::isnan(value) && row.undefined) {
        return fmt::format("{} is not defined, since {}; {} cannot hold", row.label, row.undefined, row.flag);
    }
    // Written so that a value that is not a number fails.
    if (row.limit == Limit::kSmallest) {
        if (value >= threshold) return std::nullopt;
        return fmt::format("{} is {:.6g}, {} wants {:.6g}", row.label, value, row.flag, threshold);
    }
    if (row.limit == Limit::kUpperEnd) {
        if (comparison.metrics.corrected.high <= threshold) return std::nullopt;
        return fmt::format("{} may be {:.6g}, {} allows {:.6g}", row.label, comparison.metrics.corrected.high,
                           row.flag, threshold);
    }
    if (!(std::abs(value) <= threshold)) {
        return fmt::format("{} is {:.6g}, {} allows {:.6g}", row.label, value, row.flag, threshold);
    }
    const core::LeakMetric& leak = comparison.metrics.image.leak;
    if (std::string_view(row.key) == "leak" && !leak.counts) {
        return fmt::format("leak does not count, since the lit side is off by {:.3g} %",
                           leak.lit_bias_percent);
    }
    return std::nullopt;
}

/// Of a threshold's flag.
std::string help_of(const PictureMetric& row) {
    const std::string definition = *row.definition ? fmt::format(" = {}", row.definition) : "";
    switch (row.limit) {
        case Limit::kSmallest:
            return fmt::format("Fail where {} is smaller{}", row.label, definition);
        case Limit::kUpperEnd:
            return fmt::format("Fail where the upper end of the 95 % interval of {} is larger{}", row.label,
                               definition);
        case Limit::kSize:
            break;
    }
    return fmt::format("Fail where |{}| is larger{}", row.label, definition);
}

/// What makes the comparison fail, one line each.
std::vector<std::string> failures_of(const CompareOptions& options, const Comparison& comparison) {
    const core::ImageMetrics& metrics = comparison.metrics.image;
    std::vector<std::string> failures;
    if (metrics.nonfinite_pixels > 0) {
        failures.push_back(fmt::format("{} pixels are not finite ({} in the test, {} in the reference)",
                                       metrics.nonfinite_pixels, metrics.nonfinite_test_pixels,
                                       metrics.nonfinite_reference_pixels));
        return failures;
    }
    for (std::size_t i = 0; i < options.limits.size(); ++i) {
        if (!options.limits[i]) continue;
        if (auto failure = failure_of(picture_metrics()[i], *options.limits[i], comparison)) {
            failures.push_back(std::move(*failure));
        }
    }
    return failures;
}

/// What makes the numbers say less than they seem to, one line each.
std::vector<std::string> warnings_of(const CompareOptions& options, const Comparison& comparison) {
    std::vector<std::string> warnings;
    if (comparison.metrics.image.nonfinite_pixels > 0) return warnings;  // That is a failure.
    if (comparison.black_reference) {
        warnings.emplace_back(
            "the reference is black: nothing is relative to it, and FLIP is exposed for the test");
    }
    constexpr double kNoiseShare = 0.2;  // Of any gate.
    for (std::size_t i = 0; i < options.limits.size(); ++i) {
        const std::string_view key = picture_metrics()[i].key;
        if (!options.limits[i] || (key != "rel_mse" && key != "rel_mse_corrected")) continue;
        if (comparison.reference_noise > kNoiseShare * *options.limits[i]) {
            warnings.push_back(fmt::format(
                "the reference's own noise makes a relMSE of {:.3g}, more than a fifth of what {} allows; a "
                "reference with more samples is right",
                comparison.reference_noise, picture_metrics()[i].flag));
        }
    }
    return warnings;
}

void write_flip_map(const std::string& path, const core::FlipResult& flip, int width, int height) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(3 * flip.map.size());
    for (const float error : flip.map) {
        const glm::vec3 color = core::magma(error);
        for (int i = 0; i < 3; ++i) bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * color[i])));
    }
    core::write_png(path, width, height, bytes);
}

void compare(const CompareOptions& options, Program& program) {
    if (std::any_of(options.inputs.begin(), options.inputs.end(), core::is_scene_file)) {
        check_scene(options);
        compare_scene(program, options.scene.understand(options.inputs.front()));
        return;
    }
    check_pictures(options);
    const std::string &test_path = options.inputs[0], &reference_path = options.inputs[1];
    const PictureLayer test = read_picture_layer(test_path, options.layer);
    const PictureLayer reference = read_picture_layer(reference_path, options.layer);
    if (test.window != reference.window) {
        const core::ExrWindow &a = test.window, &b = reference.window;
        throw core::InputError(
            core::ErrorKind::kBadData,
            fmt::format(
                "'{}' has {} x {} pixels from ({}, {}), '{}' has {} x {} from ({}, {}); only equal sizes and "
                "places can be compared",
                test_path, test.image.width(), test.image.height(), a.min_x, a.min_y, reference_path,
                reference.image.width(), reference.image.height(), b.min_x, b.min_y));
    }
    const Comparison comparison = measure(options, test, reference);
    const std::vector<std::string> failures = failures_of(options, comparison);
    const std::vector<std::string> warnings = warnings_of(options, comparison);
    if (!options.flip_map.empty()) {
        write_flip_map(options.flip_map, comparison.flip, test.image.width(), test.image.height());
    }
    if (program.common.json) {
        nlohmann::json report = report_of(comparison);
        report["failures"] = failures;
        report["warnings"] = warnings;
        std::fputs((report.dump() + "\n").c_str(), stdout);
    } else {
        std::fputs(table_of(comparison).c_str(), stdout);
    }
    for (const std::string& warning : warnings) warn(program, warning);
    for (const std::string& failure : failures) {
        std::fputs(fmt::format("fieldlight: failed: {}\n", failure).c_str(), stderr);
    }
    if (!warnings.empty()) program.exit_code = kExitWarned;
    if (!failures.empty()) program.exit_code = kExitThresholdFailed;
}

}  // namespace

void add_compare_command(CLI::App& app, Program& program) {
    const auto options = std::make_shared<CompareOptions>();
    CLI::App& verb = *app.add_subcommand(
        "compare",
        "Measure how far a picture is from its reference, exit code 1 where the numbers come with a warning, "
        "2 "
        "where a threshold is exceeded; or fields with triangles and the gather with the path tracer on a "
        "scene, accuracy against time");
    add_common_options(verb, program.common);
    verb.add_option("pictures", options->inputs,
                    "The picture under test, then its reference: .exr or .hdr; or one scene: .gltf or .glb")
        ->required()
        ->expected(1, 2)
        ->type_name("TEST REFERENCE | SCENE");
    verb.add_option("--layer", options->layer, "Colour layer, such as Direct; the beauty if not given");
    verb.add_option(
        "--flip-map", options->flip_map,
        "Write the HDR FLIP error of every pixel as a .png: black 0 to pale yellow 1 (magma); pixels "
        "that are not finite come out magenta");
    options->scene.add_to(verb);
    for (std::size_t i = 0; i < options->limits.size(); ++i) {
        const PictureMetric& row = picture_metrics()[i];
        verb.add_option(row.flag, options->limits[i], help_of(row))
            ->check(CLI::NonNegativeNumber)
            ->group("Thresholds (any pixel that is not finite fails, too)");
    }
    verb.footer(
        "I is the picture under test, R the reference, Y Rec. 709 luminance. Means run over pixels and "
        "channels.\n"
        "FLIP: Andersson et al., HPG 2020 and Eurographics 2021; its exposures come from the reference.\n"
        "relMSE, corrected, needs the reference's Variance.R, .G, .B; its interval is a jackknife over "
        "blocks of "
        "pixels.\n"
        "Exit code 1 warns: the reference is black, or its own noise makes more than a fifth of what a "
        "threshold "
        "on relMSE allows; of a scene: a mesh could not be baked, rays ran out of steps, or that same fifth "
        "of a "
        "relMSE of 0.0025.\n"
        "Examples:\n"
        "  fieldlight compare noisy.exr reference.exr\n"
        "  fieldlight compare sdf.exr triangles.exr --fail-rel-mse 0.01 --fail-energy-bias 1 --json\n"
        "  fieldlight compare sdf.exr triangles.exr --flip-map flip.png --fail-flip 0.05\n"
        "  fieldlight compare assets/two_rooms.glb -o report\n"
        "  fieldlight compare room.glb -o report --sky 500,600,800 --sun 30,40,60000 --resolutions 128,256 "
        "--max-spp 32\n"
        "  fieldlight compare assets/two_rooms.glb -o report --renderers path,gather --resolutions 128 --set "
        "screen_probes.spacing=8");
    verb.callback([options, &program] { run_verb(program, [&] { compare(*options, program); }); });
}

}  // namespace cli
