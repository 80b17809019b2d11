// tests/core/image/z_test_test.cpp: equal pictures pass, different ones fail, at the stated rates.
#include "core/image/z_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace {

constexpr int kBatches = 8;

/// A picture whose pixels are means of eight normal batches around `mean`, with the variance of that mean.
core::Image noisy_picture(int width, int height, double mean, double sigma, unsigned seed) {
    core::Image image(width, height);
    std::mt19937 random(seed);
    std::normal_distribution<double> batch(mean, sigma);
    for (const char* component : {"R", "G", "B"}) {
        std::vector<float> values(image.pixel_count()), variances(image.pixel_count());
        for (std::size_t i = 0; i < values.size(); ++i) {
            double sum = 0.0, squares = 0.0;
            for (int b = 0; b < kBatches; ++b) {
                const double value = batch(random);
                sum += value;
                squares += value * value;
            }
            const double average = sum / kBatches;
            values[i] = static_cast<float>(average);
            variances[i] = static_cast<float>((squares / kBatches - average * average) / (kBatches - 1));
        }
        image.add_channel(component, std::move(values));
        image.add_channel(std::string("Variance.") + component, std::move(variances));
    }
    return image;
}

core::Image constant_picture(int width, int height, float value) {
    core::Image image(width, height);
    for (const char* component : {"R", "G", "B"}) image.add_channel(component, value);
    return image;
}

TEST(StudentT, HasTheTabulatedTwoSidedQuantiles) {
    // Tables of Student's t to three decimals: the p-value moves by less than 1e-4 over half of the last one.
    EXPECT_NEAR(core::student_t_p_value(2.365, 7), 0.05, 1e-4);
    EXPECT_NEAR(core::student_t_p_value(3.499, 7), 0.01, 1e-4);
    EXPECT_NEAR(core::student_t_p_value(-5.408, 7), 0.001, 1e-5);
    EXPECT_NEAR(core::student_t_p_value(12.706, 1), 0.05, 1e-4);
    EXPECT_NEAR(core::student_t_p_value(1.960, 1e7), 0.05, 1e-4);
    EXPECT_EQ(core::student_t_p_value(0.0, 7), 1.0);
    EXPECT_EQ(core::student_t_p_value(std::numeric_limits<double>::infinity(), 7), 0.0);
}

TEST(StudentT, MatchesTheClosedFormForOneAndTwoDegrees) {
    for (double t = 0.01; t < 1000.0; t *= 1.7) {
        const double cauchy = 1.0 - 2.0 / M_PI * std::atan(t);
        EXPECT_NEAR(core::student_t_p_value(t, 1), cauchy, 1e-12 + 1e-10 * cauchy);
        EXPECT_NEAR(core::student_t_p_value(t, 2), 1.0 - t / std::sqrt(2.0 + t * t), 1e-12);
    }
}

TEST(ZTest, PassesPicturesOfTheSameMean) {
    const core::Image a = noisy_picture(64, 64, 1.0, 0.3, 1), b = noisy_picture(64, 64, 1.0, 0.3, 2);
    // At significance 0.01 the fixed seeds fail with probability 1 % each if all is right.
    const core::ZTestResult pixels = core::pixel_z_test(a, b);
    EXPECT_EQ(pixels.tested, 4096u);
    EXPECT_GE(pixels.passing_fraction(), 0.9975);
    const core::ZTestResult blocks = core::block_z_test(a, b);
    EXPECT_EQ(blocks.tested, 64u);
    EXPECT_EQ(blocks.passed, 64u);
}

TEST(ZTest, OfOnePictureAgainstTheTruthPasses) {
    const core::Image a = noisy_picture(64, 64, 2.0, 0.5, 3), truth = constant_picture(64, 64, 2.0f);
    EXPECT_GE(core::pixel_z_test(a, truth).passing_fraction(), 0.9975);
    EXPECT_EQ(core::block_z_test(a, truth).passed, 64u);
}

TEST(ZTest, PValuesAreUniformForTheTruth) {
    // Sidak backwards: each of the 192 values of an 8 x 8 picture is tested at 5 %, so that 0.95^3 of the
    // pixels pass. Three standard deviations of 4,096 draws are 1.6 %.
    core::ZTestOptions options;
    options.significance = 1.0 - std::pow(0.95, 3.0 * 64.0);
    std::size_t passed = 0;
    for (unsigned seed = 0; seed < 64; ++seed) {
        passed += core::pixel_z_test(noisy_picture(8, 8, 2.0, 0.5, 100 + seed), constant_picture(8, 8, 2.0f),
                                     options)
                      .passed;
    }
    EXPECT_NEAR(static_cast<double>(passed) / 4096.0, std::pow(0.95, 3.0), 0.016);
}

TEST(ZTest, BlocksFindABiasThatHidesBelowThePixelsNoise) {
    const core::Image a = noisy_picture(64, 64, 1.0, 0.3, 4);
    // Standard error of a pixel 0.3 / sqrt(8) = 0.106, of a block 0.0133: a bias of 0.1 is 7.5 of the latter.
    const core::Image biased = constant_picture(64, 64, 1.1f);
    EXPECT_GE(core::pixel_z_test(a, biased).passing_fraction(), 0.9975);
    EXPECT_LT(core::block_z_test(a, biased).passing_fraction(), 0.05);
}

TEST(ZTest, FindsOneWrongPixelAndSaysWhere) {
    core::Image a = noisy_picture(16, 16, 1.0, 0.1, 5);
    (*a.find("G"))[37] += 10.0f;
    const core::ZTestResult result = core::pixel_z_test(a, constant_picture(16, 16, 1.0f));
    EXPECT_EQ(result.passed, 255u);
    EXPECT_EQ(result.worst_index, 37u);
}

TEST(ZTest, ToleratesRoundingWhereThereIsNoVarianceAndNothingElse) {
    core::Image a = constant_picture(4, 1, 1.0f);
    for (const char* component : {"R", "G", "B"}) a.add_channel(std::string("Variance.") + component, 0.0f);
    (*a.find("R"))[1] = 1.00001f;
    (*a.find("R"))[2] = 1.01f;
    const core::ZTestResult result = core::pixel_z_test(a, constant_picture(4, 1, 1.0f));
    EXPECT_EQ(result.passed, 3u);
    EXPECT_EQ(result.worst_index, 2u);
}

TEST(ZTest, ANonfiniteValueOrVarianceFailsItsPixelAndBlock) {
    core::Image a = noisy_picture(16, 8, 1.0, 0.1, 6);
    (*a.find("B"))[3] = std::numeric_limits<float>::quiet_NaN();
    (*a.find("Variance.R"))[20] = std::numeric_limits<float>::infinity();
    const core::Image truth = constant_picture(16, 8, 1.0f);
    const core::ZTestResult pixels = core::pixel_z_test(a, truth);
    EXPECT_EQ(pixels.nonfinite, 2u);
    EXPECT_LE(pixels.passed, pixels.tested - 2);
    EXPECT_EQ(core::block_z_test(a, truth).passed, 1u);
}

TEST(ZTest, BlocksAtTheEdgesMayBeSmaller) {
    EXPECT_EQ(core::block_z_test(noisy_picture(17, 9, 1.0, 0.1, 7), constant_picture(17, 9, 1.0f)).tested,
              6u);
}

TEST(ZTest, NeedsAVariance) {
    EXPECT_THROW(core::pixel_z_test(constant_picture(2, 2, 1.0f), constant_picture(2, 2, 1.0f)),
                 std::invalid_argument);
}

}  // namespace
