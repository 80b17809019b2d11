#include "tests/cli/sample_report.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "core/image/image.h"

namespace tests {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A smooth picture over six decades, times 1 at the left edge to nearly `factor` at the right, with the
/// values that are easily got wrong in one corner.
std::vector<glm::vec3> radiance(int width, int height, float factor) {
    std::vector<glm::vec3> values;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const float scale = 1.0f + (factor - 1.0f) * static_cast<float>(x) / static_cast<float>(width);
            values.push_back(scale * glm::vec3(std::exp2(0.4f * static_cast<float>(x) - 6.0f),
                                               1.0f + 0.37f * static_cast<float>(x * y),
                                               static_cast<float>(y) * 0.013f));
        }
    }
    values[0] = {-0.0f, std::numeric_limits<float>::denorm_min(), -1.5f};
    values[1] = {std::numeric_limits<float>::max(), 1.0f / 3.0f, 16777217.0f};
    return values;
}

cli::ReportPoint point(int samples, double seconds, double rel_mse, const std::string& command) {
    cli::ReportPoint result;
    result.samples_per_pixel = samples;
    result.seed = 7000 + static_cast<std::uint64_t>(samples);
    result.seconds = seconds;
    result.cpu_seconds = 1.9 * seconds;
    result.rays = static_cast<std::uint64_t>(samples) * 432'100u;
    result.rel_mse = {rel_mse, 0.9 * rel_mse, 1.12 * rel_mse};
    result.metrics.rel_mse = rel_mse;
    result.metrics.mape = std::sqrt(rel_mse);
    result.metrics.p99 = 4.0 * std::sqrt(rel_mse);
    result.metrics.leak.counts = true;
    result.flip = 0.3 * std::pow(rel_mse, 0.25);
    result.pareto = true;
    result.command = command + " --spp " + std::to_string(samples);
    return result;
}

cli::ReportSeries series(const std::string& method, int resolution, int points, double floor,
                         double variance) {
    cli::ReportSeries result;
    result.method = method;
    result.renderer = "path";
    result.tracer = resolution ? "sdf" : "triangle";
    result.resolution = resolution;
    result.median_voxel = resolution ? 4.0 / resolution : 0.0;
    result.load_seconds = 0.0123;
    result.bake_seconds = resolution ? 1.75 : 0.0;
    result.build_seconds = 0.00002;
    result.bytes = 12'345'678;
    for (int i = 0, samples = 1; i < points; ++i, samples *= 2) {
        const double seconds = 0.21 * samples;
        result.points.push_back(
            point(samples, seconds, floor + variance / seconds, "fieldlight render room.glb"));
    }
    if (points >= 3) {
        result.floor = cli::Estimate{floor, 0.5 * floor, 1.5 * floor};
        result.variance_seconds = cli::Estimate{variance, 0.95 * variance, 1.06 * variance};
        const double at = variance / (0.0025 - floor), equal = floor + variance / 3.0;
        if (floor < 0.0025) result.seconds_to_5_percent = cli::Estimate{at, 0.9 * at, 1.1 * at};
        result.rel_mse_at_equal_time = cli::Estimate{equal, 0.9 * equal, 1.1 * equal};
    }
    result.stages = {{"load", 0.0123, 0},
                     {"bake", result.bake_seconds, 0},
                     {"primary", 0.8, 4'000'000},
                     {"shade", 1.9, 0}};
    return result;
}

cli::ReportPicture picture(const std::string& name, const std::string& exr, int width, int height,
                           float factor) {
    cli::ReportPicture result{name, exr, radiance(width, height, factor), {}, {}, {}};
    if (factor == 1.0f) return result;
    const std::vector<glm::vec3> reference = radiance(width, height, 1.0f);
    const auto count = result.radiance.size();
    for (std::size_t i = 0; i < count; ++i) {
        const float part = static_cast<float>(i) / static_cast<float>(count - 1);
        const float truth = core::luminance(reference[i]);
        result.flip.push_back(part);
        result.relative_error.push_back(std::abs(core::luminance(result.radiance[i]) - truth) /
                                        (std::abs(truth) + 0.01f));
        result.steps.push_back(40.0f * part);
    }
    return result;
}

}  // namespace

cli::Report sample_report() {
    cli::Report report;
    report.scene = "room " + kHostileText + ".glb";
    report.scene_hash = "0123456789abcdef";
    report.command = "fieldlight compare 'room.glb' -o out";
    report.version = "0.1.0";
    report.commit = "unknown";
    report.compiler = "a compiler";
    report.flags = "-O3";
    report.processor = "a processor";
    report.isa = "avx2";
    report.system = "Debian";
    report.cores = report.threads = 2;
    report.date = "2025-01-31T12:34:56Z";
    report.width = 48;
    report.height = 36;
    report.camera = "'eye' & all";
    report.reference_samples = 4096;
    report.reference_seconds = 91.5;
    report.reference_rel_variance = 1e-6;
    report.reference_command = "fieldlight render room.glb --spp 4096";
    report.equal_seconds = 3.0;
    report.reference_seed = 1'000'010;
    report.peak_bytes = 765'432'100;
    report.paired = {{"triangles", "fields 128", {0.0071, 0.0065, 0.0077}, true},
                     {"triangles", kHostileText, {0.002, -0.011, 0.015}, false}};
    report.verdict = "Fields need 3.1 times as long as triangles to come within 5 % of the reference.";
    report.warnings = {kHostileText, "the second warning"};

    report.series = {
        series("triangles", 0, 6, 2e-5, 0.01), series("fields 64", 64, 2, 4e-4, 0.03),
        series("fields 128", 128, 6, 1e-4, 0.03), series("fields 256", 256, 1, 5e-5, 0.04),
        series(kHostileText + " of a name that is much too long for a label", 32, 4, 0.01, 0.02)};
    // What cannot be told from the reference's noise, what could not be measured, and what is not defined.
    report.series[0].points.back().rel_mse = {-1e-7, -3e-7, 2e-7};
    report.series[2].points.back().rel_mse = {kNaN, kNaN, kNaN};
    report.series[3].points.back().flip = kNaN;
    report.series[3].points.back().metrics.leak.energy_fraction = kNaN;
    report.series[1].points.front().pareto = false;
    report.series[1].bake_reused = true;
    report.series[1].points.back().metrics.leak = {0.002, 0.1, 0.3, 17, 3.4, false};
    report.series[4].stages.clear();

    cli::ReportGeometry geometry;
    geometry.method = "fields 128";
    geometry.resolution = 128;
    geometry.rays = 200'000;
    geometry.either = 161'234;
    geometry.max_voxels = kNaN;
    geometry.p50_voxels = 0.0031;
    report.geometry = {geometry};

    report.pictures = {picture("reference", "reference.exr", 48, 36, 1.0f),
                       picture("triangles", "triangles.exr", 48, 36, 1.0625f),
                       picture("fields 128", "fields 128.exr", 48, 36, 0.75f),
                       picture(kHostileText, "hostile.exr", 48, 36, 1.5f)};
    report.pictures[1].steps.clear();
    report.pictures[3].radiance[2] = {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity};
    report.pictures[3].flip[2] = std::numeric_limits<float>::quiet_NaN();
    return report;
}

cli::ReportPicture noisy_picture(const std::string& name, int width, int height, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> exponent(-20.0f, 20.0f), unit(0.0f, 1.0f);
    cli::ReportPicture result{name, name + ".exr", {}, {}, {}, {}};
    for (int i = 0; i < width * height; ++i) {
        const auto value = [&] { return std::exp2(exponent(random)); };
        const float red = value(), green = value(), blue = value();
        result.radiance.emplace_back(red, green, blue);
        result.flip.push_back(unit(random));
        result.relative_error.push_back(unit(random));
        result.steps.push_back(90.0f * unit(random));
    }
    return result;
}

}  // namespace tests
