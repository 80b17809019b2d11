#include "cli/report_bars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "cli/report_axis.h"
#include "cli/report_markup.h"

namespace cli {

namespace {

constexpr double kWidth = 960, kLeft = 170, kRight = 880, kTop = 10;
constexpr double kBar = 24, kPitch = 38;
constexpr std::size_t kColors = 8, kNameCharacters = 20;
constexpr double kPixelsPerCharacter = 7.5;

double seconds_of(const StageCost& stage) {
    return std::isfinite(stage.seconds) && stage.seconds > 0.0 ? stage.seconds : 0.0;
}

double total_seconds(const ReportSeries& series) {
    double total = 0.0;
    for (const StageCost& stage : series.stages) total += seconds_of(stage);
    return total;
}

std::vector<std::string> stage_names(const Report& report) {
    std::vector<std::string> names;
    for (const ReportSeries& series : report.series)
        for (const StageCost& stage : series.stages)
            if (std::find(names.begin(), names.end(), stage.name) == names.end()) names.push_back(stage.name);
    return names;
}

std::string bar(const ReportSeries& series, const std::vector<std::string>& names, double y, double scale) {
    std::string svg = fmt::format(
        "<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\"><title>{}</title>{}</text>", kLeft - 12,
        y + kBar / 2 + 4, escape_html(series.method), escape_html(shortened(series.method, kNameCharacters)));
    double seconds = 0.0;
    for (const StageCost& stage : series.stages) {
        const auto color =
            static_cast<std::size_t>(std::find(names.begin(), names.end(), stage.name) - names.begin());
        const double x = kLeft + scale * seconds, width = scale * seconds_of(stage);
        seconds += seconds_of(stage);
        svg += fmt::format(
            "<g class=\"t{}\"><title>{}: {} s</title><rect x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" "
            "height=\"{}\"/>",
            color % kColors, escape_html(stage.name), significant(seconds_of(stage)), x, y, width, kBar);
        const std::string label = significant(seconds_of(stage));
        if (width > kPixelsPerCharacter * static_cast<double>(label.size()) + 8.0)
            svg += fmt::format(
                "<text class=\"inside\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>",
                x + width / 2, y + kBar / 2 + 4, label);
        svg += "</g>\n";
    }
    return svg + fmt::format("<text class=\"total\" x=\"{:.1f}\" y=\"{:.1f}\">{} s</text>\n",
                             kLeft + scale * seconds + 8, y + kBar / 2 + 4, significant(seconds));
}

std::string legend(const std::vector<std::string>& names) {
    std::string html = "<p class=\"stages-legend\">";
    for (std::size_t i = 0; i < names.size(); ++i)
        html += fmt::format("<span class=\"t{}\"><i></i>{}</span> ", i % kColors, escape_html(names[i]));
    return html + "</p>\n";
}

}  // namespace

std::string stage_bars(const Report& report) {
    double longest = 0.0;
    std::vector<const ReportSeries*> shown;
    for (const ReportSeries& series : report.series) {
        const double total = total_seconds(series);
        if (total > 0.0) shown.push_back(&series);
        longest = std::max(longest, total);
    }
    if (shown.empty() || !std::isfinite(longest)) return "";
    const std::vector<std::string> names = stage_names(report);
    const double bottom = kTop + kPitch * static_cast<double>(shown.size());
    const double scale = (kRight - kLeft) / longest;
    std::string svg = fmt::format(
        "<svg class=\"bars\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Seconds by stage\">\n<g "
        "class=\"grid\">",
        kWidth, bottom + 46);
    const std::vector<Tick> ticks = linear_ticks(longest, 8);
    for (const Tick& tick : ticks)
        svg += fmt::format("<path class=\"major\" d=\"M{:.1f} {}V{}\"/>", kLeft + scale * tick.value,
                           kTop - 4, bottom);
    svg += "</g>\n<g class=\"ticks\">";
    for (const Tick& tick : ticks)
        svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                           kLeft + scale * tick.value, bottom + 16, tick.label);
    svg += fmt::format(
        "</g>\n<text class=\"axis\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">wall time, s</text>\n",
        (kLeft + kRight) / 2, bottom + 38);
    double y = kTop + (kPitch - kBar) / 2 - 4;
    for (const ReportSeries* series : shown) {
        svg += bar(*series, names, y, scale);
        y += kPitch;
    }
    return legend(names) + "<div class=\"scroll\">" + svg + "</svg></div>\n";
}

}  // namespace cli
