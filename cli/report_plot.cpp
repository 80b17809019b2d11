#include "cli/report_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "cli/report_axis.h"
#include "cli/report_markup.h"
#include "cli/report_series.h"

namespace cli {

namespace {

constexpr double kWidth = 960, kHeight = 460;
constexpr double kLeft = 62, kRight = 750, kTop = 30, kBottom = 404;
constexpr double kLabelLeft = kRight + 26;
constexpr double kTargetPercent = 5.0;
constexpr std::size_t kLabelCharacters = 24;

/// A point of the plot, in the units of its axes.
struct PlotPoint {
    double cost = 0.0;
    double error = 0.0, low = 0.0, high = 0.0;  ///< Percent; 0 where it cannot be told from none.
    std::size_t index = 0;                      ///< In the series.
};

struct PlotSeries {
    std::size_t index = 0;  ///< In the report.
    std::vector<PlotPoint> points = {};
    double extra_seconds = 0.0;  ///< What the axis adds to warm time.
};

struct PlotLabel {
    std::size_t series = 0;
    double from_x = 0.0, from_y = 0.0;  ///< The end of the line.
    double y = 0.0;                     ///< Of the middle of the label.
};

double cost_of(const ReportSeries& series, const ReportPoint& point, CostAxis axis) {
    switch (axis) {
        case CostAxis::kWarm:
            return point.seconds;
        case CostAxis::kCold:
            return point.seconds + series.load_seconds + series.bake_seconds + series.build_seconds;
        case CostAxis::kProcessor:
            return point.cpu_seconds;
        case CostAxis::kRays:
            break;
    }
    return static_cast<double>(point.rays) * 1e-6;
}

const char* title_of(CostAxis axis) {
    switch (axis) {
        case CostAxis::kWarm:
            return "wall time of the rendering (warm), s";
        case CostAxis::kCold:
            return "wall time with load, bake and build (cold), s";
        case CostAxis::kProcessor:
            return "processor time over all threads, s";
        case CostAxis::kRays:
            break;
    }
    return "rays, millions";
}

std::vector<PlotSeries> plot_series(const Report& report, CostAxis axis) {
    std::vector<PlotSeries> result;
    for (std::size_t i = 0; i < report.series.size(); ++i) {
        const ReportSeries& series = report.series[i];
        PlotSeries plotted{.index = i};
        if (axis == CostAxis::kCold)
            plotted.extra_seconds = series.load_seconds + series.bake_seconds + series.build_seconds;
        for (std::size_t k = 0; k < series.points.size(); ++k) {
            const ReportPoint& point = series.points[k];
            const double cost = cost_of(series, point, axis);
            if (!(cost > 0.0) || !std::isfinite(cost) || !std::isfinite(point.rel_mse.value)) continue;
            const auto bound = [](double rel_mse, double otherwise) {
                return std::isfinite(rel_mse) ? error_percent(rel_mse) : otherwise;
            };
            const double error = error_percent(point.rel_mse.value);
            plotted.points.push_back({.cost = cost,
                                      .error = error,
                                      .low = bound(point.rel_mse.low, error),
                                      .high = bound(point.rel_mse.high, error),
                                      .index = k});
        }
        if (!plotted.points.empty()) result.push_back(std::move(plotted));
    }
    return result;
}

std::optional<double> floor_percent(const ReportSeries& series) {
    if (!series.floor || !std::isfinite(series.floor->value)) return std::nullopt;
    return error_percent(series.floor->value);
}

/// The axes around all that is drawn, or nothing if there is nothing.
std::optional<std::pair<LogAxis, LogAxis>> axes_around(const Report& report,
                                                       const std::vector<PlotSeries>& all) {
    Range cost, error;
    for (const PlotSeries& series : all) {
        for (const PlotPoint& point : series.points) {
            cost.include(point.cost);
            for (const double value : {point.error, point.low, point.high}) error.include(value);
        }
        if (const auto floor = floor_percent(report.series[series.index])) error.include(*floor);
    }
    if (all.empty()) return std::nullopt;
    error.include(kTargetPercent);
    // The fitted curves go on to the right, to show what more time would bring.
    cost.include(cost.high * 3.0);
    return std::pair{LogAxis(cost, kLeft, kRight), LogAxis(error, kBottom, kTop)};
}

class ErrorPlot {
public:
    ErrorPlot(const Report& report, CostAxis axis, std::vector<PlotSeries> series, LogAxis x, LogAxis y)
        : report_(report), axis_(axis), all_(std::move(series)), x_(x), y_(y) {}

    std::string svg() {
        std::string svg = fmt::format(
            "<svg class=\"plot\" viewBox=\"0 0 {} {}\" role=\"group\" aria-label=\"Relative error in "
            "percent against {}\">\n",
            kWidth, kHeight, title_of(axis_));
        svg += grid() + marks();
        for (const PlotSeries& series : all_) svg += band(series);
        for (const PlotSeries& series : all_) svg += lines(series);
        for (const PlotSeries& series : all_) svg += points(series);
        return svg + labels() + "</svg>\n";
    }

private:
    double y_of(double error) const { return error > 0.0 ? y_.at(error) : kBottom; }

    std::string grid() const {
        std::string svg = "<g class=\"grid\">";
        for (const Tick& tick : x_.ticks())
            svg += fmt::format("<path class=\"{}\" d=\"M{:.1f} {}V{}\"/>",
                               tick.label.empty() ? "minor" : "major", x_.at(tick.value), kTop, kBottom);
        for (const Tick& tick : y_.ticks())
            svg += fmt::format("<path class=\"{}\" d=\"M{} {:.1f}H{}\"/>",
                               tick.label.empty() ? "minor" : "major", kLeft, y_.at(tick.value), kRight);
        svg += fmt::format("<path class=\"frame\" d=\"M{} {}V{}H{}\"/></g>\n<g class=\"ticks\">", kLeft, kTop,
                           kBottom, kRight);
        for (const Tick& tick : x_.ticks())
            if (!tick.label.empty())
                svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                                   x_.at(tick.value), kBottom + 19, tick.label);
        for (const Tick& tick : y_.ticks())
            if (!tick.label.empty())
                svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", kLeft - 9,
                                   y_.at(tick.value) + 4.0, tick.label);
        return svg + fmt::format(
                         "</g>\n<text class=\"axis\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>"
                         "<text class=\"axis\" x=\"6\" y=\"14\">relative error √relMSE, %</text>\n",
                         (kLeft + kRight) / 2.0, kHeight - 14, title_of(axis_));
    }

    /// The error and the time at which the table compares.
    std::string marks() const {
        const double target = y_.at(kTargetPercent);
        std::string svg =
            fmt::format("<g class=\"mark\"><path d=\"M{} {:.1f}H{}\"/><text x=\"{}\" y=\"{:.1f}\">5 %</text>",
                        kLeft, target, kRight, kLeft + 6, target - 5.0);
        if (axis_ == CostAxis::kWarm && x_.contains(report_.equal_seconds)) {
            const double x = x_.at(report_.equal_seconds);
            const bool left = x > (kLeft + kRight) / 2.0;
            svg += fmt::format(
                "<path d=\"M{0:.1f} {1}V{2}\"/><text x=\"{3:.1f}\" y=\"{4}\" text-anchor=\"{5}\">equal time, "
                "{6} s</text>",
                x, kTop, kBottom, left ? x - 6.0 : x + 6.0, kTop + 12, left ? "end" : "start",
                trimmed(report_.equal_seconds));
        }
        const double noise = error_percent(report_.reference_rel_variance);
        if (y_.contains(noise)) {
            svg += fmt::format(
                "<path class=\"noise\" d=\"M{0} {1:.1f}H{2}\"/><text x=\"{3}\" y=\"{4:.1f}\">the "
                "reference's own noise, subtracted</text>",
                kLeft, y_.at(noise), kRight, kLeft + 6, y_.at(noise) - 5.0);
        }
        return svg + "</g>\n";
    }

    std::string band(const PlotSeries& series) const {
        // Where noise of the reference hides the error, only the point at the bottom says so.
        std::vector<PlotPoint> shown;
        std::copy_if(series.points.begin(), series.points.end(), std::back_inserter(shown),
                     [](const PlotPoint& point) { return point.error > 0.0; });
        if (shown.size() < 2) return "";
        std::string corners;
        const auto add = [&](const PlotPoint& point, double error) {
            corners += fmt::format("{:.1f},{:.1f} ", x_.at(point.cost), y_of(error));
        };
        for (const PlotPoint& point : shown) add(point, point.high);
        std::for_each(shown.rbegin(), shown.rend(), [&](const PlotPoint& point) { add(point, point.low); });
        return fmt::format("<polygon class=\"band {}\" points=\"{}\"/>\n",
                           series_class(report_, series.index), corners);
    }

    /// The fit over wall time, else a line from point to point, and the floor.
    std::string lines(const PlotSeries& series) {
        const ReportSeries& source = report_.series[series.index];
        std::string svg = fmt::format("<g class=\"lines {}\">", series_class(report_, series.index));
        PlotLabel label{.series = series.index,
                        .from_x = x_.at(series.points.back().cost),
                        .from_y = y_of(series.points.back().error)};
        const auto floor = floor_percent(source);
        if (floor && y_.contains(*floor)) {
            svg += fmt::format("<path class=\"floor\" d=\"M{:.1f} {:.1f}H{}\"/>",
                               x_.at(series.points.back().cost), y_.at(*floor), kRight);
        }
        const std::string curve = fitted_curve(series, source, label);
        if (!curve.empty()) {
            svg += fmt::format("<path class=\"fit\" d=\"{}\"/>", curve);
        } else if (series.points.size() > 1) {
            std::string path;
            for (const PlotPoint& point : series.points)
                path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', x_.at(point.cost),
                                    y_of(point.error));
            svg += fmt::format("<path class=\"path\" d=\"{}\"/>", path);
        }
        labels_.push_back(label);
        return svg + "</g>\n";
    }

    std::string fitted_curve(const PlotSeries& series, const ReportSeries& source, PlotLabel& label) const {
        const bool wall = axis_ == CostAxis::kWarm || axis_ == CostAxis::kCold;
        if (!wall || !source.floor || !source.variance_seconds) return "";
        const double floor = source.floor->value, variance = source.variance_seconds->value;
        if (!std::isfinite(floor) || !(variance > 0.0)) return "";
        constexpr int kSteps = 96;
        const double begin = std::log(series.points.front().cost), end = std::log(x_.high());
        std::string path;
        for (int i = 0; i <= kSteps; ++i) {
            const double cost = std::exp(begin + (end - begin) * i / kSteps);
            const double warm = cost - series.extra_seconds;
            const double error = warm > 0.0 ? error_percent(floor + variance / warm) : 0.0;
            if (!y_.contains(error)) continue;
            label.from_x = x_.at(cost);
            label.from_y = y_.at(error);
            path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', label.from_x, label.from_y);
        }
        return path;
    }

    std::string points(const PlotSeries& series) const {
        const ReportSeries& source = report_.series[series.index];
        std::string svg = fmt::format("<g class=\"points {}\">\n", series_class(report_, series.index));
        for (const PlotPoint& plotted : series.points) {
            const ReportPoint& point = source.points[plotted.index];
            const double x = x_.at(plotted.cost), y = y_of(plotted.error);
            const std::string error = estimate_text(point.rel_mse);
            const std::string title = fmt::format(
                "{}, {}: {} s wall, {} s CPU, {} million rays; error {} %{}", source.method,
                source.rung_name(point.samples_per_pixel), significant(point.seconds),
                significant(point.cpu_seconds), significant(static_cast<double>(point.rays) * 1e-6), error,
                point.pareto ? "" : "; dominated");
            svg += fmt::format(
                "<a href=\"#run-{0}-{1}\" aria-label=\"{2}\" class=\"{3}\"><title>{2}</title>"
                "<path class=\"interval\" d=\"M{4:.1f} {5:.1f}V{6:.1f}\"/>{7}"
                "<circle class=\"target\" cx=\"{4:.1f}\" cy=\"{8:.1f}\" r=\"11\"/></a>\n",
                series.index, plotted.index, escape_html(title), point.pareto ? "front" : "dominated", x,
                y_of(plotted.high), y_of(plotted.low), series_marker(report_, series.index, x, y, 4.6), y);
        }
        return svg + "</g>\n";
    }

    static std::string estimate_text(const Estimate& rel_mse) {
        const double value = error_percent(rel_mse.value), high = error_percent(rel_mse.high);
        const int decimals = decimals_of(value > 0.0 ? value : high, 3);
        return fmt::format("{} ({} to {})", fixed(value, decimals),
                           fixed(error_percent(rel_mse.low), decimals), fixed(high, decimals));
    }

    /// Names at the ends of the lines, moved apart where they would overlap.
    std::string labels() {
        std::sort(labels_.begin(), labels_.end(), [](const PlotLabel& a, const PlotLabel& b) {
            return std::pair(a.from_y, a.series) < std::pair(b.from_y, b.series);
        });
        const double room = kBottom - kTop;
        const auto count = static_cast<double>(labels_.size());
        const bool two_lines = count * 34.0 <= room;
        const double spacing = std::min(two_lines ? 34.0 : 17.0, room / std::max(count, 1.0));
        spread(spacing);
        std::string svg = "<g class=\"labels\">\n";
        for (const PlotLabel& label : labels_) svg += label_text(label, two_lines);
        return svg + "</g>\n";
    }

    /// Moves labels, sorted by where their lines end, as little as possible (least squares) until neighbours
    /// are `spacing` apart. Less i times the spacing that is isotonic regression: neighbours out of order are
    /// pooled.
    void spread(double spacing) {
        struct Pool {
            double sum = 0.0;
            std::size_t count = 0;
            double mean() const { return sum / static_cast<double>(count); }
        };
        std::vector<Pool> pools;
        for (std::size_t i = 0; i < labels_.size(); ++i) {
            pools.push_back({labels_[i].from_y - spacing * static_cast<double>(i), 1});
            while (pools.size() > 1 && pools[pools.size() - 2].mean() > pools.back().mean()) {
                const Pool last = pools.back();
                pools.pop_back();
                pools.back().sum += last.sum;
                pools.back().count += last.count;
            }
        }
        const double top = kTop + spacing / 2.0;
        const double bottom = kBottom + spacing / 2.0 - spacing * static_cast<double>(labels_.size());
        std::size_t i = 0;
        for (const Pool& pool : pools)
            for (std::size_t k = 0; k < pool.count; ++k, ++i)
                labels_[i].y =
                    std::clamp(pool.mean(), top, std::max(top, bottom)) + spacing * static_cast<double>(i);
    }

    std::string label_text(const PlotLabel& label, bool two_lines) const {
        const ReportSeries& series = report_.series[label.series];
        const auto floor = floor_percent(series);
        std::string svg =
            fmt::format("<g class=\"{}\"><path class=\"leader{}\" d=\"M{:.1f} {:.1f}L{} {:.1f}H{}\"/>",
                        series_class(report_, label.series), label.from_x < kRight - 1.0 ? " far" : "",
                        label.from_x, label.from_y, kLabelLeft - 14.0, label.y, kLabelLeft - 5.0);
        svg += fmt::format("<text x=\"{}\" y=\"{:.1f}\"><title>{}</title>{}", kLabelLeft,
                           label.y + (two_lines && floor ? -2.0 : 4.0), escape_html(series.method),
                           escape_html(shortened(series.method, kLabelCharacters)));
        if (two_lines && floor)
            svg += fmt::format("<tspan class=\"second\" x=\"{}\" dy=\"14\">floor {} %</tspan>", kLabelLeft,
                               significant(*floor));
        return svg + "</text></g>\n";
    }

    const Report& report_;
    CostAxis axis_;
    std::vector<PlotSeries> all_;
    LogAxis x_, y_;
    std::vector<PlotLabel> labels_;
};

}  // namespace

double error_percent(double rel_mse) {
    if (std::isnan(rel_mse)) return rel_mse;
    return 100.0 * std::sqrt(std::max(rel_mse, 0.0));
}

std::string error_plot(const Report& report, CostAxis axis) {
    std::vector<PlotSeries> series = plot_series(report, axis);
    const auto axes = axes_around(report, series);
    if (!axes) return "";
    return ErrorPlot(report, axis, std::move(series), axes->first, axes->second).svg();
}

}  // namespace cli
