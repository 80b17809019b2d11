// tests/core/image/ssim_test.cpp: SSIM against its definition, window by window.
#include "core/image/ssim.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/image/tonemap.h"
#include "core/support/parallel.h"

namespace {

using Colors = std::vector<glm::vec3>;

Colors waves(int width, int height, float phase, float scale = 1.0f) {
    Colors colors;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto at = [&](float frequency) {
                return scale * (1.5f + std::sin(frequency * static_cast<float>(x + 2 * y) + phase));
            };
            colors.emplace_back(at(0.3f), at(0.7f), at(1.3f));
        }
    }
    return colors;
}

std::vector<double> shown(const Colors& radiance, const Colors& reference) {
    const float scale = core::exposure_scale(core::automatic_exposure(reference));
    std::vector<double> values;
    for (const glm::vec3& color : radiance) {
        const glm::vec3 tone = core::tone_curve(core::ToneMap::kAces, color * scale);
        values.push_back(0.2126 * core::srgb_from_linear(tone.r) + 0.7152 * core::srgb_from_linear(tone.g) +
                         0.0722 * core::srgb_from_linear(tone.b));
    }
    return values;
}

/// The definition, with two passes over each full window.
double slow_ssim(const Colors& test, const Colors& reference, int width, int height) {
    const std::vector<double> a = shown(test, reference), b = shown(reference, reference);
    double sum = 0.0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto mean = [&](const auto& value) {
                double total = 0.0, weights = 0.0;
                for (int v = std::max(y - 5, 0); v <= std::min(y + 5, height - 1); ++v) {
                    for (int u = std::max(x - 5, 0); u <= std::min(x + 5, width - 1); ++u) {
                        const double weight = std::exp(-((u - x) * (u - x) + (v - y) * (v - y)) / 4.5);
                        total += weight * value(static_cast<std::size_t>(v * width + u));
                        weights += weight;
                    }
                }
                return total / weights;
            };
            const double mean_a = mean([&](std::size_t i) { return a[i]; });
            const double mean_b = mean([&](std::size_t i) { return b[i]; });
            const double variance_a = mean([&](std::size_t i) { return std::pow(a[i] - mean_a, 2); });
            const double variance_b = mean([&](std::size_t i) { return std::pow(b[i] - mean_b, 2); });
            const double covariance = mean([&](std::size_t i) { return (a[i] - mean_a) * (b[i] - mean_b); });
            sum += (2 * mean_a * mean_b + 1e-4) * (2 * covariance + 9e-4) /
                   ((mean_a * mean_a + mean_b * mean_b + 1e-4) * (variance_a + variance_b + 9e-4));
        }
    }
    return sum / (width * height);
}

TEST(Ssim, FollowsItsDefinition) {
    for (const auto& [width, height] : {std::pair{23, 17}, std::pair{4, 30}, std::pair{1, 1}}) {
        const Colors test = waves(width, height, 0.4f), reference = waves(width, height, 0.0f);
        const double value = core::ssim(test, reference, width, height);
        // Doubles; moments cancel to about 1e-16 beside 9e-4.
        EXPECT_NEAR(value, slow_ssim(test, reference, width, height), 1e-10);
        EXPECT_LT(value, 0.999);
    }
}

TEST(Ssim, IsOneForEqualPicturesAndFallsWithTheirDifference) {
    const Colors reference = waves(20, 20, 0.0f);
    EXPECT_NEAR(core::ssim(reference, reference, 20, 20), 1.0, 1e-12);
    const double near = core::ssim(waves(20, 20, 0.2f), reference, 20, 20);
    const double far = core::ssim(waves(20, 20, 1.0f), reference, 20, 20);
    const double opposite = core::ssim(waves(20, 20, 3.14159f), reference, 20, 20);
    EXPECT_GT(1.0, near);
    EXPECT_GT(near, far);
    EXPECT_GT(0.0, opposite);
}

TEST(Ssim, ExposesBothPicturesLikeTheReference) {
    // The unit of radiance does not matter, but a test that is too bright does.
    const Colors reference = waves(20, 20, 0.0f), test = waves(20, 20, 0.2f);
    EXPECT_NEAR(core::ssim(waves(20, 20, 0.2f, 1024.0f), waves(20, 20, 0.0f, 1024.0f), 20, 20),
                core::ssim(test, reference, 20, 20), 1e-5);
    EXPECT_LT(core::ssim(waves(20, 20, 0.0f, 2.0f), reference, 20, 20), 0.98);
    const Colors black(400, glm::vec3(0.0f));
    EXPECT_EQ(core::ssim(black, black, 20, 20), 1.0);
    EXPECT_LT(core::ssim(reference, black, 20, 20), 0.01);
}

TEST(Ssim, IsNothingBesideABrokenPixelAndTheSameAtAnyThreadCount) {
    Colors test = waves(20, 20, 0.3f);
    const Colors reference = waves(20, 20, 0.0f);
    double one = 0.0;
    core::with_thread_limit(1, [&] { one = core::ssim(test, reference, 20, 20); });
    core::with_thread_limit(8, [&] { EXPECT_EQ(core::ssim(test, reference, 20, 20), one); });
    test[7].b = std::numeric_limits<float>::infinity();
    EXPECT_TRUE(std::isnan(core::ssim(test, reference, 20, 20)));
    EXPECT_TRUE(std::isnan(core::ssim(reference, test, 20, 20)));
}

}  // namespace
