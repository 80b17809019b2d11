#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/options.h"
#include "cli/picture_file.h"
#include "core/image/metrics.h"
#include "core/support/error.h"

namespace cli {

namespace {

constexpr int kExitThresholdFailed = 2;

/// One number of the comparison: where it stands in the JSON, how it is shown, and the flag that limits it.
struct Row {
    const char* key;   ///< Of the JSON, `percentiles` apart.
    const char* flag;  ///< Its threshold: the run fails where the absolute value is larger.
    const char* label;
    const char* definition;
    double (*value)(const core::ImageMetrics&);
};

const Row kRows[] = {
    {"mse", "--fail-mse", "MSE", "mean (I - R)^2", [](const core::ImageMetrics& m) { return m.mse; }},
    {"rel_mse", "--fail-rel-mse", "relMSE", "mean (I - R)^2 / (R^2 + 0.01)",
     [](const core::ImageMetrics& m) { return m.rel_mse; }},
    {"rel_mse_trimmed", "--fail-rel-mse-trimmed", "relMSE, trimmed", "without the worst 0.1 % of the pixels",
     [](const core::ImageMetrics& m) { return m.rel_mse_trimmed; }},
    {"mrse", "--fail-mrse", "MRSE", "mean (I - R)^2 / (R + 0.01)^2, as pbrt",
     [](const core::ImageMetrics& m) { return m.mrse; }},
    {"mape", "--fail-mape", "MAPE", "mean |I - R| / (R + 0.01)",
     [](const core::ImageMetrics& m) { return m.mape; }},
    {"smape", "--fail-smape", "SMAPE", "mean |I - R| / (|I| + |R| + 0.01)",
     [](const core::ImageMetrics& m) { return m.smape; }},
    {"50", "--fail-p50", "relative error P50", "of |Y_I - Y_R| / (Y_R + 0.01) over the pixels",
     [](const core::ImageMetrics& m) { return m.p50; }},
    {"95", "--fail-p95", "relative error P95", "", [](const core::ImageMetrics& m) { return m.p95; }},
    {"99", "--fail-p99", "relative error P99", "", [](const core::ImageMetrics& m) { return m.p99; }},
    {"99.9", "--fail-p99.9", "relative error P99.9", "", [](const core::ImageMetrics& m) { return m.p99_9; }},
    {"max", "--fail-max", "relative error, max", "", [](const core::ImageMetrics& m) { return m.max; }},
    {"energy_bias", "--fail-energy-bias", "energy bias, %", "100 (sum Y_I / sum Y_R - 1)",
     [](const core::ImageMetrics& m) { return m.energy_bias_percent; }},
    {"leak", "--fail-leak", "leak", "sum max(Y_I - Y_R, 0) where R is dark / sum Y_R",
     [](const core::ImageMetrics& m) { return m.leak.energy_fraction; }},
};
constexpr std::size_t kFirstPercentile = 6, kLastPercentile = 9;

struct CompareOptions {
    std::vector<std::string> inputs;
    std::string layer;
    std::string folder;
    std::optional<double> limits[std::size(kRows)];
};

bool is_scene(const std::string& path) {
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
    return extension == ".gltf" || extension == ".glb";
}

void check_inputs(const CompareOptions& options) {
    for (const std::string& input : options.inputs) {
        if (!is_scene(input)) continue;
        throw core::InputError(
            core::ErrorKind::kUsage,
            fmt::format("'{}': comparing the tracers on a scene is not built yet; render it with "
                        "--tracer sdf and --tracer triangle and compare the two .exr files",
                        input));
    }
    if (!options.folder.empty()) {
        throw core::InputError(core::ErrorKind::kUsage,
                               "compare: -o belongs to scenes; two pictures are compared on stdout");
    }
    if (options.inputs.size() != 2) {
        throw core::InputError(core::ErrorKind::kUsage,
                               "compare: two pictures are needed, the one under test and its reference");
    }
}

nlohmann::json report_of(const core::ImageMetrics& metrics) {
    nlohmann::json report = {{"schema", 1}, {"percentiles", nlohmann::json::object()}};
    for (std::size_t i = 0; i < std::size(kRows); ++i) {
        const bool percentile = i >= kFirstPercentile && i <= kLastPercentile;
        (percentile ? report["percentiles"] : report)[kRows[i].key] = kRows[i].value(metrics);
    }
    report["leak_details"] = {{"mean", metrics.leak.mean},
                              {"p99.9", metrics.leak.p99_9},
                              {"dark_pixels", metrics.leak.dark_pixels},
                              {"lit_bias", metrics.leak.lit_bias_percent},
                              {"counts", metrics.leak.counts}};
    report["nonfinite_pixels"] = metrics.nonfinite_pixels;
    return report;
}

void print_table(const core::ImageMetrics& metrics) {
    for (const Row& row : kRows) {
        const std::string line =
            fmt::format("{:<21} {:>12.6g}   {}", row.label, row.value(metrics), row.definition);
        fmt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
    }
    const core::LeakMetric& leak = metrics.leak;
    fmt::print("{:<21} {:>12.6g}   over {} dark pixels; P99.9 {:.6g}; {}\n", "leak, mean", leak.mean,
               leak.dark_pixels, leak.p99_9,
               leak.counts
                   ? "the lit side is right within 2 %"
                   : fmt::format("does not count: the lit side is off by {:.3g} %", leak.lit_bias_percent));
    fmt::print("{:<21} {:>12}   in the test {}, in the reference {}\n", "non-finite pixels",
               metrics.nonfinite_pixels, metrics.nonfinite_test_pixels, metrics.nonfinite_reference_pixels);
}

/// What makes the comparison fail, one line each.
std::vector<std::string> failures_of(const CompareOptions& options, const core::ImageMetrics& metrics) {
    std::vector<std::string> failures;
    if (metrics.nonfinite_pixels > 0) {
        failures.push_back(fmt::format("{} pixels are not finite ({} in the test, {} in the reference)",
                                       metrics.nonfinite_pixels, metrics.nonfinite_test_pixels,
                                       metrics.nonfinite_reference_pixels));
        return failures;
    }
    for (std::size_t i = 0; i < std::size(kRows); ++i) {
        if (!options.limits[i]) continue;
        const double value = kRows[i].value(metrics);
        // Written so that a value that is not a number fails.
        if (!(std::abs(value) <= *options.limits[i])) {
            failures.push_back(fmt::format("{} is {:.6g}, {} allows {:.6g}", kRows[i].label, value,
                                           kRows[i].flag, *options.limits[i]));
        } else if (std::string_view(kRows[i].key) == "leak" && !metrics.leak.counts) {
            failures.push_back(fmt::format("leak does not count, since the lit side is off by {:.3g} %",
                                           metrics.leak.lit_bias_percent));
        }
    }
    return failures;
}

void compare(const CompareOptions& options, Program& program) {
    check_inputs(options);
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
    const core::ImageMetrics metrics = core::compare_images(test.radiance, reference.radiance);
    const std::vector<std::string> failures = failures_of(options, metrics);
    if (program.common.json) {
        nlohmann::json report = report_of(metrics);
        report["failures"] = failures;
        fmt::print("{}\n", report.dump());
    } else {
        print_table(metrics);
    }
    for (const std::string& failure : failures) fmt::print(stderr, "fieldlight: failed: {}\n", failure);
    if (!failures.empty()) program.exit_code = kExitThresholdFailed;
}

}  // namespace

void add_compare_command(CLI::App& app, Program& program) {
    const auto options = std::make_shared<CompareOptions>();
    CLI::App& verb = *app.add_subcommand(
        "compare",
        "Measure how far a picture is from its reference; exit code 2 where a threshold is exceeded");
    add_common_options(verb, program.common);
    verb.add_option("pictures", options->inputs, "The picture under test, then its reference: .exr or .hdr")
        ->required()
        ->expected(1, 2)
        ->type_name("TEST REFERENCE");
    verb.add_option("--layer", options->layer, "Colour layer, such as Direct; the beauty if not given");
    // Not shown: known so that the form for scenes, which is not built yet, is answered plainly.
    verb.add_option("-o", options->folder)->group("");
    for (std::size_t i = 0; i < std::size(kRows); ++i) {
        const Row& row = kRows[i];
        const std::string definition = *row.definition ? fmt::format(" = {}", row.definition) : "";
        verb.add_option(row.flag, options->limits[i],
                        fmt::format("Fail where |{}| is larger{}", row.label, definition))
            ->check(CLI::NonNegativeNumber)
            ->group("Thresholds (any pixel that is not finite fails, too)");
    }
    verb.footer(
        "I is the picture under test, R the reference, Y Rec. 709 luminance. Means run over pixels and "
        "channels.\n"
        "Examples:\n"
        "  fieldlight compare noisy.exr reference.exr\n"
        "  fieldlight compare sdf.exr triangles.exr --fail-rel-mse 0.01 --fail-energy-bias 1 --json");
    verb.callback([options, &program] { run_verb(program, [&] { compare(*options, program); }); });
}

}  // namespace cli
