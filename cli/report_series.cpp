#include "cli/report_series.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <numbers>

#include "cli/report_markup.h"

namespace cli {

namespace {

constexpr std::size_t kColors = 8;

bool is_paths_on_triangles(const ReportSeries& series) {
    return series.tracer == "triangle" && series.renderer != "gather";
}

/// 0 for paths on triangles, 1 to 7 for the others in their order.
std::size_t place_of(const Report& report, std::size_t series) {
    assert(series < report.series.size());
    if (is_paths_on_triangles(report.series[series])) return 0;
    std::size_t others = 0;
    for (std::size_t i = 0; i < series; ++i) others += !is_paths_on_triangles(report.series[i]);
    return 1 + others % (kColors - 1);
}

/// A regular polygon with its first corner at `angle`, clockwise from the right.
std::string polygon(int corners, double angle, double x, double y, double radius) {
    std::string points;
    for (int i = 0; i < corners; ++i) {
        const double at = angle + 2.0 * std::numbers::pi * i / corners;
        points += fmt::format("{}{:.2f},{:.2f}", i ? " " : "", x + radius * std::cos(at),
                              y + radius * std::sin(at));
    }
    return fmt::format("<polygon class=\"marker\" points=\"{}\"/>", points);
}

}  // namespace

std::string series_class(const Report& report, std::size_t series) {
    return fmt::format("s{}", place_of(report, series));
}

std::string series_marker(const Report& report, std::size_t series, double x, double y, double radius) {
    constexpr double kUp = -std::numbers::pi / 2.0, kDown = std::numbers::pi / 2.0;
    // Corners stick out, so polygons are larger than the circle that looks as heavy.
    switch (place_of(report, series)) {
        case 0:
            return polygon(3, kUp, x, y + 0.15 * radius, 1.4 * radius);
        case 2:
            return polygon(4, kUp / 2.0, x, y, 1.25 * radius);
        case 3:
            return polygon(4, kUp, x, y, 1.35 * radius);
        case 4:
            return polygon(3, kDown, x, y - 0.15 * radius, 1.4 * radius);
        case 5:
            return polygon(5, kUp, x, y, 1.25 * radius);
        case 6:
            return polygon(6, 0.0, x, y, 1.2 * radius);
        case 7:
            return polygon(3, 0.0, x, y, 1.4 * radius);
        default:
            return fmt::format("<circle class=\"marker\" cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\"/>", x, y,
                               radius);
    }
}

std::string series_name(const Report& report, std::size_t series) {
    return fmt::format(
        "<svg class=\"key {}\" viewBox=\"0 0 14 14\" width=\"14\" height=\"14\" "
        "aria-hidden=\"true\">{}</svg>{}",
        series_class(report, series), series_marker(report, series, 7.0, 7.0, 4.6),
        escape_html(report.series[series].method));
}

}  // namespace cli
