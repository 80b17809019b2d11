#include <fmt/format.h>

#include <algorithm>

#include "cli/report.h"

namespace cli {

namespace {

std::string or_dash(const std::optional<Estimate>& estimate) {
    return estimate ? fmt::format("{:.3g} [{:.3g}, {:.3g}]", estimate->value, estimate->low, estimate->high)
                    : "-";
}

/// Of the column of methods.
std::size_t method_width(const Report& report) {
    std::size_t width = 14;
    for (const ReportSeries& series : report.series) width = std::max(width, series.method.size() + 2);
    return width;
}

std::string bake_note(const ReportSeries& series) {
    if (series.bake_reused) return " (some fields reused: not the whole price)";
    return series.bake_recorded ? " (as an earlier run recorded)" : "";
}

std::string rungs(const Report& report) {
    const std::size_t width = method_width(report);
    std::string text =
        fmt::format("{:<{}}{:>6}{:>9}{:>9}{:>9}  {:>11} {:<24}{:>8}{:>9}\n", "method", width, "spp",
                    "seconds", "CPU s", "Mrays", "relMSE", "95 % interval", "FLIP", "bias %");
    for (const ReportSeries& series : report.series) {
        for (const ReportPoint& point : series.points) {
            text +=
                fmt::format("{:<{}}{:>6}{:>9.3f}{:>9.3f}{:>9.2f}  {:>11.4g} {:<24}{:>8.4f}{:>9.3f}{}\n",
                            series.method, width, point.samples_per_pixel, point.seconds, point.cpu_seconds,
                            1e-6 * static_cast<double>(point.rays), point.rel_mse.value,
                            fmt::format("[{:.4g}, {:.4g}]", point.rel_mse.low, point.rel_mse.high),
                            point.flip, point.metrics.energy_bias_percent, point.pareto ? "  *" : "");
        }
    }
    return text + "* no method has less error in no more time\n";
}

std::string summary(const Report& report) {
    const std::size_t width = method_width(report);
    std::string text = fmt::format("{:<{}}{:>9}{:>9}{:>9}{:>11}  {:<27}{:<27}{}\n", "method", width, "load s",
                                   "bake s", "build s", "bytes", "floor of relMSE",
                                   fmt::format("relMSE at {:.3g} s", report.equal_seconds), "seconds to 5 %");
    for (const ReportSeries& series : report.series) {
        text += fmt::format("{:<{}}{:>9.2f}{:>9.2f}{:>9.2f}{:>11}  {:<27}{:<27}{}{}\n", series.method, width,
                            series.load_seconds, series.bake_seconds, series.build_seconds, series.bytes,
                            or_dash(series.floor), or_dash(series.rel_mse_at_equal_time),
                            or_dash(series.seconds_to_5_percent), bake_note(series));
    }
    return text;
}

std::string geometry(const Report& report) {
    const std::size_t width = method_width(report);
    std::string text = fmt::format("{:<{}}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}\n", "rays",
                                   width, "miss %", "false %", "beyond %", "shadow %", "dt p50", "dt p99",
                                   "dt max", "beyond", "normal", "steps");
    for (const ReportGeometry& one : report.geometry) {
        text += fmt::format(
            "{:<{}}{:>9.4f}{:>9.4f}{:>9.4f}{:>9.4f}{:>9.4f}{:>9.4f}{:>9.2f}{:>9.4f}{:>8.3f}{:>8.2f}\n",
            one.method, width, one.miss_percent, one.false_hit_percent, one.disagree_beyond_percent,
            one.shadow_disagree_percent, one.p50_voxels, one.p99_voxels, one.max_voxels,
            one.p99_beyond_voxels, one.normal_degrees, one.steps_per_ray);
    }
    return text;
}

}  // namespace

std::string ReportSeries::rung_name(int samples) const {
    if (renderer != "gather") return fmt::format("{} spp", samples);
    return fmt::format("{} frame{}", samples, samples == 1 ? "" : "s");
}

std::string report_text(const Report& report) {
    return rungs(report) + "\n" + summary(report) + "\n" + geometry(report) + "\n" + report.verdict + "\n";
}

}  // namespace cli
