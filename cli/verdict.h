// cli/verdict.h: what follows from the numbers of a report: Pareto front, fits, equal time, one sentence.
#pragma once

#include <optional>
#include <string>

#include "cli/report.h"

namespace cli {

/// relMSE that counts as 5 % off.
inline constexpr double kFivePercentRelMse = 0.05 * 0.05;

/// Part of that gate that the reference's own variance may take before the report warns.
inline constexpr double kReferenceShare = 0.2;

/// Fills everything that is derived from series, points and the reference's variance: `pareto` of every
/// point, the fits, times to 5 %, `equal_seconds` (the longest time that every series reached), errors there,
/// the paired comparisons and the winner, the verdict; adds a warning where the reference is too noisy.
/// @pre the blocks of all points are equal
void judge(Report& report);

/// The error of a series after `seconds`: of its last rung by then; where there is a later one, between the
/// two as floor + v / t through both. Nothing before its first rung.
std::optional<Estimate> error_at(const ReportSeries& series, double seconds);

/// One sentence: who has less error at equal time, or that no pair decides it; and what the fields' floor is.
/// Expects what judge() fills.
std::string verdict_of(const Report& report);

}  // namespace cli
