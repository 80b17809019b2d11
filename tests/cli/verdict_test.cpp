// What a report concludes, on numbers made up so that the conclusion is known.
#include "cli/verdict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace {

using cli::Estimate;
using cli::Report;
using cli::ReportPoint;
using cli::ReportSeries;

/// Blocks of a pixel each whose mean is `error`, with noise that is common to all methods of a report, and
/// far larger than the error, and noise of +- `spread` of the error that is `owner`'s alone.
core::BlockErrors blocks_of(double error, double spread, const std::string& owner) {
    core::BlockErrors blocks(core::PixelBlocks(48, 48));
    std::mt19937 common(1), own(static_cast<std::uint32_t>(std::hash<std::string>()(owner)));
    std::normal_distribution<double> normal;
    const double root = std::sqrt(static_cast<double>(blocks.sums.size()));
    double off = 0.0;
    for (double& sum : blocks.sums) {
        sum = spread * error * root * normal(own);
        off += sum / static_cast<double>(blocks.sums.size());
    }
    for (double& sum : blocks.sums) sum += error - off + 100.0 * normal(common);
    blocks.pixels.assign(blocks.sums.size(), 1.0);
    return blocks;
}

/// Rungs of 1, 2, 4, ... samples with relMSE = floor + slope / seconds and an interval of +- `spread` of it;
/// so is, about, that of paired differences.
ReportSeries series(const std::string& method, int resolution, int rungs, double seconds_per_sample,
                    double floor, double slope, double spread = 0.01) {
    ReportSeries result;
    result.method = method;
    result.resolution = resolution;
    for (int i = 0; i < rungs; ++i) {
        ReportPoint point;
        point.samples_per_pixel = 1 << i;
        point.seconds = seconds_per_sample * point.samples_per_pixel;
        const double error = floor + slope / point.seconds;
        point.rel_mse = {error, (1.0 - spread) * error, (1.0 + spread) * error};
        point.seed = static_cast<std::uint64_t>(i);
        point.blocks = blocks_of(error, 0.5 * spread, method + std::to_string(i));
        result.points.push_back(point);
    }
    return result;
}

Report report_of(std::vector<ReportSeries> all) {
    Report report;
    report.reference_samples = 1024;
    report.reference_rel_variance = 1e-5;
    report.series = std::move(all);
    return report;
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Verdict, MarksThePointsThatNothingBeats) {
    const auto at = [](double seconds, double error) {
        ReportPoint point;
        point.seconds = seconds;
        point.rel_mse.value = error;
        point.blocks = blocks_of(error, 0.01, "any");
        return point;
    };
    ReportSeries a, b;
    a.points = {at(1.0, 0.5), at(2.0, 0.3), at(4.0, 0.2)};
    b.points = {at(1.0, 0.4), at(3.0, 0.35), at(8.0, 0.2), at(8.0, 0.1)};
    Report report = report_of({a, b});
    cli::judge(report);
    const auto marks = [](const ReportSeries& one) {
        std::string text;
        for (const ReportPoint& point : one.points) text += point.pareto ? '*' : '.';
        return text;
    };
    EXPECT_EQ(marks(report.series[0]), ".**") << "0.4 after the same second beats 0.5";
    EXPECT_EQ(marks(report.series[1]), "*..*") << "0.3 came before 0.35; at 8 s, 0.1 beats 0.2";
}

TEST(Verdict, KeepsEqualPointsBoth) {
    Report report = report_of({series("a", 0, 3, 1.0, 0.0, 1.0), series("b", 64, 3, 1.0, 0.0, 1.0)});
    cli::judge(report);
    for (const ReportSeries& one : report.series) {
        for (const ReportPoint& point : one.points) EXPECT_TRUE(point.pareto);
    }
}

TEST(Verdict, ReadsErrorsBetweenRungsOffTheirModel) {
    const ReportSeries one = series("a", 0, 4, 0.5, 0.02, 0.3, 0.1);  // 0.5, 1, 2, 4 seconds.
    for (const double seconds : {0.5, 0.7, 1.0, 1.9, 3.0, 4.0}) {
        const auto error = cli::error_at(one, seconds);
        ASSERT_TRUE(error) << seconds;
        EXPECT_NEAR(error->value, 0.02 + 0.3 / seconds, 1e-12);
        EXPECT_NEAR(error->low, 0.9 * error->value, 1e-12);
        EXPECT_NEAR(error->high, 1.1 * error->value, 1e-12);
    }
    EXPECT_FALSE(cli::error_at(one, 0.49));
    EXPECT_NEAR(cli::error_at(one, 100.0)->value, 0.02 + 0.3 / 4.0, 1e-12) << "nothing is made up beyond";
}

TEST(Verdict, NamesTheWinnerAtEqualTimeAndTheFloorOfTheFinestFields) {
    Report report =
        report_of({series("triangles", 0, 7, 0.1, 0.0, 0.01), series("fields 64", 64, 7, 0.3, 0.004, 0.03),
                   series("fields 128", 128, 7, 0.4, 0.001, 0.03)});
    cli::judge(report);
    EXPECT_DOUBLE_EQ(report.equal_seconds, 6.4) << "the last rung of the triangles, which all have reached";
    const ReportSeries &triangles = report.series[0], &coarse = report.series[1], &fine = report.series[2];
    ASSERT_TRUE(triangles.floor && coarse.floor && fine.floor);
    EXPECT_NEAR(triangles.floor->value, 0.0, 1e-9);
    EXPECT_NEAR(coarse.floor->value, 0.004, 1e-9);
    EXPECT_NEAR(fine.floor->value, 0.001, 1e-9);
    EXPECT_NEAR(fine.variance_seconds->value, 0.03, 1e-9);
    EXPECT_NEAR(triangles.rel_mse_at_equal_time->value, 0.01 / 6.4, 1e-9);
    EXPECT_NEAR(fine.rel_mse_at_equal_time->value, 0.001 + 0.03 / 6.4, 1e-9);
    ASSERT_TRUE(triangles.seconds_to_5_percent && fine.seconds_to_5_percent);
    EXPECT_NEAR(triangles.seconds_to_5_percent->value, 0.01 / 0.0025, 1e-6);
    EXPECT_NEAR(fine.seconds_to_5_percent->value, 0.03 / 0.0015, 1e-6);
    EXPECT_FALSE(coarse.seconds_to_5_percent) << "its floor forbids it";
    EXPECT_TRUE(contains(report.verdict, "the least error is that of triangles")) << report.verdict;
    EXPECT_TRUE(contains(report.verdict, "] (fields 128), ")) << report.verdict;
    EXPECT_EQ(report.winner, "triangles");
    ASSERT_EQ(report.paired.size(), 3u);
    const cli::PairedComparison& closest = report.paired.front();
    EXPECT_EQ(closest.better, "triangles");
    EXPECT_EQ(closest.worse, "fields 128");
    EXPECT_TRUE(closest.decided);
    EXPECT_NEAR(closest.difference.value,
                fine.rel_mse_at_equal_time->value - triangles.rel_mse_at_equal_time->value, 1e-9)
        << "a pair's difference is that of the table";
    EXPECT_TRUE(contains(report.verdict, "no time brings fields 128 below a relMSE of 0.001"))
        << report.verdict;
    EXPECT_TRUE(report.warnings.empty());
}

TEST(Verdict, DecidesInPairsWhatSingleIntervalsCannot) {
    Report report = report_of({series("triangles", 0, 5, 0.1, 0.0, 0.010, 0.01),
                               series("fields 64", 64, 5, 0.1, 0.0, 0.011, 0.01)});
    for (ReportSeries& one : report.series) {
        for (ReportPoint& point : one.points) point.rel_mse.low = -1.0, point.rel_mse.high = 1.0;
    }
    cli::judge(report);
    EXPECT_EQ(report.winner, "triangles") << report.verdict;
    EXPECT_TRUE(contains(report.verdict, "the least error is that of triangles")) << report.verdict;
    EXPECT_EQ(report.series[0].rel_mse_at_equal_time->high, 1.0) << "the table keeps its intervals";
}

TEST(Verdict, KnowsNoWinnerWherePairsCannotTell) {
    Report report = report_of({series("triangles", 0, 5, 0.1, 0.0, 0.010, 0.2),
                               series("fields 64", 64, 5, 0.1, 0.0, 0.0105, 0.2),
                               series("fields 128", 128, 5, 0.1, 0.0, 0.100, 0.2)});
    cli::judge(report);
    EXPECT_EQ(report.winner, "");
    EXPECT_TRUE(contains(report.verdict, "there is no winner")) << report.verdict;
    EXPECT_TRUE(contains(report.verdict, "triangles came to")) << report.verdict;
    EXPECT_TRUE(contains(report.verdict, "0.000312 [-")) << report.verdict;
    EXPECT_TRUE(contains(report.verdict, "] (fields 64); ")) << report.verdict;
    EXPECT_FALSE(contains(report.verdict, "(fields 128)")) << "that one has lost: " << report.verdict;
    EXPECT_FALSE(contains(report.verdict, "least error")) << report.verdict;
    EXPECT_TRUE(contains(report.verdict, "cannot be told from 0")) << report.verdict;
}

TEST(Verdict, CallsEqualsATie) {
    Report report =
        report_of({series("triangles", 0, 3, 0.1, 0.0, 0.01), series("fields 64", 64, 3, 0.1, 0.0, 0.01)});
    report.series[1].points = report.series[0].points;
    cli::judge(report);
    EXPECT_EQ(report.winner, "");
    EXPECT_FALSE(report.paired.at(0).decided);
}

TEST(Verdict, FitsNothingToTwoRungs) {
    Report report =
        report_of({series("triangles", 0, 2, 0.1, 0.0, 0.01), series("fields 64", 64, 2, 0.3, 0.004, 0.03)});
    cli::judge(report);
    for (const ReportSeries& one : report.series) {
        EXPECT_FALSE(one.floor);
        EXPECT_FALSE(one.variance_seconds);
        EXPECT_FALSE(one.seconds_to_5_percent);
    }
    EXPECT_TRUE(contains(report.verdict, "too few rungs")) << report.verdict;
}

TEST(Verdict, SaysWhereAMethodWasTooSlowToCompare) {
    Report report =
        report_of({series("triangles", 0, 3, 0.01, 0.0, 0.01), series("fields 64", 64, 3, 1.0, 0.004, 0.03)});
    cli::judge(report);
    EXPECT_TRUE(report.series[0].rel_mse_at_equal_time);
    EXPECT_FALSE(report.series[1].rel_mse_at_equal_time);
    EXPECT_TRUE(contains(report.verdict, "no winner")) << report.verdict;
}

TEST(Verdict, WarnsOfANoisyReference) {
    Report report = report_of({series("triangles", 0, 3, 0.1, 0.0, 0.01)});
    report.reference_rel_variance = 0.9 * cli::kReferenceShare * cli::kFivePercentRelMse;
    cli::judge(report);
    EXPECT_TRUE(report.warnings.empty());
    report.reference_rel_variance = 4.0 * cli::kReferenceShare * cli::kFivePercentRelMse;
    cli::judge(report);
    ASSERT_EQ(report.warnings.size(), 1u);
    EXPECT_TRUE(contains(report.warnings[0], "--reference-spp 4096") ||
                contains(report.warnings[0], "--reference-spp 4097"))
        << report.warnings[0];
}

}  // namespace
