#include "core/math/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/analytic_scenes.h"
#include "tests/support/chi_square.h"

namespace {

// Tests of this file that may raise a false alarm, for Sidak's correction.
const double kAlpha = tests::sidak_alpha(0.01, 8);

TEST(CosineHemisphere, FollowsItsDensity) {
    EXPECT_GT(tests::chi_square_p_value(
                  [](const glm::vec2& u, float) { return std::optional(core::sample_cosine_hemisphere(u)); },
                  [](const glm::vec3& d) { return core::cosine_hemisphere_pdf(d.z); }),
              kAlpha);
}

TEST(CosineHemisphere, FailsTheTestWithAWrongDensity) {
    // The harness itself must be able to say no: a uniform hemisphere is not cosine-distributed.
    EXPECT_LT(tests::chi_square_p_value(
                  [](const glm::vec2& u, float) { return std::optional(core::sample_cosine_hemisphere(u)); },
                  [](const glm::vec3& d) { return d.z > 0.0f ? 0.5 / static_cast<double>(core::kPi) : 0.0; }),
              1e-6);
}

TEST(UniformSphere, FollowsItsDensity) {
    EXPECT_GT(tests::chi_square_p_value(
                  [](const glm::vec2& u, float) { return std::optional(core::sample_uniform_sphere(u)); },
                  [](const glm::vec3&) { return core::kUniformSpherePdf; }),
              kAlpha);
}

TEST(UniformCone, FollowsItsDensity) {
    const float height = 1.0f - std::cos(0.7f);
    tests::ChiSquareSettings settings;
    settings.integration_points = 32;  // The density jumps inside cells.
    EXPECT_GT(
        tests::chi_square_p_value(
            [&](const glm::vec2& u, float) { return std::optional(core::sample_uniform_cone(u, height)); },
            [&](const glm::vec3& d) { return 1.0f - d.z <= height ? core::uniform_cone_pdf(height) : 0.0f; },
            settings),
        kAlpha);
}

TEST(Samplers, ReturnTheSquareWhenInverted) {
    // Float rounding through a square root and a trigonometric function: a few ulp of 1, more near the poles.
    constexpr float kTolerance = 2e-5f;
    tests::TestRandom random(5);
    for (int i = 0; i < 20000; ++i) {
        const glm::vec2 u(static_cast<float>(random.uniform(0.001, 0.999)),
                          static_cast<float>(random.uniform(0.001, 0.999)));
        const auto near_u = [&](const glm::vec2& v, float tolerance, const char* what) {
            EXPECT_NEAR(u.x, v.x, tolerance) << what;
            EXPECT_NEAR(u.y, v.y, tolerance) << what;
        };
        near_u(core::square_from_disk(core::disk_from_square(u)), kTolerance, "disk");
        near_u(core::invert_cosine_hemisphere(core::sample_cosine_hemisphere(u)), kTolerance, "cosine");
        near_u(core::invert_uniform_sphere(core::sample_uniform_sphere(u)), kTolerance, "sphere");
        near_u(core::invert_triangle(core::sample_triangle(u)), kTolerance, "triangle");
        // The sun: 1 - cos of a quarter degree is 1e-5, where 1 - z alone would keep no digits.
        const float sun = 1.07e-5f;
        near_u(core::invert_uniform_cone(core::sample_uniform_cone(u, sun), sun), 1e-4f, "cone");
    }
}

TEST(Distribution1D, ReturnsEntriesAsOftenAsTheyWeigh) {
    const std::vector<float> weights = {0.0f, 3.0f, 0.0f, 1.0f, 4.0f, 0.0f};
    const core::Distribution1D distribution(weights);
    std::vector<double> observed(6, 0.0), expected(6);
    tests::TestRandom random(9);
    constexpr int kCount = 1'000'000;
    for (int i = 0; i < kCount; ++i) {
        const auto sample = distribution.sample(static_cast<float>(random.uniform() * 0.99999994));
        observed[sample.index] += 1.0;
        EXPECT_GE(sample.remainder, 0.0f);
        EXPECT_LT(sample.remainder, 1.0f);
    }
    for (std::size_t i = 0; i < 6; ++i) expected[i] = static_cast<double>(weights[i]) / 8.0 * kCount;
    EXPECT_EQ(observed[0] + observed[2] + observed[5], 0.0) << "entries of weight 0 must never come";
    EXPECT_GT(tests::chi_square_p_value(observed, expected), kAlpha);
}

TEST(Distribution1D, IsUniformWhereAllWeightsAreZero) {
    const core::Distribution1D distribution(std::vector<float>(4, 0.0f));
    EXPECT_EQ(distribution.sample(0.6f).index, 2u);
    EXPECT_FLOAT_EQ(distribution.probability(2), 0.25f);
}

TEST(Distribution1D, HandlesTheLastFloatBelowOne) {
    const core::Distribution1D distribution(std::vector<float>{1.0f, 1.0f, 0.0f});
    EXPECT_EQ(distribution.sample(0x1.fffffep-1f).index, 1u);
}

TEST(Distribution2D, ReturnsTheSquareWhenInverted) {
    tests::TestRandom random(3);
    std::vector<float> weights(12 * 7);
    for (float& weight : weights) weight = static_cast<float>(random.uniform());
    const core::Distribution2D distribution(weights, 12, 7);
    double integral = 0.0;
    for (int i = 0; i < 12 * 7; ++i) {
        integral += static_cast<double>(distribution.pdf({(static_cast<float>(i % 12) + 0.5f) / 12.0f,
                                                          (static_cast<float>(i / 12) + 0.5f) / 7.0f})) /
                    (12.0 * 7.0);
    }
    EXPECT_NEAR(integral, 1.0, 1e-5);  // Rounding of 84 float probabilities.
    for (int i = 0; i < 10000; ++i) {
        const glm::vec2 u(static_cast<float>(random.uniform()), static_cast<float>(random.uniform()));
        const auto sample = distribution.sample(u);
        const glm::vec2 back = distribution.invert(sample.point);
        EXPECT_NEAR(u.x, back.x, 1e-5f);
        EXPECT_NEAR(u.y, back.y, 1e-5f);
    }
}

TEST(Distribution2D, FollowsItsWeights) {
    tests::TestRandom random(4);
    std::vector<float> weights(8 * 8);
    double total = 0.0;
    for (float& weight : weights) total += static_cast<double>(weight = static_cast<float>(random.uniform()));
    const core::Distribution2D distribution(weights, 8, 8);
    std::vector<double> observed(64, 0.0), expected(64);
    constexpr int kCount = 1'000'000;
    for (int i = 0; i < kCount; ++i) {
        const auto sample = distribution.sample({static_cast<float>(random.uniform() * 0.99999994),
                                                 static_cast<float>(random.uniform() * 0.99999994)});
        observed[static_cast<std::size_t>(sample.point.y * 8.0f) * 8 +
                 static_cast<std::size_t>(sample.point.x * 8.0f)] += 1.0;
    }
    for (std::size_t i = 0; i < 64; ++i) expected[i] = static_cast<double>(weights[i]) / total * kCount;
    EXPECT_GT(tests::chi_square_p_value(observed, expected), kAlpha);
}

}  // namespace
