// tests/core/image/temporal_test.cpp: sequences whose restlessness is known.
#include "core/image/temporal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace {

using core::Frame;

constexpr int kWidth = 40;
constexpr std::size_t kPixels = 40 * 20;

Frame gray(float value) {
    return Frame(kPixels, glm::vec3(value));
}

/// Frames of independent noise around a value.
std::vector<Frame> noisy(int count, float value, float deviation, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal(0.0f, deviation);
    std::vector<Frame> frames(static_cast<std::size_t>(count), Frame(kPixels));
    for (Frame& frame : frames) {
        for (glm::vec3& color : frame) color = glm::vec3(value + normal(random));
    }
    return frames;
}

TEST(TemporalDeviation, IsThatOfTheNoiseOverTheMean) {
    // 800 pixels of 64 frames: the deviation is good to 1 / sqrt(2 x 63 x 800) = 0.3 %; four of them, and a
    // 1 % floor beside the mean of 10 that is counted exactly. sqrt is biased by 1 / (4 x 63) = 0.4 %.
    EXPECT_NEAR(core::temporal_deviation(noisy(64, 10.0f, 0.5f)), 0.5 / 10.01, 0.016 * 0.05);
    EXPECT_EQ(core::temporal_deviation(std::vector<Frame>(5, gray(3.0f))), 0.0);
    // By hand: 1 and 3 have mean 2 and an unbiased variance of 2.
    EXPECT_NEAR(core::temporal_deviation(std::vector<Frame>{gray(1.0f), gray(3.0f)}), std::sqrt(2.0) / 2.01,
                1e-6);
}

TEST(Flicker, IsTheMeanStepOfWhatIsShown) {
    const float bright = 1e9f;  // Shown as 1.
    EXPECT_NEAR(core::flicker(std::vector<Frame>{gray(0), gray(bright), gray(0)}, 0.0f), 1.0, 1e-6);
    EXPECT_NEAR(core::flicker(std::vector<Frame>{gray(0), gray(0), gray(bright), gray(bright)}, 0.0f),
                1.0 / 3.0, 1e-6);
    EXPECT_EQ(core::flicker(std::vector<Frame>(3, gray(1.0f)), 0.0f), 0.0);
    // Shown as nearly black, noise is hardly seen.
    EXPECT_LT(core::flicker(noisy(8, 1.0f, 0.2f), 12.0f), 0.1 * core::flicker(noisy(8, 1.0f, 0.2f), 0.0f));
}

TEST(ReactionFrames, CountsUntilOneTwentiethOfTheChangeRemains) {
    // Half of the change is made up for with each frame: 1/2, 1/4, 1/8, 1/16, 1/32 <= 0.05.
    std::vector<Frame> frames;
    for (int i = 1; i <= 10; ++i) frames.push_back(gray(1.0f - std::exp2(static_cast<float>(-i))));
    EXPECT_EQ(core::reaction_frames(frames, gray(0), gray(1), kWidth), 4u);
    // A light that goes out is no special case.
    for (Frame& frame : frames) {
        for (glm::vec3& color : frame) color = glm::vec3(1.0f) - color;
    }
    EXPECT_EQ(core::reaction_frames(frames, gray(1), gray(0), kWidth), 4u);
    const Frame there[] = {gray(1)};
    EXPECT_EQ(core::reaction_frames(there, gray(0), gray(1), kWidth), 0u);
}

TEST(ReactionFrames, LooksAtTheChangeWhereverItIs) {
    // A box has moved by a quarter of the picture: the mean is the same all the time.
    Frame before = gray(1), after = gray(1);
    for (std::size_t i = 0; i < kPixels; ++i) {
        if (i % kWidth < 16) before[i] = glm::vec3(0.2f);
        if (i % kWidth >= 16 && i % kWidth < 32) after[i] = glm::vec3(0.2f);
    }
    EXPECT_EQ(core::reaction_frames(std::vector<Frame>{before, after, after}, before, after, kWidth), 1u);
    // What comes and goes has not settled.
    EXPECT_EQ(core::reaction_frames(std::vector<Frame>{after, before, after}, before, after, kWidth), 2u);
}

TEST(ReactionFrames, DoNotTakeNoiseForLateness) {
    // 0.3 in a pixel, 0.3 / 16 = 0.02 in a block of 16 x 16.
    EXPECT_EQ(core::reaction_frames(noisy(4, 1.0f, 0.3f), gray(0), gray(1), kWidth), 0u);
    core::ReactionOptions pixels;
    pixels.block = 1;
    EXPECT_FALSE(core::reaction_frames(noisy(4, 1.0f, 0.3f), gray(0), gray(1), kWidth, pixels));
}

TEST(ReactionFrames, AreNothingWhereTheSequenceNeverArrives) {
    EXPECT_FALSE(core::reaction_frames(std::vector<Frame>(9, gray(0.9f)), gray(0), gray(1), kWidth));
    EXPECT_FALSE(core::reaction_frames(std::vector<Frame>(9, gray(1)), gray(1), gray(1), kWidth));
}

TEST(Temporal, IsNothingBesideABrokenPixel) {
    std::vector<Frame> frames(3, gray(1));
    frames[1][7].g = std::numeric_limits<float>::quiet_NaN();
    EXPECT_TRUE(std::isnan(core::temporal_deviation(frames)));
    EXPECT_TRUE(std::isnan(core::flicker(frames, 0.0f)));
    EXPECT_FALSE(core::reaction_frames(frames, gray(0), gray(1), kWidth));
}

}  // namespace
