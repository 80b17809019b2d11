#include "core/scene/sky.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/math/sampling.h"
#include "core/support/error.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/chi_square.h"
#include "tests/support/shared_data.h"

namespace {

core::Image picture(int width, int height, unsigned seed) {
    tests::TestRandom random(seed);
    std::vector<glm::vec3> colors(static_cast<std::size_t>(width * height));
    for (glm::vec3& color : colors) {
        color = glm::vec3(random.uniform(), random.uniform(), random.uniform());
        if (random.uniform() < 0.3) color = glm::vec3(0.0f);
        if (random.uniform() < 0.05) color *= 50.0f;
    }
    core::Image image(width, height);
    image.add_color("", colors);
    return image;
}

TEST(Sky, SamplesFollowTheirDensity) {
    const core::Sky sky = core::Sky::latitude_longitude(picture(16, 8, 3), 0.7f, "test");
    tests::ChiSquareSettings settings;
    settings.axis = {0.0f, 1.0f, 0.0f};
    settings.polar_cells = 20;
    settings.azimuth_cells = 40;
    settings.integration_points = 96;  // The density jumps between texels, whose borders lie within cells.
    settings.sample_count = 300'000;
    EXPECT_GT(tests::chi_square_p_value(
                  [&](const glm::vec2& u, float) -> std::optional<glm::vec3> {
                      const core::Sky::Sample sample = sky.sample(u);
                      if (!(sample.pdf > 0.0f)) return std::nullopt;
                      return sample.direction;
                  },
                  [&](const glm::vec3& d) { return sky.pdf(d); }, settings),
              0.01);
}

TEST(Sky, HasADensityWhereverItShines) {
    const core::Sky sky = core::Sky::latitude_longitude(picture(32, 16, 5), 0.0f, "test");
    tests::TestRandom random(8);
    for (int i = 0; i < 100000; ++i) {
        const glm::vec3 direction(random.direction());
        if (sky.radiance(direction).x > 0.0f) {
            EXPECT_GT(sky.pdf(direction), 0.0f);
        }
    }
}

TEST(Sky, EstimatesItsOwnIrradianceWithoutBias) {
    const core::Sky sky = core::Sky::latitude_longitude(picture(16, 8, 3), 0.0f, "test");
    double by_sampling = 0.0, by_uniform = 0.0;
    tests::TestRandom random(2);
    constexpr int kCount = 400000;
    for (int i = 0; i < kCount; ++i) {
        const glm::vec2 u(static_cast<float>(random.uniform()), static_cast<float>(random.uniform()));
        const core::Sky::Sample sample = sky.sample(u);
        if (sample.pdf > 0.0f) by_sampling += static_cast<double>(sample.radiance.y / sample.pdf);
        by_uniform +=
            static_cast<double>(sky.radiance(core::sample_uniform_sphere(u)).y / core::kUniformSpherePdf);
    }
    EXPECT_NEAR(by_sampling / by_uniform, 1.0, 0.01);  // Uniform sampling's own noise is 0.3 %.
}

TEST(Sky, LooksAlongMinusZInItsMiddleColumnAndTurnsWithRotation) {
    core::Image image(8, 4);
    std::vector<glm::vec3> colors(32, glm::vec3(0.0f));
    colors[1 * 8 + 3] = colors[1 * 8 + 4] = colors[2 * 8 + 3] =
        colors[2 * 8 + 4] = {1.0f, 0.0f, 0.0f};  // Middle.
    colors[1 * 8 + 5] = colors[1 * 8 + 6] = colors[2 * 8 + 5] =
        colors[2 * 8 + 6] = {0.0f, 1.0f, 0.0f};  // To the right.
    for (std::size_t x = 0; x < 8; ++x) colors[x] = {0.0f, 0.0f, 1.0f};
    image.add_color("", colors);
    const core::Sky sky = core::Sky::latitude_longitude(image, 0.0f, "test");
    EXPECT_FLOAT_EQ(sky.radiance({0, 0, -1}).x, 1.0f);
    EXPECT_FLOAT_EQ(sky.radiance({1, 0, 0}).y, 1.0f);
    EXPECT_FLOAT_EQ(sky.radiance({0, 1, 0}).z, 1.0f);
    // A quarter turn about +Y takes -Z to -X.
    const core::Sky turned = core::Sky::latitude_longitude(image, core::kPi / 2.0f, "test");
    EXPECT_NEAR(turned.radiance({-1, 0, 0}).x, 1.0f, 1e-5f);
    EXPECT_NEAR(turned.radiance({0, 0, -1}).y, 1.0f, 1e-5f);
}

TEST(Sky, RefusesTexelsThatAreNotRadiance) {
    core::Image image(2, 1);
    image.add_color("", {glm::vec3(1.0f), glm::vec3(0.0f, -1.0f, 0.0f)});
    EXPECT_THROW(core::Sky::latitude_longitude(image, 0.0f, "bad"), core::InputError);
}

TEST(Sky, SurvivesOneTexelOfAHundredThousand) {
    core::Image image(64, 32);
    std::vector<glm::vec3> colors(64 * 32, glm::vec3(0.1f));
    colors[700] = glm::vec3(1e5f);
    image.add_color("", colors);
    const core::Sky sky = core::Sky::latitude_longitude(image, 0.0f, "bright");
    tests::TestRandom random(2);
    for (int i = 0; i < 10000; ++i) {
        const core::Sky::Sample sample =
            sky.sample({static_cast<float>(random.uniform()), static_cast<float>(random.uniform())});
        ASSERT_TRUE(std::isfinite(sample.pdf) && std::isfinite(sample.radiance.x));
        if (sample.pdf > 0.0f) {
            EXPECT_LT(sample.radiance.x / sample.pdf, 4e4f);
        }
    }
}

TEST(Sky, RefusesTexelsThatSumsCannotHoldByName) {
    // One short of the largest that an .hdr can hold: finite, but the sum of its neighbourhood is not.
    for (const float bad :
         {1.6e38f, -1.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
        core::Image image(4, 2);
        std::vector<glm::vec3> colors(4 * 2, glm::vec3(0.1f));
        colors[6].y = bad;
        image.add_color("", colors);
        try {
            core::Sky::latitude_longitude(image, 0.0f, "blinding");
            ADD_FAILURE() << bad << " was taken";
        } catch (const core::InputError& error) {
            EXPECT_NE(std::string(error.what()).find("'blinding': pixel (2, 1)"), std::string::npos)
                << error.what();
        }
    }
}

TEST(SkySplit, AddsUpToTheSkyAndClampsTheBase) {
    const core::Sky sky = core::Sky::latitude_longitude(picture(32, 16, 5), 0.6f, "test");
    for (const float ratio : {0.0f, 0.5f, 2.0f, 10.0f}) {
        const core::SkySplit split = core::split_sky(sky, ratio);
        EXPECT_FALSE(split.peaks.black());
        EXPECT_EQ(split.base.black(), ratio == 0.0f);
        EXPECT_NEAR(split.base.mean_luminance() + split.peaks.mean_luminance(), sky.mean_luminance(),
                    1e-5f * sky.mean_luminance());
        tests::TestRandom random(8);
        for (int i = 0; i < 20000; ++i) {
            const glm::vec3 direction(random.direction());
            const glm::vec3 whole = sky.radiance(direction);
            const glm::vec3 base = split.base.radiance(direction);
            const glm::vec3 peaks = split.peaks.radiance(direction);
            for (int channel = 0; channel < 3; ++channel) {
                // Rounding of texels up to 50.
                EXPECT_NEAR(base[channel] + peaks[channel], whole[channel], 2e-5f);
                EXPECT_GE(peaks[channel], 0.0f);
            }
            EXPECT_LE(core::luminance(base), ratio * sky.mean_luminance() * 1.00001f);
            if (core::luminance(peaks) > 0.0f) {
                EXPECT_GT(split.peaks.pdf(direction), 0.0f);
            }
        }
    }
}

TEST(SkySplit, SamplesThePeaksAlone) {
    core::Image image(64, 32);
    std::vector<glm::vec3> colors(64 * 32, glm::vec3(0.1f));
    colors[12 * 64 + 20] = glm::vec3(1e3f);
    image.add_color("", colors);
    const core::Sky sky = core::Sky::latitude_longitude(image, 0.0f, "test");
    const core::SkySplit split = core::split_sky(sky, 4.0f);
    tests::TestRandom random(2);
    for (int i = 0; i < 1000; ++i) {
        const core::Sky::Sample sample =
            split.peaks.sample({static_cast<float>(random.uniform()), static_cast<float>(random.uniform())});
        ASSERT_GT(sample.pdf, 0.0f);
        // The tent's corner has 1 of 16 parts, on a texel of at most 2 pi^2 / (64 x 32) sr. Uniform: 0.08.
        EXPECT_GT(sample.pdf, 0.9f / 16.0f * (64.0f * 32.0f) / (2.0f * core::kPi * core::kPi));
    }
}

TEST(SkySplit, LeavesASkyWithoutPeaksAsItIs) {
    const core::Sky sky = core::Sky::latitude_longitude(picture(8, 4, 3), 0.2f, "test");
    const core::SkySplit split = core::split_sky(sky, 1e6f);
    EXPECT_TRUE(split.peaks.black());
    EXPECT_EQ(split.peaks.radiance({0, 1, 0}), glm::vec3(0.0f));
    core::Hasher expected, actual;
    sky.add_to(expected);
    split.base.add_to(actual);
    EXPECT_EQ(expected.hex(), actual.hex());
    EXPECT_TRUE(core::split_sky(core::Sky(), 2.0f).base.black());
    EXPECT_TRUE(core::split_sky(core::Sky(), 0.0f).peaks.black());
}

TEST(SkySplit, SharesAConstantByTheRatio) {
    const glm::vec3 radiance(0.4f, 0.8f, 0.2f);
    const core::Sky sky = core::Sky::constant(radiance);
    for (const float ratio : {0.0f, 0.25f, 1.0f, 3.0f}) {
        const core::SkySplit split = core::split_sky(sky, ratio);
        EXPECT_EQ(split.base.black(), ratio == 0.0f);
        EXPECT_EQ(split.peaks.black(), ratio >= 1.0f);
        EXPECT_FLOAT_EQ(split.base.radiance({0, 1, 0}).y, std::min(ratio, 1.0f) * radiance.y);
        EXPECT_FLOAT_EQ((split.base.radiance({0, 1, 0}) + split.peaks.radiance({0, 1, 0})).x, radiance.x);
    }
}

TEST(Sky, ReadsRealPanoramas) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/skies");
    const core::Sky beach = core::Sky::read(folder / "spiaggia_di_mondello_1k.hdr", 0.0f);
    EXPECT_FALSE(beach.black());
    EXPECT_GT(beach.radiance({0, 1, 0}).z, beach.radiance({0, 1, 0}).x) << "the sky is blue overhead";
    EXPECT_FALSE(core::Sky::read(folder / "OrientationLatLong.exr", 0.0f).black());
}

}  // namespace
