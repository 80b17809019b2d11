#include "core/math/spherical_harmonics.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/math/octahedral.h"
#include "core/math/sampling.h"
#include "tests/support/analytic_scenes.h"

namespace {

/// The integral over the sphere by the midpoint rule on an equal-area map. Errs by about 1 / 128^2, times the
/// second derivatives.
template <typename Function>
double integrate(const Function& function) {
    constexpr int kResolution = 128;
    double sum = 0.0;
    for (int y = 0; y < kResolution; ++y) {
        for (int x = 0; x < kResolution; ++x) {
            sum += static_cast<double>(function(
                core::direction_from_octahedral((glm::vec2(x, y) + 0.5f) / static_cast<float>(kResolution))));
        }
    }
    return sum * 4.0 * static_cast<double>(core::kPi) / (kResolution * kResolution);
}

template <typename Function>
core::Sh project(const Function& radiance) {
    core::Sh result{};
    for (std::size_t i = 0; i < core::kShCount; ++i) {
        result[i] = static_cast<float>(
            integrate([&](const glm::vec3& d) { return radiance(d) * core::sh_basis(d)[i]; }));
    }
    return result;
}

constexpr double kQuadratureError = 2e-3;

TEST(SphericalHarmonics, AreOrthonormal) {
    for (std::size_t i = 0; i < core::kShCount; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            const double product = integrate([&](const glm::vec3& d) {
                const core::Sh basis = core::sh_basis(d);
                return basis[i] * basis[j];
            });
            EXPECT_NEAR(product, i == j ? 1.0 : 0.0, kQuadratureError) << i << " " << j;
        }
    }
}

TEST(SphericalHarmonics, GiveAConstantTheIrradiancePi) {
    const core::Sh light = project([](const glm::vec3&) { return 1.0f; });
    tests::TestRandom random(3);
    for (int i = 0; i < 100; ++i) {
        const glm::vec3 normal(random.direction());
        EXPECT_NEAR(core::sh_dot(light, core::sh_clamped_cosine(normal)), core::kPi, kQuadratureError);
    }
}

TEST(SphericalHarmonics, GiveLightShapedLikeACosineItsExactIrradiance) {
    // The integral of max(0, n.d) (1 + a.d) is pi + 2 pi / 3 a.n.
    const glm::vec3 slope(0.3f, -0.5f, 0.4f);
    const core::Sh light = project([&](const glm::vec3& d) { return 1.0f + glm::dot(slope, d); });
    tests::TestRandom random(4);
    for (int i = 0; i < 100; ++i) {
        const glm::vec3 normal(random.direction());
        EXPECT_NEAR(core::sh_dot(light, core::sh_clamped_cosine(normal)),
                    core::kPi + 2.0f * core::kPi / 3.0f * glm::dot(slope, normal), kQuadratureError);
    }
}

TEST(SphericalHarmonics, GiveQuadraticLightTheIrradianceOfQuadrature) {
    const auto radiance = [](const glm::vec3& d) {
        return 1.0f + 0.4f * d.x * d.y - 0.3f * d.y * d.z + 0.5f * d.z * d.z + 0.2f * d.x * d.z -
               0.6f * d.x * d.x;
    };
    const core::Sh light = project(radiance);
    tests::TestRandom random(5);
    for (int i = 0; i < 30; ++i) {
        const glm::vec3 normal(random.direction());
        const double truth =
            integrate([&](const glm::vec3& d) { return radiance(d) * std::max(0.0f, glm::dot(normal, d)); });
        EXPECT_NEAR(core::sh_dot(light, core::sh_clamped_cosine(normal)), truth, kQuadratureError);
    }
}

TEST(SphericalHarmonics, TreatColoursChannelByChannel) {
    core::ShColor color{};
    core::Sh green{};
    for (std::size_t i = 0; i < core::kShCount; ++i) {
        green[i] = 0.1f * static_cast<float>(i);
        color[i] = {1.0f, green[i], 0.0f};
    }
    const core::Sh basis = core::sh_basis(glm::normalize(glm::vec3(1.0f, 2.0f, -0.5f)));
    EXPECT_FLOAT_EQ(core::sh_dot(color, basis).y, core::sh_dot(green, basis));
    EXPECT_EQ(core::sh_dot(color, basis).z, 0.0f);
}

}  // namespace
