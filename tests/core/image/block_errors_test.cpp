// tests/core/image/block_errors_test.cpp: intervals over blocks, alone and in pairs, where the truth is
// known.
#include "core/image/block_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/image/error_estimate.h"

namespace {

using core::BlockErrors;
using core::ErrorInterval;
using core::PixelBlocks;

/// 400 repetitions: the observed share of a true 95 % has a standard deviation of 1.1 %; four of them.
constexpr int kRepetitions = 400;
constexpr double kLowestCoverage = 0.95 - 4 * 0.011, kHighestCoverage = 0.95 + 4 * 0.011;

/// Two methods on one view, per pixel: what is alike in both, and what is not.
struct View {
    int width = 330, height = 200;  ///< 21 x 13 blocks: the last column of 10 pixels, the last row of 8.
    double error = 1.0;             ///< Of the better method.
    double more = 0.05;             ///< What the other has on top, on average.
    double silhouette = 0.0;        ///< What it has on top in every seventh block, and less in the others.
    double common = 16.0;           ///< Noise of the reference: it is in both. Standard deviation of a pixel.
    double own = 0.8;               ///< Noise of each method.
    double others = 0.8;            ///< Noise of the other rungs, which foretell.
};

struct Pair {
    BlockErrors better, worse;
    std::vector<BlockErrors> predictors;

    ErrorInterval difference() const { return core::paired_difference(worse, better, predictors, 0.0); }
};

Pair measure(const View& view, std::mt19937& random) {
    std::normal_distribution<double> normal;
    const PixelBlocks blocks(view.width, view.height);
    Pair pair{BlockErrors(blocks), BlockErrors(blocks), {BlockErrors(blocks), BlockErrors(blocks)}};
    BlockErrors& pixels = pair.better;
    for (int i = 0; i < view.width * view.height; ++i) {
        pixels.pixels[blocks.of(static_cast<std::size_t>(i))] += 1.0;
    }
    pair.worse.pixels = pair.predictors[0].pixels = pair.predictors[1].pixels = pixels.pixels;
    for (std::size_t i = 0; i < pixels.sums.size(); ++i) {
        const double count = pixels.pixels[i], root = std::sqrt(count);
        const double both = count * view.error + root * view.common * normal(random);
        const double more = count * view.more + 256.0 * view.silhouette * (i % 7 == 3 ? 6.0 : -1.0);
        pair.better.sums[i] = both + root * view.own * normal(random);
        pair.worse.sums[i] = both + more + root * view.own * normal(random);
        // On rungs of half the samples errors are twice as large; the reference is the same.
        pair.predictors[0].sums[i] = both + count * view.error + root * view.others * normal(random);
        pair.predictors[1].sums[i] =
            both + count * view.error + 2.0 * more + root * view.others * normal(random);
    }
    return pair;
}

/// The mean difference without any noise.
double true_difference(View view) {
    view.common = view.own = view.others = 0.0;
    std::mt19937 random(1);
    const Pair pair = measure(view, random);
    return core::mean_error(pair.worse).value - core::mean_error(pair.better).value;
}

bool holds(const ErrorInterval& interval, double value) {
    return interval.low <= value && value <= interval.high;
}

TEST(PixelBlocks, CoverThePictureWithBlocksThatAreEnough) {
    const PixelBlocks large(330, 200);
    EXPECT_EQ(large.columns(), 21);
    EXPECT_EQ(large.rows(), 13);
    EXPECT_EQ(large.of(0), 0u);
    EXPECT_EQ(large.of(329), 20u);
    EXPECT_EQ(large.of(330 * 16 + 15), 21u);
    EXPECT_EQ(large.of(330 * 200 - 1), 21u * 13u - 1u);
    const PixelBlocks small(64, 36);
    EXPECT_EQ(small.columns(), 8) << "blocks of 8 x 8, since 16 x 16 would be 12";
    const PixelBlocks tiny(2, 2);
    EXPECT_EQ(tiny.columns() * tiny.rows(), 4) << "pixels";
}

TEST(PairedDifference, FindsAWinnerThatCommonNoiseHidesFromSingleIntervals) {
    std::mt19937 random(3);
    int decided = 0, overlapping = 0;
    for (int i = 0; i < kRepetitions; ++i) {
        const Pair pair = measure({}, random);
        const ErrorInterval better = core::mean_error(pair.better), worse = core::mean_error(pair.worse);
        overlapping += worse.low <= better.high && better.low <= worse.high;
        const ErrorInterval difference = pair.difference();
        EXPECT_NEAR(difference.value, worse.value - better.value, 1e-9);
        decided += difference.low > 0.0;
    }
    // Standard errors: 16 / sqrt(66,000) = 0.062 of each, sqrt(2) 0.8 / sqrt(66,000) = 0.0044 of the
    // difference.
    EXPECT_EQ(overlapping, kRepetitions);
    EXPECT_EQ(decided, kRepetitions);
}

TEST(PairedDifference, LeavesATieATie) {
    std::mt19937 random(5);
    View view;
    view.more = 0.0;
    int undecided = 0;
    for (int i = 0; i < kRepetitions; ++i) {
        const Pair pair = measure(view, random);
        undecided += holds(pair.difference(), 0.0);
    }
    EXPECT_GE(undecided, kLowestCoverage * kRepetitions);
    EXPECT_LE(undecided, kHighestCoverage * kRepetitions);
}

TEST(PairedDifference, HoldsTheTruthInNinetyFiveOfAHundred) {
    for (const bool foretold : {false, true}) {
        for (const double silhouette : {0.0, 0.5}) {
            if (!foretold && silhouette > 0.0) continue;  // Wider than need be: the next test.
            for (const auto& [width, height] : {std::pair{330, 200}, {40, 20}}) {
                View view;
                view.width = width;
                view.height = height;
                view.silhouette = silhouette;
                view.others = 0.1;  // Predictions that are nearly exact: nothing is left that would widen.
                const double truth = true_difference(view);
                std::mt19937 random(7);
                int held = 0;
                for (int i = 0; i < kRepetitions; ++i) {
                    Pair pair = measure(view, random);
                    if (!foretold) pair.predictors.clear();
                    held += holds(pair.difference(), truth);
                }
                EXPECT_GE(held, kLowestCoverage * kRepetitions) << silhouette << " " << width << foretold;
                EXPECT_LE(held, kHighestCoverage * kRepetitions) << silhouette << " " << width << foretold;
            }
        }
    }
}

TEST(PairedDifference, DoesNotTakeWhatTheViewMakesForUncertain) {
    View view;
    view.silhouette = 0.5;
    const double truth = true_difference(view);
    std::mt19937 random(7);
    int held = 0;
    double foretold = 0.0, alone = 0.0;
    for (int i = 0; i < kRepetitions; ++i) {
        Pair pair = measure(view, random);
        const ErrorInterval interval = pair.difference();
        held += holds(interval, truth);
        foretold += interval.high - interval.low;
        pair.predictors.clear();
        const ErrorInterval without = pair.difference();
        alone += without.high - without.low;
    }
    EXPECT_GE(held, kLowestCoverage * kRepetitions) << "wider, never narrower";
    EXPECT_LT(foretold, 0.2 * alone);
}

TEST(PairedDifference, IsNotMisledByPredictionsThatAreWorthNothing) {
    View view;
    view.others = 1000.0;
    const double truth = true_difference(view);
    std::mt19937 random(7);
    int held = 0;
    for (int i = 0; i < kRepetitions; ++i) {
        Pair pair = measure(view, random);
        pair.predictors.push_back(pair.predictors[0]);  // Twice the same,
        pair.predictors.push_back(pair.predictors[0]);  // nothing at all,
        pair.predictors.back().sums.assign(pair.predictors[0].sums.size(), 0.0);
        pair.predictors.push_back(pair.predictors.back());  // and one block alone.
        pair.predictors.back().sums[5] = 1e9;
        held += holds(pair.difference(), truth);
    }
    EXPECT_GE(held, kLowestCoverage * kRepetitions);
}

TEST(PairedDifference, AddsWhatPredictorsHide) {
    std::mt19937 random(15);
    const Pair pair = measure({}, random);
    const ErrorInterval plain = pair.difference(),
                        wider = core::paired_difference(pair.worse, pair.better, pair.predictors, 0.21);
    EXPECT_NEAR((wider.high - wider.low) / (plain.high - plain.low), 1.1, 1e-9);
}

TEST(PairedDifference, DoesNotDecideWhereOneBlockHoldsTheDifference) {
    std::mt19937 random(9);
    View view;
    view.more = view.own = 0.0;
    Pair pair = measure(view, random);
    pair.worse.sums[100] += 1000.0;
    pair.predictors.clear();
    const ErrorInterval difference = pair.difference();
    EXPECT_GT(difference.value, 0.0);
    EXPECT_LT(difference.low, 0.0) << "such a block may be chance";
}

TEST(PairedDifference, OfEqualsIsNothing) {
    std::mt19937 random(11);
    const Pair pair = measure({}, random);
    const ErrorInterval none = core::paired_difference(pair.better, pair.better, pair.predictors, 0.0);
    EXPECT_EQ(none.value, 0.0);
    EXPECT_EQ(none.low, 0.0);
    EXPECT_EQ(none.high, 0.0);
}

TEST(PairedDifference, OfASingleBlockIsUnboundedAndOfABrokenOneNothing) {
    BlockErrors a(PixelBlocks(1, 1)), b = a;
    a.sums[0] = 3.0;
    b.sums[0] = 1.0;
    a.pixels[0] = b.pixels[0] = 1.0;
    const ErrorInterval single = core::paired_difference(a, b, {}, 0.0);
    EXPECT_EQ(single.value, 2.0);
    EXPECT_TRUE(std::isinf(single.low) && std::isinf(single.high));
    std::mt19937 random(1);
    for (const double broken :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        Pair pair = measure({}, random);
        pair.worse.sums[7] = broken;
        const ErrorInterval found = pair.difference();
        EXPECT_TRUE(std::isnan(found.value) && std::isnan(found.low) && std::isnan(found.high));
    }
}

TEST(PairedDifference, WorksOnPicturesOfAFewPixels) {
    for (const auto& [width, height] : {std::pair{1, 2}, {2, 1}, {1, 5}, {3, 3}, {5, 2}}) {
        const PixelBlocks blocks(width, height);
        BlockErrors a(blocks), b(blocks);
        for (std::size_t i = 0; i < a.sums.size(); ++i) {
            a.sums[i] = 1.0 + 0.1 * static_cast<double>(i % 2);
            a.pixels[i] = b.pixels[i] = 1.0;
        }
        const ErrorInterval difference = core::paired_difference(a, b, {}, 0.0);
        EXPECT_GE(difference.value, 1.0) << width << " x " << height;
        EXPECT_LT(difference.low, difference.value);
        EXPECT_TRUE(std::isfinite(difference.low)) << width << " x " << height;
    }
}

TEST(MixedErrors, LieBetweenTheTwo) {
    std::mt19937 random(13);
    const Pair pair = measure({}, random);
    const double a = core::mean_error(pair.better).value, b = core::mean_error(pair.worse).value;
    EXPECT_NEAR(core::mean_error(core::mixed(pair.better, pair.worse, 0.25)).value, 0.75 * a + 0.25 * b,
                1e-12);
    EXPECT_EQ(core::mixed(pair.better, pair.better, 0.0).sums, pair.better.sums);
}

TEST(CorrectedErrorBlocks, OfPicturesPairWithoutTheNoiseOfTheirReference) {
    // The reference is far noisier than either picture, so that its noise decides both errors.
    constexpr int kWidth = 96, kHeight = 64;
    constexpr double kNoise[] = {0.01, 0.0175}, kReferenceNoise = 0.1;
    std::mt19937 random(17);
    std::normal_distribution<double> normal;
    const auto picture = [&](double noise) {
        core::Image image(kWidth, kHeight);
        for (const char* channel : {"R", "G", "B"}) {
            std::vector<float> values;
            for (int i = 0; i < kWidth * kHeight; ++i) {
                values.push_back(static_cast<float>(10.0 * (1.0 + noise * normal(random))));
            }
            image.add_channel(channel, std::move(values));
        }
        return image;
    };
    core::Image reference = picture(kReferenceNoise);
    for (const char* channel : {"Variance.R", "Variance.G", "Variance.B"}) {
        reference.add_channel(channel, static_cast<float>(100.0 * kReferenceNoise * kReferenceNoise));
    }
    const core::Image better = picture(kNoise[0]), worse = picture(kNoise[1]);
    const ErrorInterval a = core::corrected_rel_mse(better, reference),
                        b = core::corrected_rel_mse(worse, reference);
    EXPECT_GT(a.high, b.low) << "the intervals of the two overlap";
    const ErrorInterval difference =
        core::paired_difference(core::corrected_rel_mse_blocks(worse, reference),
                                core::corrected_rel_mse_blocks(better, reference), {}, 0.0);
    EXPECT_NEAR(difference.value, b.value - a.value, 1e-12);
    EXPECT_GT(difference.low, 0.0);
    EXPECT_TRUE(holds(difference, kNoise[1] * kNoise[1] - kNoise[0] * kNoise[0]));
}

}  // namespace
