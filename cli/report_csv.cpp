#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "cli/report.h"

namespace cli {

namespace {

/// A field of RFC 4180: quoted where it holds a separator, a quote or a line break.
std::string field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string result = "\"";
    for (const char letter : text) result += letter == '"' ? std::string("\"\"") : std::string(1, letter);
    return result + "\"";
}

/// Every digit, so that it reads back the same; empty for what is not a number.
std::string field(double value) {
    return std::isfinite(value) ? fmt::format("{}", value) : std::string();
}

struct Column {
    const char* name;
    std::string (*value)(const ReportSeries&, const ReportPoint&);
};

using Series = ReportSeries;
using Point = ReportPoint;

const Column kColumns[] = {
    {"method", [](const Series& s, const Point&) { return field(s.method); }},
    {"tracer", [](const Series& s, const Point&) { return field(s.tracer); }},
    {"resolution", [](const Series& s, const Point&) { return std::to_string(s.resolution); }},
    {"samples_per_pixel", [](const Series&, const Point& p) { return std::to_string(p.samples_per_pixel); }},
    {"seed", [](const Series&, const Point& p) { return std::to_string(p.seed); }},
    {"seconds", [](const Series&, const Point& p) { return field(p.seconds); }},
    {"cpu_seconds", [](const Series&, const Point& p) { return field(p.cpu_seconds); }},
    {"cold_seconds",
     [](const Series& s, const Point& p) {
         return field(s.load_seconds + s.bake_seconds + s.build_seconds + p.seconds);
     }},
    {"rays", [](const Series&, const Point& p) { return std::to_string(p.rays); }},
    {"rel_mse", [](const Series&, const Point& p) { return field(p.rel_mse.value); }},
    {"rel_mse_low", [](const Series&, const Point& p) { return field(p.rel_mse.low); }},
    {"rel_mse_high", [](const Series&, const Point& p) { return field(p.rel_mse.high); }},
    {"rel_mse_measured", [](const Series&, const Point& p) { return field(p.metrics.rel_mse); }},
    {"rel_mse_trimmed", [](const Series&, const Point& p) { return field(p.metrics.rel_mse_trimmed); }},
    {"mse", [](const Series&, const Point& p) { return field(p.metrics.mse); }},
    {"mape", [](const Series&, const Point& p) { return field(p.metrics.mape); }},
    {"smape", [](const Series&, const Point& p) { return field(p.metrics.smape); }},
    {"energy_bias_percent",
     [](const Series&, const Point& p) { return field(p.metrics.energy_bias_percent); }},
    {"leak", [](const Series&, const Point& p) { return field(p.metrics.leak.energy_fraction); }},
    {"flip", [](const Series&, const Point& p) { return field(p.flip); }},
    {"pareto", [](const Series&, const Point& p) { return std::string(p.pareto ? "1" : "0"); }},
    {"command", [](const Series&, const Point& p) { return field(p.command); }},
    {"hit_mode", [](const Series& s, const Point&) { return field(s.hit_mode); }},
    {"renderer", [](const Series& s, const Point&) { return field(s.renderer); }},
};

}  // namespace

std::string report_csv(const Report& report) {
    std::vector<std::string> cells;
    for (const Column& column : kColumns) cells.emplace_back(column.name);
    std::string text = fmt::format("{}\r\n", fmt::join(cells, ","));
    for (const ReportSeries& series : report.series) {
        for (const ReportPoint& point : series.points) {
            cells.clear();
            for (const Column& column : kColumns) cells.push_back(column.value(series, point));
            text += fmt::format("{}\r\n", fmt::join(cells, ","));
        }
    }
    return text;
}

}  // namespace cli
