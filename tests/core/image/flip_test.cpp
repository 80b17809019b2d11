// tests/core/image/flip_test.cpp: FLIP against the values of the published implementation on pictures given
// by formulas, and the cases that the published one gets wrong.
#include "core/image/flip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/support/parallel.h"

namespace {

using Colors = std::vector<glm::vec3>;

/// The published values have six digits; they were computed in floats with the full, not the separable,
/// kernels.
constexpr double kMeanTolerance = 1e-4, kPixelTolerance = 1e-3;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kWidth = 64, kHeight = 48;

Colors plain(float r, float g, float b, int count = 32 * 32) {
    return Colors(static_cast<std::size_t>(count), glm::vec3(r, g, b));
}

Colors plain(float gray, int count = 32 * 32) {
    return plain(gray, gray, gray, count);
}

template <typename Function>
Colors picture(const Function& color_at) {
    Colors colors;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) colors.push_back(color_at(x, y));
    }
    return colors;
}

glm::vec3 ramp_at(int x, int y) {
    return {static_cast<float>(x) / 63.0f, static_cast<float>(y) / 47.0f,
            ((x / 8 + y / 8) & 1) != 0 ? 0.75f : 0.25f};
}

Colors ramp() {
    return picture(ramp_at);
}

Colors shifted_ramp() {
    return picture([](int x, int y) { return ramp_at((x + 1) % kWidth, y); });
}

Colors hdr_reference() {
    return picture([](int x, int y) {
        const float e = std::exp2(static_cast<float>(x - 32) / 4.0f);
        return glm::vec3(e, e * static_cast<float>(y + 1) / 48.0f, e / 2.0f);
    });
}

Colors hdr_test() {
    Colors colors = hdr_reference();
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            if ((x + y) % 8 == 0) colors[static_cast<std::size_t>(y * kWidth + x)] *= 1.5f;
        }
    }
    return colors;
}

Colors step_at(int edge) {
    return picture([edge](int x, int) { return glm::vec3(x < edge ? 0.1f : 0.8f); });
}

double mean_of_plain(const Colors& reference, const Colors& test) {
    const core::FlipResult result = core::flip_ldr(test, reference, 32, 32);
    // Nothing differs from pixel to pixel.
    EXPECT_NEAR(result.min, result.max, 1e-6);
    return result.mean;
}

struct Golden {
    double mean, max, first, middle;
};

void expect_golden(const core::FlipResult& result, const Golden& golden) {
    EXPECT_NEAR(result.mean, golden.mean, kMeanTolerance);
    EXPECT_NEAR(result.max, golden.max, kPixelTolerance);
    EXPECT_NEAR(result.map.front(), golden.first, kPixelTolerance);
    EXPECT_NEAR(result.map[kHeight / 2 * kWidth + kWidth / 2], golden.middle, kPixelTolerance);
}

TEST(FlipLdr, OfPlainColorsIsThePublishedValue) {
    EXPECT_NEAR(mean_of_plain(plain(0), plain(1)), 0.967388, kMeanTolerance);
    EXPECT_NEAR(mean_of_plain(plain(0, 1, 0), plain(0, 0, 1)), 1.0, kMeanTolerance);
    EXPECT_NEAR(mean_of_plain(plain(1, 0, 0), plain(0, 1, 0)), 0.986665, kMeanTolerance);
    EXPECT_NEAR(mean_of_plain(plain(0.5f), plain(0.6f)), 0.196255, kMeanTolerance);
    EXPECT_NEAR(mean_of_plain(plain(0.18f), plain(0.19f)), 0.065048, kMeanTolerance);
}

TEST(FlipLdr, OfStructuresIsThePublishedValue) {
    expect_golden(core::flip_ldr(shifted_ramp(), ramp(), kWidth, kHeight),
                  {0.144930, 0.938120, 0.114301, 0.117450});
    expect_golden(core::flip_ldr(shifted_ramp(), ramp(), kWidth, kHeight, 20.0),
                  {0.174839, 0.978253, 0.124052, 0.159393});
    const Colors dotted =
        picture([](int x, int y) { return x % 16 == 7 && y % 16 == 7 ? glm::vec3(1.0f) : ramp_at(x, y); });
    expect_golden(core::flip_ldr(dotted, ramp(), kWidth, kHeight), {0.019905, 0.444699, 0.000163, 0.004656});
    expect_golden(core::flip_ldr(step_at(34), step_at(32), kWidth, kHeight),
                  {0.059006, 0.796869, 0.0, 0.796869});
}

TEST(FlipHdr, IsThePublishedValue) {
    const core::FlipResult result = core::flip_hdr(hdr_test(), hdr_reference(), kWidth, kHeight);
    expect_golden(result, {0.090369, 0.206502, 0.026831, 0.170944});
    ASSERT_EQ(result.exposures.size(), 9u);
    // Published from floats.
    EXPECT_NEAR(result.exposures.front(), -6.61366, 1e-4);
    EXPECT_NEAR(result.exposures.back(), 2.00239, 1e-4);
}

TEST(Flip, OfEqualPicturesIsZero) {
    for (const core::FlipResult& result : {core::flip_ldr(ramp(), ramp(), kWidth, kHeight),
                                           core::flip_hdr(hdr_test(), hdr_test(), kWidth, kHeight)}) {
        for (const double value : {result.mean, result.weighted_median, result.first_quartile,
                                   result.third_quartile, result.min, result.max}) {
            EXPECT_EQ(value, 0.0);
        }
    }
}

TEST(FlipLdr, IsSymmetric) {
    const core::FlipResult there = core::flip_ldr(shifted_ramp(), ramp(), kWidth, kHeight),
                           back = core::flip_ldr(ramp(), shifted_ramp(), kWidth, kHeight);
    EXPECT_EQ(there.map, back.map);
}

TEST(FlipLdr, DoesNotCareWhichWayAPictureIsTurned) {
    // Rows and columns go through different code.
    const auto transposed = [](const Colors& colors) {
        Colors turned;
        for (std::size_t x = 0; x < kWidth; ++x) {
            for (std::size_t y = 0; y < kHeight; ++y) turned.push_back(colors[y * kWidth + x]);
        }
        return turned;
    };
    const core::FlipResult upright = core::flip_ldr(shifted_ramp(), ramp(), kWidth, kHeight);
    const core::FlipResult turned =
        core::flip_ldr(transposed(shifted_ramp()), transposed(ramp()), kHeight, kWidth);
    constexpr float kRounding = 1e-4f;  // Small distances of colours grow by the power 0.7.
    for (std::size_t y = 0; y < kHeight; ++y) {
        for (std::size_t x = 0; x < kWidth; ++x) {
            ASSERT_NEAR(turned.map[x * kHeight + y], upright.map[y * kWidth + x], kRounding) << x << ' ' << y;
        }
    }
}

TEST(FlipLdr, ClampsWhatTheScreenCannotShow) {
    const core::FlipResult result = core::flip_ldr(plain(7.0f), plain(-2.0f), 32, 32);
    EXPECT_EQ(result.map, core::flip_ldr(plain(1.0f), plain(0.0f), 32, 32).map);
    EXPECT_TRUE(core::is_low_dynamic_range(plain(1.0f)));
    EXPECT_TRUE(core::is_low_dynamic_range(plain(0.0f)));
    EXPECT_FALSE(core::is_low_dynamic_range(plain(0.0f, 0.5f, 1.0001f)));
    EXPECT_FALSE(core::is_low_dynamic_range(plain(0.0f, -1e-6f, 1.0f)));
    EXPECT_FALSE(core::is_low_dynamic_range(plain(kNaN)));
}

TEST(Flip, PercentilesWeighPixelsByTheirError) {
    // Far from the edge, errors are 0; a narrow strip of pixels holds all of it.
    const core::FlipResult result = core::flip_ldr(step_at(34), step_at(32), kWidth, kHeight);
    std::size_t strictly_above = 0;
    double below = 0.0, up_to = 0.0, total = 0.0;
    for (const float error : result.map) {
        total += error;
        if (error < result.weighted_median) below += error;
        if (error <= result.weighted_median) up_to += error;
        strictly_above += error > result.weighted_median;
    }
    EXPECT_LT(below, 0.5 * total);
    EXPECT_GE(up_to, 0.5 * total);
    // Half of the error, but a small share of the pixels.
    EXPECT_LT(strictly_above, result.map.size() / 10);
    EXPECT_GT(result.first_quartile, 0.0);
    EXPECT_LE(result.first_quartile, result.weighted_median);
    EXPECT_LT(result.weighted_median, result.third_quartile);
    EXPECT_LE(result.third_quartile, result.max);
}

TEST(FlipHdr, SeesLightThatIsAddedToADarkRoom) {
    // The median of all luminances is 0 here; the published code then calls any test identical.
    Colors reference(kWidth * kHeight, glm::vec3(0.0f)), leaking = reference;
    for (std::size_t x = 0; x < kWidth; ++x) reference[x] = leaking[x] = glm::vec3(1.0f);
    for (std::size_t i = 40 * kWidth; i < leaking.size(); ++i) leaking[i] = glm::vec3(0.5f);
    const core::FlipResult result = core::flip_hdr(leaking, reference, kWidth, kHeight);
    EXPECT_GT(result.map.back(), 0.5f);
    EXPECT_GT(result.mean, 0.05);
    EXPECT_LT(result.map[20 * kWidth], 1e-6f);
}

TEST(FlipHdr, OfABlackReferenceTakesItsExposuresFromTheTest) {
    const Colors black = plain(0.0f);
    for (const float light : {1e-6f, 1.0f, 1e6f}) {
        const core::FlipResult result = core::flip_hdr(plain(light), black, 32, 32);
        EXPECT_GT(result.mean, 0.9) << light;
        EXPECT_EQ(result.exposures.size(), 1u);
    }
    const core::FlipResult nothing = core::flip_hdr(black, black, 32, 32);
    EXPECT_EQ(nothing.max, 0.0);
    EXPECT_TRUE(nothing.exposures.empty());
}

TEST(FlipHdr, OfAConstantReferenceHasOneExposure) {
    // Shown as 0.85 whatever its radiance is, so that only the ratio counts.
    const double dim = core::flip_hdr(plain(0.012f), plain(0.01f), 32, 32).mean;
    const core::FlipResult bright = core::flip_hdr(plain(1.2e4f), plain(1e4f), 32, 32);
    ASSERT_EQ(bright.exposures.size(), 1u);
    EXPECT_GT(bright.mean, 0.01);
    EXPECT_NEAR(bright.mean, dim, 1e-5);
    const float radiance_at_first = 1e4f * std::exp2(static_cast<float>(bright.exposures.front()));
    const float x = 0.6f * radiance_at_first;
    EXPECT_NEAR(x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f), 0.85f, 1e-5f);
}

TEST(FlipHdr, StaysFiniteOverTheWholeRangeOfFloats) {
    constexpr float kHuge = std::numeric_limits<float>::max(),
                    kTiny = std::numeric_limits<float>::denorm_min();
    const Colors reference{glm::vec3(kHuge), glm::vec3(kTiny), glm::vec3(kTiny), glm::vec3(-kHuge)};
    const Colors test{glm::vec3(kTiny), glm::vec3(kHuge), glm::vec3(-1.0f), glm::vec3(0.0f)};
    const core::FlipResult result = core::flip_hdr(test, reference, 2, 2);
    for (const float error : result.map) {
        EXPECT_GE(error, 0.0f);
        EXPECT_LE(error, 1.0f);
    }
    EXPECT_GT(result.mean, 0.1);
}

TEST(Flip, ABrokenPixelSpoilsTheNumbersAndIsSeenInTheMap) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (const float broken : {kNaN, kInfinity, -kInfinity}) {
        Colors test = ramp();
        test[100].g = broken;
        for (const bool swapped : {false, true}) {
            for (const auto& flip : {core::flip_ldr, core::flip_hdr}) {
                const core::FlipResult result =
                    swapped ? flip(ramp(), test, kWidth, kHeight, core::kFlipPixelsPerDegree)
                            : flip(test, ramp(), kWidth, kHeight, core::kFlipPixelsPerDegree);
                EXPECT_EQ(result.nonfinite_pixels, 1u);
                for (const double value : {result.mean, result.weighted_median, result.first_quartile,
                                           result.third_quartile, result.min, result.max}) {
                    EXPECT_TRUE(std::isnan(value));
                }
                for (std::size_t i = 0; i < result.map.size(); ++i) {
                    if (i == 100) {
                        EXPECT_TRUE(std::isnan(result.map[i]));
                    } else {
                        // Black in both pictures, it is no difference to its neighbours.
                        EXPECT_EQ(result.map[i], 0.0f) << i;
                    }
                }
            }
        }
    }
}

TEST(Flip, ComparesPicturesSmallerThanItsFilters) {
    // With replicated borders a single pixel is a plain colour.
    EXPECT_NEAR(core::flip_ldr(plain(0.6f, 1), plain(0.5f, 1), 1, 1).mean, 0.196255, kMeanTolerance);
    EXPECT_NEAR(core::flip_ldr(plain(0.6f, 5), plain(0.5f, 5), 5, 1).mean, 0.196255, kMeanTolerance);
    EXPECT_NEAR(core::flip_ldr(plain(0.6f, 5), plain(0.5f, 5), 1, 5).mean, 0.196255, kMeanTolerance);
    EXPECT_NEAR(core::flip_ldr(plain(0.6f, 4), plain(0.5f, 4), 2, 2, 1.0).mean, 0.196255, kMeanTolerance);
    EXPECT_GT(core::flip_hdr(plain(2.0f, 1), plain(1.0f, 1), 1, 1).mean, 0.01);
}

TEST(Flip, IsTheSameAtAnyThreadCount) {
    core::FlipResult one;
    core::with_thread_limit(1, [&] { one = core::flip_hdr(hdr_test(), hdr_reference(), kWidth, kHeight); });
    for (const int threads : {2, 3, 8}) {
        core::FlipResult many;
        core::with_thread_limit(threads,
                                [&] { many = core::flip_hdr(hdr_test(), hdr_reference(), kWidth, kHeight); });
        EXPECT_EQ(many.map, one.map) << threads;
        EXPECT_EQ(many.mean, one.mean) << threads;
    }
}

TEST(Magma, IsNearThePublishedColors) {
    // Rows of the published table of 256, none of them a control point but the ends.
    const struct {
        int index;
        glm::vec3 color;
    } published[] = {{0, {0.001462f, 0.000466f, 0.013866f}},   {32, {0.113094f, 0.065492f, 0.276784f}},
                     {77, {0.396467f, 0.102902f, 0.502658f}},  {128, {0.716387f, 0.214982f, 0.475290f}},
                     {200, {0.992785f, 0.594891f, 0.410283f}}, {255, {0.987053f, 0.991438f, 0.749504f}}};
    for (const auto& [index, color] : published) {
        const glm::vec3 ours = core::magma(static_cast<float>(index) / 255.0f);
        for (int i = 0; i < 3; ++i) EXPECT_NEAR(ours[i], color[i], 2.2 / 255) << index;
    }
    EXPECT_EQ(core::magma(-3.0f), core::magma(0.0f));
    EXPECT_EQ(core::magma(2.0f), core::magma(1.0f));
    EXPECT_EQ(core::magma(kNaN), glm::vec3(1, 0, 1));
}

}  // namespace
