// tests/core/image/error_estimate_test.cpp: corrected errors and their intervals where the truth is known.
#include "core/image/error_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

namespace {

/// 400 repetitions: the observed share of a true 95 % has a standard deviation of 1.1 %; four of them.
constexpr int kRepetitions = 400;
constexpr double kLowestCoverage = 0.95 - 4 * 0.011, kHighestCoverage = 0.95 + 4 * 0.011;

/// A scene: what the reference and the test converge to, and how noisy they are.
struct Truth {
    int width = 32, height = 24;
    double bias = 0.1;       ///< Of the test, relative.
    double noise = 0.3;      ///< Standard deviation of a test pixel, relative.
    double reference = 0.1;  ///< The same for the reference.
    bool uniform = true;     ///< Otherwise radiance and bias vary over the picture.

    double radiance(int x, int y) const { return uniform ? 1.0 : 0.2 + 2.0 * (x / 8 % 2) + 0.02 * y; }
    double bias_at(int x) const { return uniform || x < width / 2 ? bias : -2.0 * bias; }
};

/// A picture of which every pixel is the mean of 8 batches, with the variance of that mean.
core::Image render(const Truth& truth, bool is_reference, std::mt19937& random) {
    constexpr int kBatches = 8;
    std::normal_distribution<double> normal;
    core::Image image(truth.width, truth.height);
    for (const char* channel : {"R", "G", "B"}) {
        std::vector<float> means, variances;
        for (int y = 0; y < truth.height; ++y) {
            for (int x = 0; x < truth.width; ++x) {
                const double mean = truth.radiance(x, y) * (is_reference ? 1.0 : 1.0 + truth.bias_at(x));
                const double deviation =
                    truth.radiance(x, y) * (is_reference ? truth.reference : truth.noise);
                double sum = 0.0, squares = 0.0;
                for (int batch = 0; batch < kBatches; ++batch) {
                    const double value = deviation * std::sqrt(kBatches) * normal(random);
                    sum += value;
                    squares += value * value;
                }
                means.push_back(static_cast<float>(mean + sum / kBatches));
                variances.push_back(
                    static_cast<float>((squares - sum * sum / kBatches) / (kBatches * (kBatches - 1))));
            }
        }
        image.add_channel(channel, std::move(means));
        image.add_channel(std::string("Variance.") + channel, std::move(variances));
    }
    return image;
}

/// Expected [(bias R)^2 + (noise R)^2] / (R^2 + 0.01) over the picture, R^2 taken as known.
double true_rel_mse(const Truth& truth, double noise) {
    double sum = 0.0;
    for (int y = 0; y < truth.height; ++y) {
        for (int x = 0; x < truth.width; ++x) {
            const double square = truth.radiance(x, y) * truth.radiance(x, y), bias = truth.bias_at(x);
            sum += square * (bias * bias + noise * noise) / (square + 0.01);
        }
    }
    return sum / (truth.width * truth.height);
}

/// Share of the intervals that hold the truth, and the mean of the values.
struct Coverage {
    double share = 0.0, mean = 0.0;

    void add(const core::ErrorInterval& interval, double truth) {
        EXPECT_LE(interval.low, interval.value);
        EXPECT_GE(interval.high, interval.value);
        share += static_cast<double>(interval.low <= truth && truth <= interval.high) / kRepetitions;
        mean += interval.value / kRepetitions;
    }
};

TEST(CorrectedError, DoesNotCountTheNoiseOfTheReference) {
    for (const bool uniform : {true, false}) {
        Truth truth;
        truth.uniform = uniform;
        truth.noise = 0.1;
        truth.reference = 0.03;
        const double expected = true_rel_mse(truth, truth.noise), expected_bias = true_rel_mse(truth, 0.0);
        std::mt19937 random(7);
        Coverage rel_mse, bias;
        double uncorrected = 0.0;
        for (int i = 0; i < kRepetitions; ++i) {
            const core::Image test = render(truth, false, random), reference = render(truth, true, random);
            rel_mse.add(core::corrected_rel_mse(test, reference), expected);
            bias.add(core::corrected_rel_bias(test, reference), expected_bias);
            uncorrected += (core::corrected_rel_mse(test, reference).value + core::noise_rel_mse(reference)) /
                           kRepetitions;
        }
        // 2,304 values with a deviation of at most 0.042, 400 times: 4e-5; four of them. Noise that is left
        // in the denominator would shift the first by 3.6e-4, in the numerator by 9e-4.
        EXPECT_NEAR(rel_mse.mean, expected, 1.6e-4);
        EXPECT_NEAR(bias.mean, expected_bias, 1.6e-4);
        EXPECT_GT(uncorrected, expected + 0.8 * truth.reference * truth.reference);
        EXPECT_GE(rel_mse.share, kLowestCoverage) << uniform;
        EXPECT_GE(bias.share, kLowestCoverage) << uniform;
        // Where the error is the same all over, the interval is not too wide either.
        if (uniform) {
            EXPECT_LE(rel_mse.share, kHighestCoverage);
        }
    }
}

TEST(CorrectedError, OfUnbiasedPicturesIsTheirNoiseAlone) {
    Truth truth;
    truth.bias = 0.0;
    std::mt19937 random(11);
    Coverage mse, bias;
    for (int i = 0; i < kRepetitions; ++i) {
        const core::Image test = render(truth, false, random), reference = render(truth, true, random);
        mse.add(core::corrected_mse(test, reference), truth.noise * truth.noise);
        bias.add(core::corrected_rel_bias(test, reference), 0.0);
    }
    // 400 pictures of 2,304 values of relative deviation sqrt 2: 1.5e-3; four of them.
    EXPECT_NEAR(mse.mean, truth.noise * truth.noise, 6e-3 * truth.noise * truth.noise);
    EXPECT_GE(mse.share, kLowestCoverage);
    EXPECT_LE(mse.share, kHighestCoverage);
    EXPECT_GE(bias.share, kLowestCoverage);
}

TEST(CorrectedError, NeedsTheVariancesThatItSubtracts) {
    std::mt19937 random(1);
    const core::Image with = render({}, true, random);
    core::Image without(with.width(), with.height());
    without.add_color("", *with.color());
    EXPECT_NO_THROW(core::corrected_rel_mse(without, with));
    EXPECT_THROW(core::corrected_rel_mse(with, without), std::invalid_argument);
    EXPECT_THROW(core::corrected_rel_bias(without, with), std::invalid_argument);
    EXPECT_THROW(core::noise_rel_mse(without), std::invalid_argument);
}

TEST(CorrectedError, IsNothingBesideABrokenPixel) {
    std::mt19937 random(1);
    const core::Image reference = render({}, true, random);
    for (const char* channel : {"G", "Variance.B"}) {
        core::Image broken = render({}, true, random);
        (*broken.find(channel))[5] = std::numeric_limits<float>::quiet_NaN();
        const core::ErrorInterval bias = core::corrected_rel_bias(broken, reference);
        EXPECT_TRUE(std::isnan(bias.value) && std::isnan(bias.low) && std::isnan(bias.high)) << channel;
        EXPECT_TRUE(std::isnan(core::corrected_mse(reference, broken).value)) << channel;
        EXPECT_TRUE(std::isnan(core::noise_rel_mse(broken))) << channel;
    }
}

TEST(CorrectedError, OfASinglePixelIsUnbounded) {
    core::Image test(1, 1), reference(1, 1);
    test.add_color("", {{3, 3, 3}});
    reference.add_color("", {{1, 1, 1}});
    reference.add_color("Variance", {{0.5f, 0.5f, 0.5f}});
    const core::ErrorInterval mse = core::corrected_mse(test, reference);
    EXPECT_EQ(mse.value, 3.5);
    EXPECT_TRUE(std::isinf(mse.low) && std::isinf(mse.high));
}

TEST(SquaredBias, IsFoundBelowTheNoiseOfTheRuns) {
    Truth truth;
    truth.width = 24;
    truth.height = 16;
    truth.reference = 0.03;
    constexpr int kRuns = 8;
    for (const double true_bias : {0.0, 0.05}) {
        truth.bias = true_bias;
        std::mt19937 random(3);
        Coverage absolute, relative;
        for (int i = 0; i < kRepetitions; ++i) {
            std::vector<core::Image> runs;
            for (int run = 0; run < kRuns; ++run) runs.push_back(render(truth, false, random));
            const core::Image reference = render(truth, true, random);
            absolute.add(core::squared_bias(runs, reference), true_bias * true_bias);
            relative.add(core::squared_rel_bias(runs, reference), true_rel_mse(truth, 0.0));
        }
        // One estimate: 1,152 values with a deviation of at most 0.02; 400 of them: 3e-5; four of those. The
        // noise of the runs alone would add 0.3^2 / 8 = 0.011, that of the reference 9e-4 to both, and 1.8e-4
        // through the denominator.
        EXPECT_NEAR(absolute.mean, true_bias * true_bias, 1.2e-4);
        EXPECT_NEAR(relative.mean, true_rel_mse(truth, 0.0), 1.2e-4);
        EXPECT_GE(absolute.share, kLowestCoverage);
        EXPECT_GE(relative.share, kLowestCoverage);
    }
}

TEST(SquaredBias, SeesNoiseThatIsAlikeAllOverARun) {
    // Every run is off by one number of its own, as a cache can be: blocks agree, and only the runs tell.
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    constexpr int kRuns = 8;
    constexpr double kBias = 0.1, kDeviation = 0.1;
    core::Image reference(24, 16);
    for (const char* channel : {"R", "G", "B"}) {
        reference.add_channel(channel, 1.0f);
        reference.add_channel(std::string("Variance.") + channel, 0.0f);
    }
    Coverage coverage;
    for (int i = 0; i < kRepetitions; ++i) {
        std::vector<core::Image> runs;
        for (int run = 0; run < kRuns; ++run) {
            core::Image& image = runs.emplace_back(24, 16);
            const auto value = static_cast<float>(1.0 + kBias + kDeviation * normal(random));
            for (const char* channel : {"R", "G", "B"}) image.add_channel(channel, value);
        }
        coverage.add(core::squared_bias(runs, reference), kBias * kBias);
    }
    // The jackknife of 8 values of a square is not exact; over blocks alone it would be 0.
    EXPECT_GE(coverage.share, 0.88);
}

constexpr double kTimes[] = {0.5, 1, 2, 4, 8, 16, 32};

/// Errors that scatter around floor + slope / t.
std::vector<double> errors_over_time(double floor, double slope, double scatter, std::mt19937& random) {
    std::normal_distribution<double> normal;
    std::vector<double> errors;
    for (const double time : kTimes)
        errors.push_back((floor + slope / time) * (1.0 + scatter * normal(random)));
    return errors;
}

TEST(ErrorFit, OfExactErrorsIsExact) {
    std::mt19937 random(1);
    for (const auto& [floor, slope] :
         {std::pair{0.01, 0.3}, std::pair{0.0, 0.3}, std::pair{1e-7, 5.0}, std::pair{0.02, 0.0}}) {
        const auto fit = core::fit_error_over_time(kTimes, errors_over_time(floor, slope, 0.0, random));
        ASSERT_TRUE(fit);
        EXPECT_NEAR(fit->floor.value, floor, 1e-12);
        EXPECT_NEAR(fit->slope.value, slope, 1e-12);
        EXPECT_NEAR(fit->floor.high - fit->floor.low, 0.0, 1e-10);
    }
}

TEST(ErrorFit, FitsTheOtherTermAloneWhereOneWouldBeNegative) {
    // Weights are equal in relative error: slope alone is the mean of error x time, floor the mean error.
    const double seconds[] = {1, 2, 4}, steep[] = {1.0, 0.5, 0.2}, rising[] = {1.0, 1.01, 1.02};
    const auto falls = core::fit_error_over_time(seconds, steep);
    ASSERT_TRUE(falls);
    EXPECT_EQ(falls->floor.value, 0.0);
    EXPECT_EQ(falls->floor.low, 0.0);
    EXPECT_NEAR(falls->slope.value, (1.0 + 1.0 + 0.8) / 3.0, 1e-12);
    const auto rises = core::fit_error_over_time(seconds, rising);
    ASSERT_TRUE(rises);
    EXPECT_EQ(rises->slope.value, 0.0);
    EXPECT_NEAR(rises->floor.value, 1.01, 1e-12);
}

TEST(ErrorFit, HoldsTheTruthInNinetyFiveOfAHundred) {
    constexpr double kScatter = 0.05;
    for (const auto& [floor, slope] : {std::pair{0.01, 0.3}, std::pair{0.0, 0.3}, std::pair{0.02, 0.002}}) {
        std::mt19937 random(9);
        Coverage floors, slopes;
        for (int i = 0; i < kRepetitions; ++i) {
            const auto fit =
                core::fit_error_over_time(kTimes, errors_over_time(floor, slope, kScatter, random));
            ASSERT_TRUE(fit);
            EXPECT_GE(fit->floor.low, 0.0);
            EXPECT_GE(fit->slope.low, 0.0);
            floors.add(fit->floor, floor);
            slopes.add(fit->slope, slope);
        }
        EXPECT_GE(floors.share, kLowestCoverage) << floor;
        EXPECT_GE(slopes.share, kLowestCoverage) << floor;
        // 400 fits with an interval of about +- 10 %.
        if (floor > 0.0) {
            EXPECT_NEAR(floors.mean, floor, 0.02 * floor);
        }
    }
}

TEST(ErrorFit, NeedsThreeDistinctTimesAndPositiveValues) {
    const auto fit = [](std::vector<double> seconds, std::vector<double> errors) {
        return core::fit_error_over_time(seconds, errors).has_value();
    };
    EXPECT_TRUE(fit({1, 2, 4}, {4, 2, 1}));
    EXPECT_FALSE(fit({1, 2}, {4, 2}));
    EXPECT_FALSE(fit({1, 2, 2}, {4, 2, 1}));
    EXPECT_FALSE(fit({1, 2, 4}, {4, 2, 0}));
    EXPECT_FALSE(fit({1, 2, 4}, {4, 2, std::numeric_limits<double>::quiet_NaN()}));
    EXPECT_FALSE(fit({0, 2, 4}, {4, 2, 1}));
    EXPECT_FALSE(fit({}, {}));
}

}  // namespace
