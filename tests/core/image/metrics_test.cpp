// tests/core/image/metrics_test.cpp: metrics against values by hand.
#include "core/image/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace {

using Colors = std::vector<glm::vec3>;

/// Doubles summed over at most 10,000 values that are floats themselves: 1e-6 is far above rounding of
/// either.
constexpr double kTolerance = 1e-6;

Colors gray(std::initializer_list<float> values) {
    Colors colors;
    for (const float value : values) colors.emplace_back(value);
    return colors;
}

TEST(Metrics, OfAPictureWithItselfAreZero) {
    const Colors picture{{0, 0.5f, 2}, {1e6f, 3, 1e-6f}, {0, 0, 0}};
    const core::ImageMetrics m = core::compare_images(picture, picture);
    for (const double value :
         {m.mse, m.rel_mse, m.rel_mse_trimmed, m.mrse, m.mape, m.smape, m.energy_bias_percent, m.p50, m.p95,
          m.p99, m.p99_9, m.max, m.leak.energy_fraction}) {
        EXPECT_EQ(value, 0.0);
    }
    EXPECT_EQ(m.nonfinite_pixels, 0u);
    EXPECT_TRUE(m.leak.counts);
}

TEST(Metrics, FollowTheirDefinitions) {
    // One pixel: I = (1, 3, 0), R = (2, 1, 0).
    const core::ImageMetrics m = core::compare_images(Colors{{1, 3, 0}}, Colors{{2, 1, 0}});
    EXPECT_NEAR(m.mse, (1.0 + 4.0) / 3, kTolerance);
    EXPECT_NEAR(m.rel_mse, (1.0 / 4.01 + 4.0 / 1.01) / 3, kTolerance);
    EXPECT_NEAR(m.rel_mse_trimmed, m.rel_mse, kTolerance);
    EXPECT_NEAR(m.mrse, (1.0 / (2.01 * 2.01) + 4.0 / (1.01 * 1.01)) / 3, kTolerance);
    EXPECT_NEAR(m.mape, (1.0 / 2.01 + 2.0 / 1.01) / 3, kTolerance);
    EXPECT_NEAR(m.smape, (1.0 / 3.01 + 2.0 / 4.01) / 3, kTolerance);
    const double y = 0.2126 + 3 * 0.7152, y_reference = 2 * 0.2126 + 0.7152;
    EXPECT_NEAR(m.energy_bias_percent, 100 * (y / y_reference - 1), 1e-4);
    EXPECT_NEAR(m.max, (y - y_reference) / (y_reference + 0.01), kTolerance);
    EXPECT_EQ(m.p50, m.max);
}

TEST(Metrics, CountBlackReferencePixels) {
    // Skipping R = 0 would hide this: 0.1^2 / 0.01 = 1.
    EXPECT_NEAR(core::compare_images(gray({0.1f}), gray({0.0f})).rel_mse, 1.0, kTolerance);
}

TEST(Metrics, EnergyBiasIsSigned) {
    EXPECT_NEAR(core::compare_images(gray({0.9f, 1}), gray({1, 1})).energy_bias_percent, -5.0, 1e-4);
    EXPECT_NEAR(core::compare_images(gray({1.1f, 1}), gray({1, 1})).energy_bias_percent, 5.0, 1e-4);
    EXPECT_TRUE(std::isnan(core::compare_images(gray({1}), gray({0})).energy_bias_percent));
}

TEST(Metrics, PercentilesTakeTheNearestRank) {
    Colors test, reference;
    for (int i = 1; i <= 1000; ++i) {
        // In shuffled order; the relative error of value i is i, since R + 0.01 = 1.
        const int value = i * 7 % 1000 + 1;
        reference.emplace_back(0.99f);
        test.emplace_back(0.99f + static_cast<float>(value));
    }
    const core::ImageMetrics m = core::compare_images(test, reference);
    constexpr double kFloatRounding = 1e-3;  // 1000.99f is good to 6e-5; the sum of weights to less.
    EXPECT_NEAR(m.p50, 500, kFloatRounding);
    EXPECT_NEAR(m.p95, 950, kFloatRounding);
    EXPECT_NEAR(m.p99, 990, kFloatRounding);
    EXPECT_NEAR(m.p99_9, 999, kFloatRounding);
    EXPECT_NEAR(m.max, 1000, kFloatRounding);
}

TEST(Metrics, TrimmingDropsTheWorstThousandth) {
    Colors test(2000, glm::vec3(1.1f)), reference(2000, glm::vec3(1.0f));
    test[17] = test[1500] = glm::vec3(1000.0f);
    const core::ImageMetrics m = core::compare_images(test, reference);
    EXPECT_NEAR(m.rel_mse_trimmed, 0.01 / 1.01, kTolerance);
    EXPECT_GT(m.rel_mse, 900.0);
    // A third outlier is one more than the thousandth of 2,000.
    test[3] = glm::vec3(1000.0f);
    EXPECT_GT(core::compare_images(test, reference).rel_mse_trimmed, 400.0);
}

TEST(Metrics, AnyNonfinitePixelIsCountedAndSpoilsEveryNumber) {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    Colors test(5, glm::vec3(1.0f)), reference(5, glm::vec3(1.0f));
    test[1].g = kNaN;
    test[2].b = -kInfinity;
    reference[2].r = kNaN;
    reference[4].r = kInfinity;
    const core::ImageMetrics m = core::compare_images(test, reference);
    EXPECT_EQ(m.nonfinite_pixels, 3u);
    EXPECT_EQ(m.nonfinite_test_pixels, 2u);
    EXPECT_EQ(m.nonfinite_reference_pixels, 2u);
    for (const double value :
         {m.mse, m.rel_mse, m.rel_mse_trimmed, m.mrse, m.mape, m.smape, m.energy_bias_percent, m.p50, m.p95,
          m.p99, m.p99_9, m.max, m.leak.energy_fraction, m.leak.mean}) {
        EXPECT_TRUE(std::isnan(value));
    }
    EXPECT_FALSE(m.leak.counts);
}

TEST(Leak, IsTheLightInDarkPixelsOverAllLight) {
    // Median of the positive ones is 10, so that 0.0009 is dark and 0.002 is not.
    const core::ImageMetrics m =
        core::compare_images(gray({10, 10, 10, 0.3f, 0.2f, 0.002f}), gray({10, 10, 10, 0, 0.0009f, 0.002f}));
    EXPECT_EQ(m.leak.dark_pixels, 2u);
    EXPECT_NEAR(m.leak.mean, 0.25, kTolerance);
    EXPECT_NEAR(m.leak.p99_9, 0.3, kTolerance);
    EXPECT_NEAR(m.leak.energy_fraction, (0.3 + 0.1991) / 30.0029, kTolerance);
    EXPECT_NEAR(m.leak.lit_bias_percent, 0.0, kTolerance);
    EXPECT_TRUE(m.leak.counts);
}

TEST(Leak, DoesNotCountBesideALitSideThatIsWrong) {
    EXPECT_TRUE(core::compare_images(gray({0.99f, 0}), gray({1, 0})).leak.counts);
    EXPECT_FALSE(core::compare_images(gray({0.97f, 0}), gray({1, 0})).leak.counts);
    EXPECT_FALSE(core::compare_images(gray({0, 0}), gray({1, 0})).leak.counts);
}

TEST(Leak, OfABlackReferenceIsUndefinedAndDoesNotCount) {
    const core::LeakMetric leak = core::compare_images(gray({1, 2}), gray({0, 0})).leak;
    EXPECT_TRUE(std::isnan(leak.energy_fraction));
    EXPECT_EQ(leak.dark_pixels, 2u);
    EXPECT_FALSE(leak.counts);
}

}  // namespace
