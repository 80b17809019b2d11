#include "core/scene/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/support/error.h"
#include "tests/core/scene/gltf_builder.h"

namespace {

/// Exact arithmetic on 8-bit codes, rounded a few times in float.
constexpr float kRounding = 1e-6f;

/// Four grey texels in a row: 0, 85, 170, 255, with alpha running the other way.
core::TextureImage ramp() {
    core::TextureImage image;
    image.width = 4;
    image.height = 1;
    image.rgba = {0, 0, 0, 255, 85, 85, 85, 170, 170, 170, 170, 85, 255, 255, 255, 0};
    return image;
}

float red_at(float u, core::TextureWrap wrap, bool nearest = false) {
    core::Texture texture;
    texture.wrap_u = wrap;
    texture.wrap_v = wrap;
    texture.nearest = nearest;
    return core::sample_texture(texture, ramp(), {u, 0.5f}, false).r;
}

TEST(Texture, TexelCentresReturnTheirValue) {
    for (int x = 0; x < 4; ++x) {
        const float u = (static_cast<float>(x) + 0.5f) / 4.0f;
        EXPECT_NEAR(red_at(u, core::TextureWrap::kRepeat), static_cast<float>(x) / 3.0f, kRounding);
    }
}

TEST(Texture, BetweenCentresItIsLinear) {
    EXPECT_NEAR(red_at(0.25f, core::TextureWrap::kRepeat), 0.5f / 3.0f, kRounding);
    EXPECT_NEAR(red_at(0.4375f, core::TextureWrap::kRepeat), 1.25f / 3.0f, kRounding);
}

TEST(Texture, NearestReturnsWholeTexels) {
    EXPECT_NEAR(red_at(0.26f, core::TextureWrap::kRepeat, true), 1.0f / 3.0f, kRounding);
    EXPECT_NEAR(red_at(0.49f, core::TextureWrap::kRepeat, true), 1.0f / 3.0f, kRounding);
    EXPECT_NEAR(red_at(1.0f, core::TextureWrap::kClampToEdge, true), 1.0f, kRounding);
}

TEST(Texture, RepeatBlendsAcrossTheSeam) {
    EXPECT_NEAR(red_at(0.0f, core::TextureWrap::kRepeat), 0.5f, kRounding);
    EXPECT_NEAR(red_at(-3.0f, core::TextureWrap::kRepeat), 0.5f, kRounding);
    EXPECT_NEAR(red_at(2.125f, core::TextureWrap::kRepeat), 0.0f, kRounding);
}

TEST(Texture, ClampHoldsTheEdge) {
    EXPECT_NEAR(red_at(-7.0f, core::TextureWrap::kClampToEdge), 0.0f, kRounding);
    EXPECT_NEAR(red_at(9.0f, core::TextureWrap::kClampToEdge), 1.0f, kRounding);
}

TEST(Texture, MirrorsEverySecondPeriod) {
    for (const float u : {0.1f, 0.4f, 0.875f}) {
        const float inside = red_at(u, core::TextureWrap::kMirroredRepeat);
        EXPECT_NEAR(inside, red_at(u, core::TextureWrap::kClampToEdge), kRounding);
        for (const float image : {-u, 2.0f - u, 2.0f + u, u - 2.0f}) {
            // 2 + u is rounded at 2e-7, times the slope of 4 / 3.
            EXPECT_NEAR(red_at(image, core::TextureWrap::kMirroredRepeat), inside, 2 * kRounding) << image;
        }
    }
}

TEST(Texture, RowZeroIsAtTheTop) {
    core::TextureImage image;
    image.width = 1;
    image.height = 2;
    image.rgba = {255, 0, 0, 255, 0, 0, 255, 255};
    core::Texture texture;
    texture.nearest = true;
    EXPECT_EQ(core::sample_texture(texture, image, {0.5f, 0.1f}, false).r, 1.0f);
    EXPECT_EQ(core::sample_texture(texture, image, {0.5f, 0.9f}, false).b, 1.0f);
}

TEST(Texture, ColoursGoThroughTheSrgbCurveAndAlphaDoesNot) {
    const glm::vec4 value = core::sample_texture({}, ramp(), {0.375f, 0.5f}, true);
    EXPECT_NEAR(value.r, std::pow((85.0 / 255.0 + 0.055) / 1.055, 2.4), kRounding);
    EXPECT_NEAR(value.a, 170.0f / 255.0f, kRounding);
}

TEST(Texture, FilteringHappensInLinearSpace) {
    // Half way between black and white texels lies half the light, not the light of a middle grey.
    core::TextureImage image;
    image.width = 2;
    image.height = 1;
    image.rgba = {0, 0, 0, 255, 255, 255, 255, 255};
    EXPECT_NEAR(core::sample_texture({}, image, {0.5f, 0.5f}, true).r, 0.5f, kRounding);
}

TEST(Texture, AnyCoordinateGivesAFiniteValue) {
    const float values[] = {std::numeric_limits<float>::quiet_NaN(),
                            std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::max(),
                            -std::numeric_limits<float>::max(),
                            -1e-30f,
                            16777217.0f,
                            std::nextafter(1.0f, 0.0f),
                            std::nextafter(2.0f, 0.0f),
                            std::nextafter(0.0f, -1.0f)};
    for (const auto wrap :
         {core::TextureWrap::kRepeat, core::TextureWrap::kClampToEdge, core::TextureWrap::kMirroredRepeat}) {
        for (const bool nearest : {false, true}) {
            for (const float u : values) {
                const float value = red_at(u, wrap, nearest);
                EXPECT_GE(value, 0.0f) << u;
                EXPECT_LE(value, 1.0f) << u;
            }
        }
    }
}

TEST(Texture, DecodingReturnsTheTexelsOfAPng) {
    const std::vector<std::uint8_t> rgba = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    const core::TextureImage image = core::decode_texture_image(tests::encode_png(3, 1, rgba), "three");
    EXPECT_EQ(image.width, 3);
    EXPECT_EQ(image.height, 1);
    EXPECT_EQ(image.rgba, rgba);
}

TEST(Texture, DamagedAndBoundlessImagesAreRefusedByName) {
    const auto message = [](const std::vector<std::uint8_t>& bytes) {
        try {
            core::decode_texture_image(bytes, "bricks");
        } catch (const core::InputError& error) {
            EXPECT_EQ(error.kind(), core::ErrorKind::kBadData);
            return std::string(error.what());
        }
        return std::string("no error");
    };
    std::vector<std::uint8_t> png = tests::encode_png(1, 1, {1, 2, 3, 4});
    EXPECT_EQ(message(png), "no error");
    EXPECT_NE(message({}).find("'bricks'"), std::string::npos);
    EXPECT_NE(message({'B', 'M', 0, 0}).find("neither PNG nor JPEG"), std::string::npos);
    EXPECT_NE(message({png.begin(), png.begin() + 45}).find("bricks"), std::string::npos);
    // The header's width and height: bytes 16 to 23, big-endian.
    std::vector<std::uint8_t> huge = png;
    huge[17] = huge[21] = 1;
    EXPECT_NE(message(huge), "no error") << "65536 x 65536 texels";
    std::vector<std::uint8_t> lying = png;
    lying[18] = lying[22] = 16;
    EXPECT_NE(message(lying).find("claims 4097 x 4097"), std::string::npos) << message(lying);
    // The length of the chunk after the header: bytes 33 to 36.
    std::vector<std::uint8_t> endless = png;
    endless[33] = 0x7e;
    EXPECT_NE(message(endless).find("claims a chunk of 21139292"), std::string::npos) << message(endless);
}

}  // namespace
