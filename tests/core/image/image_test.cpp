// tests/core/image/image_test.cpp: channels by name, colours to planes and back.
#include "core/image/image.h"

#include <gtest/gtest.h>

#include <limits>

namespace {

TEST(Image, JoinsTheColoursItWasGiven) {
    core::Image image(2, 1);
    const std::vector<glm::vec3> beauty{{1, 2, 3}, {4, 5, 6}}, direct{{7, 8, 9}, {10, 11, 12}};
    image.add_color("", beauty);
    image.add_color("Direct", direct);
    EXPECT_EQ(image.color(), beauty);
    EXPECT_EQ(image.color("Direct"), direct);
    EXPECT_FALSE(image.color("Albedo"));
    EXPECT_EQ(*image.find("Direct.G"), (std::vector<float>{8, 11}));
}

TEST(Image, NamesVectorsByAxis) {
    core::Image image(1, 1);
    image.add_vector("Normal", {{0, 0, 1}});
    EXPECT_EQ((*image.find("Normal.Z"))[0], 1.0f);
    EXPECT_EQ(image.find("Normal.R"), nullptr);
    EXPECT_FALSE(image.color("Normal"));
}

TEST(Image, FillsANewChannelAndLetsItBeWritten) {
    core::Image image(3, 2);
    image.add_channel("Depth.Z", 5.0f)[4] = 6.0f;
    EXPECT_EQ(*image.find("Depth.Z"), (std::vector<float>{5, 5, 5, 5, 6, 5}));
}

TEST(Image, CountsEveryNonfiniteValueOfEveryChannel) {
    core::Image image(2, 1);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    image.add_channel("R", {std::numeric_limits<float>::quiet_NaN(), 1.0f});
    image.add_channel("Depth.Z", {kInfinity, -kInfinity});
    EXPECT_EQ(core::count_nonfinite(image), 3u);
}

TEST(Luminance, OfWhiteIsOne) {
    // The three weights are rounded to float, each by at most 2^-25.
    EXPECT_NEAR(core::luminance({1, 1, 1}), 1.0f, 1e-6f);
}

}  // namespace
