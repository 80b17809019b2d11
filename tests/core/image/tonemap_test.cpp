// tests/core/image/tonemap_test.cpp: exposure, tone curves and the bytes of a preview.
#include "core/image/tonemap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/image/png.h"
#include "core/scene/texture.h"
#include "core/support/error.h"
#include "core/support/file_bytes.h"
#include "tests/support/shared_data.h"

namespace {

constexpr core::ToneMap kAll[] = {core::ToneMap::kAces, core::ToneMap::kLinear, core::ToneMap::kHable};
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

TEST(Exposure, DisplaysAsOneWhatSaturatesAtThatEv) {
    // displayed = radiance / (1.2 x 2^EV), by definition; powers of two are exact.
    EXPECT_FLOAT_EQ(core::exposure_scale(0.0f) * 1.2f, 1.0f);
    EXPECT_FLOAT_EQ(core::exposure_scale(10.0f) * 1.2f * 1024.0f, 1.0f);
}

TEST(Exposure, AutomaticShowsTheLogAverageAsOneOverNinePointSix) {
    const std::vector<glm::vec3> radiance{glm::vec3(1.0f), glm::vec3(100.0f), glm::vec3(0.0f),
                                          glm::vec3(kNaN)};
    // Log-average of 1 and 100 is 10; black and broken pixels do not count. Float: 1e-5 relative.
    EXPECT_NEAR(10.0f * core::exposure_scale(core::automatic_exposure(radiance)), 1.0f / 9.6f, 1e-6f);
}

TEST(Exposure, AutomaticSkipsPixelsWithoutCoverage) {
    const std::vector<glm::vec3> radiance{glm::vec3(4.0f), glm::vec3(1e6f)};
    const std::vector<float> alpha{1.0f, 0.0f};
    EXPECT_FLOAT_EQ(core::automatic_exposure(radiance, alpha), 5.0f);  // log2(8 x 4)
    EXPECT_EQ(core::automatic_exposure(std::vector<glm::vec3>(3)), 0.0f);
}

TEST(ToneCurve, RisesFromZeroToOneAndStaysInside) {
    for (const core::ToneMap tone_map : kAll) {
        EXPECT_NEAR(core::tone_curve(tone_map, glm::vec3(0.0f)).r, 0.0f, 1e-6f);
        EXPECT_EQ(core::tone_curve(tone_map, glm::vec3(-5.0f)).r,
                  core::tone_curve(tone_map, glm::vec3(0.0f)).r);
        float previous = -1.0f;
        for (float x = 0.0f; x < 20.0f; x += 0.01f) {
            const float y = core::tone_curve(tone_map, glm::vec3(x)).g;
            ASSERT_GE(y, previous - 1e-6f) << x;  // Rounding of a quotient near its limit.
            ASSERT_LE(y, 1.0f);
            previous = y;
        }
        EXPECT_EQ(core::tone_curve(tone_map, glm::vec3(std::numeric_limits<float>::max())).b, 1.0f);
    }
}

TEST(ToneCurve, HasThePublishedValues) {
    // Narkowicz: (x (2.51 x + .03)) / (x (2.43 x + .59) + .14) at 1 is 2.54 / 3.16.
    EXPECT_NEAR(core::tone_curve(core::ToneMap::kAces, glm::vec3(1.0f)).r, 2.54f / 3.16f, 1e-6f);
    EXPECT_EQ(core::tone_curve(core::ToneMap::kLinear, glm::vec3(0.25f)).r, 0.25f);
    // Hable: with bias 2 the white point 11.2 is reached at 5.6.
    EXPECT_NEAR(core::tone_curve(core::ToneMap::kHable, glm::vec3(5.6f)).r, 1.0f, 1e-6f);
    EXPECT_LT(core::tone_curve(core::ToneMap::kHable, glm::vec3(5.0f)).r, 1.0f);
}

TEST(Srgb, HasTheStandardsValues) {
    EXPECT_EQ(core::srgb_from_linear(0.0f), 0.0f);
    EXPECT_NEAR(core::srgb_from_linear(1.0f), 1.0f, 1e-6f);
    // 8-bit 128 is linear 0.21586 to five digits.
    EXPECT_NEAR(255.0f * core::srgb_from_linear(0.21586f), 128.0f, 0.01f);
    // The two pieces meet; the standard's rounded constants leave a gap below 1e-6 x 12.92.
    EXPECT_NEAR(core::srgb_from_linear(0.0031308f), core::srgb_from_linear(0.0031309f), 1e-5f);
}

TEST(DisplayPicture, ShowsBrokenPixelsInMagenta) {
    const std::vector<glm::vec3> radiance{
        {1, kNaN, 1}, {1.2f, 0.0f, 0.0f}, {std::numeric_limits<float>::infinity(), 0, 0}};
    EXPECT_EQ(core::display_picture(radiance, 0.0f, core::ToneMap::kLinear),
              (std::vector<std::uint8_t>{255, 0, 255, 255, 0, 0, 255, 0, 255}));
}

TEST(DisplayPicture, IsTheSameForHalfTheLightAtOneStopLess) {
    std::vector<glm::vec3> full, halved;
    for (int i = 0; i < 256; ++i) {
        full.push_back(glm::vec3(static_cast<float>(i) * 0.37f, static_cast<float>(i % 7), 1.0f));
        halved.push_back(full.back() * 0.5f);
    }
    for (const core::ToneMap tone_map : kAll) {
        EXPECT_EQ(core::display_picture(full, 5.0f, tone_map), core::display_picture(halved, 4.0f, tone_map));
    }
}

TEST(ToneMapName, KnowsThreeNames) {
    EXPECT_EQ(core::tone_map_from_name("aces"), core::ToneMap::kAces);
    EXPECT_EQ(core::tone_map_from_name("linear"), core::ToneMap::kLinear);
    EXPECT_EQ(core::tone_map_from_name("hable"), core::ToneMap::kHable);
    EXPECT_FALSE(core::tone_map_from_name("Aces"));
}

TEST(Png, ReadsBackEveryByte) {
    const tests::TemporaryFolder folder;
    constexpr int kWidth = 37, kHeight = 11;
    std::vector<std::uint8_t> rgb(3 * kWidth * kHeight);
    for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<std::uint8_t>(i * i * 7 % 256);
    core::write_png(folder.path() / "a.png", kWidth, kHeight, rgb);
    const core::TextureImage read =
        core::decode_texture_image(core::read_file_bytes(folder.path() / "a.png", 1 << 20), "a.png");
    ASSERT_EQ(read.width, kWidth);
    ASSERT_EQ(read.height, kHeight);
    for (std::size_t i = 0; i < rgb.size(); ++i) ASSERT_EQ(read.rgba[i / 3 * 4 + i % 3], rgb[i]) << i;
}

TEST(Png, AFailedWriteNamesThePath) {
    const tests::TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "missing" / "a.png";
    try {
        core::write_png(path, 1, 1, std::vector<std::uint8_t>{1, 2, 3});
        FAIL();
    } catch (const core::InputError& error) {
        EXPECT_EQ(error.kind(), core::ErrorKind::kCannotCreate);
        EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos);
    }
}

}  // namespace
