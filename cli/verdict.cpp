#include "cli/verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "core/image/error_estimate.h"

namespace cli {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

bool overlap(const Estimate& a, const Estimate& b) {
    return a.low <= b.high && b.low <= a.high;
}

std::string text_of(const Estimate& estimate) {
    return fmt::format("{:.3g} [{:.3g}, {:.3g}]", estimate.value, estimate.low, estimate.high);
}

void mark_pareto(Report& report) {
    for (ReportSeries& series : report.series) {
        for (ReportPoint& point : series.points) {
            const auto beats = [&](const ReportPoint& other) {
                return other.rel_mse.value < point.rel_mse.value && other.seconds <= point.seconds;
            };
            point.pareto =
                std::none_of(report.series.begin(), report.series.end(), [&](const ReportSeries& other) {
                    return std::any_of(other.points.begin(), other.points.end(), beats);
                });
        }
    }
}

/// The time after which floor + slope / t falls to `error`.
double time_to(double error, double floor, double slope) {
    return floor < error ? slope / (error - floor) : kNever;
}

Estimate scaled(const core::ErrorInterval& interval, double factor) {
    return {factor * interval.value, factor * interval.low, factor * interval.high};
}

void fit(ReportSeries& series) {
    // Over samples, to which time is proportional but for the noise of the machine; that would end up in the
    // floor.
    std::vector<double> samples, errors;
    for (const ReportPoint& point : series.points) {
        samples.push_back(point.samples_per_pixel);
        errors.push_back(point.rel_mse.value);
    }
    const std::optional<core::ErrorFit> found = core::fit_error_over_time(samples, errors);
    if (!found) return;
    const ReportPoint& longest = series.points.back();
    series.floor = scaled(found->floor, 1.0);
    series.variance_seconds = scaled(found->slope, longest.seconds / longest.samples_per_pixel);
    const Estimate &floor = *series.floor, &slope = *series.variance_seconds;
    const Estimate time{time_to(kFivePercentRelMse, floor.value, slope.value),
                        time_to(kFivePercentRelMse, floor.low, slope.low),
                        time_to(kFivePercentRelMse, floor.high, slope.high)};
    if (time.value < kNever) series.seconds_to_5_percent = time;
}

/// The finest fields with a fit; nothing where there are none.
const ReportSeries* finest_fields(const Report& report) {
    const ReportSeries* finest = nullptr;
    for (const ReportSeries& series : report.series) {
        if (series.resolution > 0 && series.floor && (!finest || series.resolution > finest->resolution)) {
            finest = &series;
        }
    }
    return finest;
}

std::string floor_sentence(const Report& report) {
    const ReportSeries* fields = finest_fields(report);
    if (!fields) return "there are too few rungs to tell the floor of fields";
    if (!(fields->floor->low > 0.0)) {
        return fmt::format("a floor of {} cannot be told from 0 (at most {:.3g})", fields->method,
                           fields->floor->high);
    }
    return fmt::format("no time brings {} below a relMSE of {}, its floor", fields->method,
                       text_of(*fields->floor));
}

}  // namespace

std::optional<Estimate> error_at(const ReportSeries& series, double seconds) {
    const std::vector<ReportPoint>& points = series.points;
    // From the back, since noise may make a rung quicker than the one before it.
    const auto reached = std::find_if(points.rbegin(), points.rend(),
                                      [&](const ReportPoint& point) { return point.seconds <= seconds; });
    if (reached == points.rend()) return std::nullopt;
    if (reached == points.rbegin()) return reached->rel_mse;
    const ReportPoint &before = *reached, &after = *std::prev(reached);
    const double share =
        (1.0 / before.seconds - 1.0 / seconds) / (1.0 / before.seconds - 1.0 / after.seconds);
    const auto between = [&](double from, double to) { return from + share * (to - from); };
    return Estimate{between(before.rel_mse.value, after.rel_mse.value),
                    between(before.rel_mse.low, after.rel_mse.low),
                    between(before.rel_mse.high, after.rel_mse.high)};
}

std::string verdict_of(const Report& report) {
    std::vector<const ReportSeries*> judged;
    for (const ReportSeries& series : report.series) {
        if (series.rel_mse_at_equal_time) judged.push_back(&series);
    }
    std::sort(judged.begin(), judged.end(), [](const ReportSeries* a, const ReportSeries* b) {
        return a->rel_mse_at_equal_time->value < b->rel_mse_at_equal_time->value;
    });
    const std::string floor = floor_sentence(report);
    if (judged.size() < 2) {
        return fmt::format("No two methods reached a common time, so that there is no winner; {}.", floor);
    }
    const Estimate& best = *judged.front()->rel_mse_at_equal_time;
    std::vector<std::string> tied;
    for (const ReportSeries* series : judged) {
        if (overlap(best, *series->rel_mse_at_equal_time)) {
            tied.push_back(fmt::format("{} at {}", series->method, text_of(*series->rel_mse_at_equal_time)));
        }
    }
    if (tied.size() > 1) {
        return fmt::format(
            "At equal time ({:.3g} s of rendering) there is no winner, because the 95 % intervals of relMSE "
            "overlap: {}; {}.",
            report.equal_seconds, fmt::join(tied, ", "), floor);
    }
    const ReportSeries& second = *judged[1];
    return fmt::format(
        "At equal time ({:.3g} s of rendering) the least error is that of {}: relMSE {} against {} of {}, "
        "the "
        "next best; {}.",
        report.equal_seconds, judged.front()->method, text_of(best), text_of(*second.rel_mse_at_equal_time),
        second.method, floor);
}

void judge(Report& report) {
    mark_pareto(report);
    report.equal_seconds = kNever;
    for (ReportSeries& series : report.series) {
        fit(series);
        double longest = 0.0;
        for (const ReportPoint& point : series.points) longest = std::max(longest, point.seconds);
        report.equal_seconds = std::min(report.equal_seconds, longest);
    }
    if (report.series.empty()) report.equal_seconds = 0.0;
    for (ReportSeries& series : report.series) {
        series.rel_mse_at_equal_time = error_at(series, report.equal_seconds);
    }
    if (report.reference_rel_variance > kReferenceShare * kFivePercentRelMse) {
        report.warnings.push_back(fmt::format(
            "the reference is noisy: its variance makes a relMSE of {:.3g}, more than {:.0f} % of the {:.4g} "
            "that counts as 5 % off; --reference-spp {} would do",
            report.reference_rel_variance, 100.0 * kReferenceShare, kFivePercentRelMse,
            // Noise falls with the samples at least.
            static_cast<long>(report.reference_samples * report.reference_rel_variance /
                              (kReferenceShare * kFivePercentRelMse)) +
                1));
    }
    report.verdict = verdict_of(report);
}

}  // namespace cli
