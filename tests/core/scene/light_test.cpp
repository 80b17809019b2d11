#include "core/scene/light.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/math/sampling.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/chi_square.h"

namespace {

TEST(PointLight, FallsWithTheSquareOfTheDistance) {
    const core::Light light = core::PointLight{"p", {0, 2, 0}, glm::vec3(8.0f)};
    const core::LightSample sample = core::sample_light(light, glm::vec3(0.0f), glm::vec2(0.5f));
    EXPECT_FLOAT_EQ(sample.radiance.x, 2.0f);
    EXPECT_FLOAT_EQ(sample.distance, 2.0f);
    EXPECT_TRUE(sample.delta);
    EXPECT_FLOAT_EQ(sample.direction.y, 1.0f);
}

TEST(SpotLight, IsDarkOutsideItsOuterConeAndFullInsideTheInner) {
    core::SpotLight spot{"s", {0, 1, 0}, {0, -1, 0}, glm::vec3(1.0f), std::cos(0.2f), std::cos(0.4f)};
    EXPECT_FLOAT_EQ(core::sample_light(spot, {0.1f, 0, 0}, {}).radiance.x, 1.0f / 1.01f);
    EXPECT_EQ(core::sample_light(spot, {0.5f, 0, 0}, {}).pdf, 0.0f);
    const float between = core::sample_light(spot, {0.3f, 0, 0}, {}).radiance.x;
    EXPECT_GT(between, 0.0f);
    EXPECT_LT(between, 1.0f / 1.09f);
}

TEST(Sun, GivesItsIlluminanceThroughItsDisc) {
    // Monte Carlo over the disc: E = integral of L cos. 1e-3: the cosine varies by 1e-5 over the sun, the
    // rest is rounding.
    const core::DirectionalLight sun = core::make_sun(0.5f, 0.9f, 68300.0f, 0.53f * core::kPi / 180.0f);
    tests::TestRandom random(1);
    double sum = 0.0;
    for (int i = 0; i < 10000; ++i) {
        const core::LightSample sample =
            core::sample_light(sun, glm::vec3(0.0f),
                               {static_cast<float>(random.uniform()), static_cast<float>(random.uniform())});
        sum +=
            static_cast<double>(sample.radiance.x / sample.pdf * -glm::dot(sample.direction, sun.direction));
    }
    EXPECT_NEAR(sum / 10000.0 / 68300.0, 1.0, 1e-3);
}

TEST(Sun, IsSeenExactlyWhereItIsSampled) {
    const core::DirectionalLight sun = core::make_sun(0.5f, 0.9f, 1.0f, 0.53f * core::kPi / 180.0f);
    tests::TestRandom random(1);
    int outside = 0;
    for (int i = 0; i < 10000; ++i) {
        const core::LightSample sample =
            core::sample_light(sun, glm::vec3(0.0f),
                               {static_cast<float>(random.uniform()), static_cast<float>(random.uniform())});
        const core::LightEmission emission = core::emission_along(sun, sample.direction);
        if (emission.pdf == 0.0f) {
            ++outside;
            continue;
        }
        EXPECT_FLOAT_EQ(emission.pdf, sample.pdf);
        EXPECT_EQ(emission.radiance, sample.radiance);
    }
    EXPECT_LE(outside, 10);  // Rounding of a unit vector moves the rim by 1e-7 / 4.6e-3 of its radius.
    EXPECT_EQ(core::emission_along(sun, sun.direction).pdf, 0.0f) << "behind";
}

TEST(Sun, StandsWhereAzimuthAndElevationSay) {
    const float quarter = core::kPi / 2.0f;
    EXPECT_NEAR(core::make_sun(0, 0, 1, 0).direction.z, -1.0f, 1e-6f) << "azimuth 0: the sun is towards +Z";
    EXPECT_NEAR(core::make_sun(quarter, 0, 1, 0).direction.x, -1.0f, 1e-6f) << "azimuth 90: towards +X";
    EXPECT_NEAR(core::make_sun(0, quarter, 1, 0).direction.y, -1.0f, 1e-6f) << "elevation 90: overhead";
}

}  // namespace
