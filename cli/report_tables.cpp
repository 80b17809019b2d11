#include "cli/report_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "cli/report_markup.h"
#include "cli/report_plot.h"
#include "cli/report_series.h"
#include "cli/verdict.h"

namespace cli {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Estimate percent_of(const Estimate& rel_mse) {
    return {error_percent(rel_mse.value), error_percent(rel_mse.low), error_percent(rel_mse.high)};
}

Cell missing(std::string reason) {
    return {.value = "–", .note = std::move(reason), .quiet = true};
}

/// Marks the series whose whole interval lies below that of every other; none where they overlap.
void mark_best(const std::vector<std::optional<Estimate>>& estimates, std::size_t column,
               std::vector<std::vector<Cell>>& rows) {
    for (std::size_t i = 0; i < estimates.size(); ++i) {
        if (!estimates[i] || !std::isfinite(estimates[i]->high)) continue;
        std::size_t others = 0, below = 0;
        for (std::size_t k = 0; k < estimates.size(); ++k) {
            if (k == i || !estimates[k] || !std::isfinite(estimates[k]->low)) continue;
            ++others;
            below += estimates[i]->high < estimates[k]->low;
        }
        rows[i][column].strong = others > 0 && below == others;
    }
}

Cell leak_cell(const core::LeakMetric& leak) {
    if (!std::isfinite(leak.energy_fraction)) return missing("the reference is black");
    Cell cell = number_cell(100.0 * leak.energy_fraction);
    if (!leak.counts) {
        cell.quiet = true;
        cell.note =
            fmt::format("does not count: the lit side is off by {} %", significant(leak.lit_bias_percent));
    }
    return cell;
}

Cell time_to_target(const ReportSeries& series) {
    if (series.seconds_to_5_percent) return estimate_cell(*series.seconds_to_5_percent);
    if (!series.floor) return missing("fewer than three points: no fit");
    if (series.floor->value >= kFivePercentRelMse) {
        Cell cell = missing("its floor is above 5 %");
        cell.value = "never";
        return cell;
    }
    return missing("not measured");
}

Cell fitted(const std::optional<Estimate>& estimate) {
    return estimate ? estimate_cell(*estimate) : missing("fewer than three points: no fit");
}

std::optional<Estimate> percent_of(const std::optional<Estimate>& rel_mse) {
    if (!rel_mse) return std::nullopt;
    return percent_of(*rel_mse);
}

/// Marker and name of the series of that method.
std::string name_of(const Report& report, const std::string& method) {
    for (std::size_t i = 0; i < report.series.size(); ++i) {
        if (report.series[i].method == method) return series_name(report, i);
    }
    return escape_html(method);
}

Cell method_cell(const Report& report, std::size_t series) {
    Cell cell{.value = series_name(report, series)};
    const ReportSeries& shown = report.series[series];
    if (shown.median_voxel > 0.0) cell.interval = "median voxel " + significant(shown.median_voxel);
    if (!shown.hit_mode.empty()) cell.interval += fmt::format(", {} hits", shown.hit_mode);
    return cell;
}

/// One measure of the geometry table.
struct Measure {
    const char* name;
    const char* unit;
    const char* definition;
    double (*value)(const ReportGeometry&);
};

const Measure kMeasures[] = {
    {"Miss", "%", "of rays that hit in either tracer: hit by triangles alone",
     [](const ReportGeometry& g) { return g.miss_percent; }},
    {"False hit", "%", "of the same: hit by fields alone",
     [](const ReportGeometry& g) { return g.false_hit_percent; }},
    {"Disagree beyond one voxel", "%", "both kinds, where the ray passes no silhouette within one voxel",
     [](const ReportGeometry& g) { return g.disagree_beyond_percent; }},
    {"Shadow disagreement", "%", "of occlusion queries from the hits",
     [](const ReportGeometry& g) { return g.shadow_disagree_percent; }},
    {"Distance, P50", "voxels", "|Δt| (n·d) where both hit, median",
     [](const ReportGeometry& g) { return g.p50_voxels; }},
    {"Distance, P99", "voxels", "the same, 99th percentile",
     [](const ReportGeometry& g) { return g.p99_voxels; }},
    {"Distance, P99 beyond", "voxels", "the same, beyond one voxel from silhouettes",
     [](const ReportGeometry& g) { return g.p99_beyond_voxels; }},
    {"Distance, largest", "voxels", "of all rays, raw", [](const ReportGeometry& g) { return g.max_voxels; }},
    {"Normal", "°", "mean angle between the two normals, beyond silhouettes",
     [](const ReportGeometry& g) { return g.normal_degrees; }},
    {"Steps", "a ray", "mean steps of the march through fields",
     [](const ReportGeometry& g) { return g.steps_per_ray; }},
    {"Exhausted", "%", "of rays: out of steps, neither hit nor miss",
     [](const ReportGeometry& g) { return g.exhausted_percent; }},
    {"Triangles", "Mrays/s", "millions of rays a second, one thread, the same rays",
     [](const ReportGeometry& g) { return g.triangle_mrays; }},
    {"Fields", "Mrays/s", "the same through fields", [](const ReportGeometry& g) { return g.field_mrays; }},
};

}  // namespace

std::string summary_table(const Report& report) {
    const std::string at = std::isfinite(report.equal_seconds) && report.equal_seconds > 0.0
                               ? "Error at " + trimmed(report.equal_seconds) + " s"
                               : "Error at equal time";
    const std::vector<Column> columns = {
        {"Method", "", "", true},
        {"Time to 5 %", "s", "wall time of the rendering at which the fitted relative error is 5 %"},
        {at, "%", "relative error at equal wall time"},
        {"Floor b", "%", "relative error that no time removes, from the fit relMSE(t) = b² + v/t"},
        {"Variance v", "s", "time to a relative error of 100 % above the floor, from the same fit"},
        {"FLIP", "", "mean HDR FLIP of the last rung"},
        {"Leak", "%", "light where the reference is dark, of all light; last rung"},
        {"Memory", "MB", "of the acceleration structure"},
        {"Load", "s", "reading the scene"},
        {"Bake", "s", "making the fields"},
        {"Build", "s", "building the acceleration structure"},
    };
    std::vector<std::vector<Cell>> rows;
    std::vector<std::optional<Estimate>> times, floors, variances;
    bool reused = false, recorded = false;
    for (std::size_t i = 0; i < report.series.size(); ++i) {
        const ReportSeries& series = report.series[i];
        times.push_back(series.seconds_to_5_percent);
        floors.push_back(percent_of(series.floor));
        variances.push_back(series.variance_seconds);
        const ReportPoint* last = series.points.empty() ? nullptr : &series.points.back();
        Cell bake = series.tracer == "triangle" ? missing("triangles are not baked")
                                                : seconds_cell(series.bake_seconds);
        if (series.bake_reused) {
            bake.value += "†";
            reused = true;
        } else if (series.bake_recorded) {
            bake.value += "‡";
            recorded = true;
        }
        rows.push_back({method_cell(report, i), time_to_target(series),
                        fitted(percent_of(series.rel_mse_at_equal_time)), fitted(floors.back()),
                        fitted(series.variance_seconds),
                        last && std::isfinite(last->flip) ? number_cell(last->flip) : missing("not defined"),
                        last ? leak_cell(last->metrics.leak) : missing("no points"),
                        number_cell(static_cast<double>(series.bytes) * 1e-6),
                        seconds_cell(series.load_seconds), bake, seconds_cell(series.build_seconds)});
    }
    mark_best(times, 1, rows);
    for (std::size_t i = 0; i < report.series.size(); ++i) {
        rows[i][2].strong = !report.winner.empty() && report.series[i].method == report.winner;
    }
    mark_best(floors, 3, rows);
    mark_best(variances, 4, rows);
    std::string caption =
        "Small: 95 % intervals. Bold: better than every other method beyond both intervals, and for the "
        "error "
        "at equal time in every pair below; otherwise nothing is bold. Grey: does not count.";
    if (reused) caption += " † Some fields came from an earlier run: the whole price is higher.";
    if (recorded) caption += " ‡ The fields came from an earlier run, which recorded their price.";
    return table(caption, columns, rows);
}

std::string paired_table(const Report& report) {
    if (report.paired.empty()) return "";
    const std::vector<Column> columns = {
        {"Less error", "", "method with the smaller relMSE at equal time", true},
        {"More error", "", "method with the larger one", true},
        {"Difference", "relMSE", "what it has more, paired over blocks of pixels"},
        {"Decided", "", "the interval leaves 0 out", true}};
    std::vector<std::vector<Cell>> rows;
    for (const PairedComparison& pair : report.paired) {
        rows.push_back({{.value = name_of(report, pair.better)},
                        {.value = name_of(report, pair.worse)},
                        estimate_cell(pair.difference),
                        {.value = pair.decided ? "yes" : "no", .quiet = !pair.decided}});
    }
    return table("Small: paired 95 % intervals; a method wins where every pair with it is decided.", columns,
                 rows);
}

std::string geometry_table(const Report& report) {
    if (report.geometry.empty()) return "";
    std::vector<Column> columns = {{"Measure", "", "", true}, {"Unit", "", "", true}};
    std::vector<Cell> rays = {{.value = "Rays"}, {}}, either = {{.value = "Hit in either tracer"}, {}};
    for (const ReportGeometry& geometry : report.geometry) {
        columns.push_back({geometry.method, "", "", false});
        rays.push_back({.value = grouped(geometry.rays)});
        either.push_back({.value = grouped(geometry.either)});
    }
    columns.push_back({"Definition", "", "", true});
    const std::string same = "the same for both tracers";
    rays.push_back(
        {.value = report.geometry_rays.empty() ? same : same + ": " + report.geometry_rays, .wrap = true});
    either.push_back({.value = "what the percentages below are of, unless they say otherwise", .wrap = true});
    std::vector<std::vector<Cell>> rows = {rays, either};
    for (const Measure& measure : kMeasures) {
        std::vector<Cell> row = {{.value = measure.name}, {.value = measure.unit}};
        for (const ReportGeometry& geometry : report.geometry) {
            const double value = measure.value(geometry);
            row.push_back({.value = fixed(value, std::min(decimals_of(value, 3), 4))});
        }
        row.push_back({.value = measure.definition, .wrap = true});
        rows.push_back(std::move(row));
    }
    return table("", columns, rows);
}

std::string stage_table(const Report& report) {
    const std::vector<Column> columns = {
        {"Method", "", "", true},   {"Stage", "", "", true},
        {"Time", "s", "wall time"}, {"Share", "%", "of the method's whole time"},
        {"Rays", "millions", ""},   {"Rate", "Mrays/s", "over all threads"}};
    std::vector<std::vector<Cell>> rows;
    for (std::size_t i = 0; i < report.series.size(); ++i) {
        double total = 0.0;
        for (const StageCost& stage : report.series[i].stages) total += stage.seconds;
        bool first = true;
        for (const StageCost& stage : report.series[i].stages) {
            const double rays = static_cast<double>(stage.rays) * 1e-6;
            rows.push_back({{.value = first ? series_name(report, i) : std::string()},
                            {.value = escape_html(stage.name)},
                            seconds_cell(stage.seconds),
                            {.value = fixed(total > 0.0 ? 100.0 * stage.seconds / total : kNaN, 1)},
                            stage.rays ? number_cell(rays) : Cell{},
                            stage.rays && stage.seconds > 0.0 ? number_cell(rays / stage.seconds) : Cell{}});
            first = false;
        }
    }
    return rows.empty() ? std::string() : table("", columns, rows, true);
}

std::string runs_table(const Report& report) {
    const std::vector<Column> columns = {
        {"Method", "", "", true},
        {"Samples", "a pixel", "of the gather frames; links to the command"},
        {"Seed", "", "of the random numbers: one a rung, the same for all methods", true},
        {"Wall", "s", "wall time of the rendering"},
        {"CPU", "s", "processor time over all threads"},
        {"Rays", "millions", ""},
        {"Error", "%", "100 √relMSE without the reference's variance"},
        {"95 % interval", "%", "of the error"},
        {"FLIP", "", "mean HDR FLIP"},
        {"MAPE", "%", "mean |I − R| / (R + 0.01)"},
        {"P99", "%", "99th percentile of the relative error of a pixel, |Y_I − Y_R| / (|Y_R| + 0.01)"},
        {"Bias", "%", "energy, 100 (sum Y_I / sum Y_R − 1)"},
        {"Leak", "%", "light where the reference is dark, of all light"},
        {"Front", "", "no point of any method has less error in no more time"}};
    std::vector<std::vector<Cell>> rows;
    for (std::size_t i = 0; i < report.series.size(); ++i) {
        for (std::size_t k = 0; k < report.series[i].points.size(); ++k) {
            const ReportPoint& point = report.series[i].points[k];
            const Cell error = estimate_cell(percent_of(point.rel_mse));
            rows.push_back({{.value = k == 0 ? series_name(report, i) : std::string()},
                            {.value = fmt::format(
                                 "<a href=\"#run-{}-{}\">{}</a>", i, k,
                                 grouped(static_cast<std::uint64_t>(std::max(point.samples_per_pixel, 0))))},
                            {.value = fmt::format("{}", point.seed)},
                            seconds_cell(point.seconds),
                            seconds_cell(point.cpu_seconds),
                            number_cell(static_cast<double>(point.rays) * 1e-6),
                            {.value = error.value},
                            {.value = error.interval},
                            number_cell(point.flip),
                            number_cell(100.0 * point.metrics.mape),
                            number_cell(100.0 * point.metrics.p99),
                            number_cell(point.metrics.energy_bias_percent),
                            leak_cell(point.metrics.leak),
                            {.value = point.pareto ? "●" : ""}});
        }
    }
    return table("", columns, rows, true);
}

}  // namespace cli
