#include "cli/verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <utility>

#include "core/image/block_errors.h"
#include "core/image/error_estimate.h"

namespace cli {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

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

Estimate scaled(const core::ErrorInterval& interval, double factor = 1.0) {
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
    series.floor = scaled(found->floor);
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

/// The rungs between which a time lies, as floor + v / t through both; the same rung twice where it is the
/// last.
struct Reached {
    const ReportPoint& before;
    const ReportPoint& after;
    double share = 0.0;  ///< Of `after`.
};

std::optional<Reached> reached_at(const ReportSeries& series, double seconds) {
    const std::vector<ReportPoint>& points = series.points;
    // From the back, since noise may make a rung quicker than the one before it.
    const auto reached = std::find_if(points.rbegin(), points.rend(),
                                      [&](const ReportPoint& point) { return point.seconds <= seconds; });
    if (reached == points.rend()) return std::nullopt;
    if (reached == points.rbegin()) return Reached{*reached, *reached};
    const ReportPoint &before = *reached, &after = *std::prev(reached);
    return Reached{before, after,
                   (1.0 / before.seconds - 1.0 / seconds) / (1.0 / before.seconds - 1.0 / after.seconds)};
}

/// Series that reached the common time, by ascending error there.
std::vector<const ReportSeries*> judged_series(const Report& report) {
    std::vector<const ReportSeries*> judged;
    for (const ReportSeries& series : report.series) {
        if (series.rel_mse_at_equal_time) judged.push_back(&series);
    }
    std::stable_sort(judged.begin(), judged.end(), [](const ReportSeries* a, const ReportSeries* b) {
        return a->rel_mse_at_equal_time->value < b->rel_mse_at_equal_time->value;
    });
    return judged;
}

/// What the rungs of a series but those in `taken` say of its errors: their weighted sum, the more samples
/// the more. Empty where there are no others.
core::BlockErrors errors_of_other_rungs(const ReportSeries& series, const std::set<std::uint64_t>& taken) {
    core::BlockErrors sum;
    for (const ReportPoint& point : series.points) {
        if (taken.count(point.seed)) continue;
        // The noise of a squared error falls with the square of the samples.
        core::accumulate(sum, point.blocks, std::pow(point.samples_per_pixel, 2.0));
    }
    return sum;
}

/// What `worse` has more than `better` after `seconds`, paired.
core::ErrorInterval difference_at(const ReportSeries& worse, const ReportSeries& better, double seconds,
                                  int reference_samples) {
    // Rungs of equal seeds share random numbers, whatever the method.
    std::set<std::uint64_t> taken;
    int samples = 0;
    const auto errors = [&](const ReportSeries& series) {
        const Reached reached = *reached_at(series, seconds);
        taken.insert({reached.before.seed, reached.after.seed});
        samples = std::max(samples, reached.after.samples_per_pixel);
        return core::mixed(reached.before.blocks, reached.after.blocks, reached.share);
    };
    const core::BlockErrors more = errors(worse), less = errors(better);
    std::vector<core::BlockErrors> predictors;
    for (const ReportSeries* series : {&worse, &better}) {
        core::BlockErrors others = errors_of_other_rungs(*series, taken);
        if (!others.sums.empty()) predictors.push_back(std::move(others));
    }
    return core::paired_difference(more, less, predictors,
                                   static_cast<double>(samples) / std::max(reference_samples, 1));
}

/// Fills `paired` and `winner`. Every pair has its own 95 %: that a winner must be better than *all* others
/// keeps the chance of a false one at 5 % without a correction for their number.
void compare_in_pairs(Report& report) {
    const std::vector<const ReportSeries*> judged = judged_series(report);
    std::size_t lost_to_first = 0;
    for (std::size_t i = 0; i < judged.size(); ++i) {
        for (std::size_t k = i + 1; k < judged.size(); ++k) {
            PairedComparison pair{judged[i]->method, judged[k]->method,
                                  scaled(difference_at(*judged[k], *judged[i], report.equal_seconds,
                                                       report.reference_samples))};
            pair.decided = pair.difference.low > 0.0;
            if (i == 0 && pair.decided) ++lost_to_first;
            report.paired.push_back(std::move(pair));
        }
    }
    if (judged.size() > 1 && lost_to_first + 1 == judged.size()) report.winner = judged.front()->method;
}

}  // namespace

std::optional<Estimate> error_at(const ReportSeries& series, double seconds) {
    const std::optional<Reached> reached = reached_at(series, seconds);
    if (!reached) return std::nullopt;
    const Estimate &before = reached->before.rel_mse, &after = reached->after.rel_mse;
    if (&before == &after) return before;  // Not inf - inf.
    const auto between = [&](double from, double to) { return from + reached->share * (to - from); };
    return Estimate{between(before.value, after.value), between(before.low, after.low),
                    between(before.high, after.high)};
}

std::string verdict_of(const Report& report) {
    const std::vector<const ReportSeries*> judged = judged_series(report);
    const std::string floor = floor_sentence(report);
    if (judged.size() < 2) {
        return fmt::format("No two methods reached a common time, so that there is no winner; {}.", floor);
    }
    const ReportSeries& best = *judged.front();
    const std::string best_error = fmt::format("{:.3g}", best.rel_mse_at_equal_time->value);
    std::vector<std::string> tied, lost;
    for (const PairedComparison& pair : report.paired) {
        if (pair.better != best.method) continue;
        (pair.decided ? lost : tied).push_back(fmt::format("{} ({})", text_of(pair.difference), pair.worse));
    }
    if (report.winner.empty()) {
        return fmt::format(
            "At equal time ({:.3g} s of rendering) there is no winner: {} came to the smallest relMSE, {}, "
            "but "
            "paired over blocks of pixels what others have more cannot be told from 0: {}; {}.",
            report.equal_seconds, best.method, best_error, fmt::join(tied, ", "), floor);
    }
    return fmt::format(
        "At equal time ({:.3g} s of rendering) the least error is that of {}: relMSE {}; paired over blocks "
        "of "
        "pixels, the others have more by {}; {}.",
        report.equal_seconds, report.winner, best_error, fmt::join(lost, ", "), floor);
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
    compare_in_pairs(report);
    report.verdict = verdict_of(report);
}

}  // namespace cli
