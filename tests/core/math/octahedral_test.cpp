#include "core/math/octahedral.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/analytic_scenes.h"

namespace {

float angle_between(const glm::vec3& a, const glm::vec3& b) {
    return 2.0f * std::asin(std::min(1.0f, 0.5f * glm::length(a - b)));
}

glm::vec3 texel_direction(const glm::ivec2& texel, int resolution) {
    return core::direction_from_octahedral((glm::vec2(texel) + 0.5f) / static_cast<float>(resolution));
}

TEST(Octahedral, ReturnsEveryDirection) {
    std::vector<glm::vec3> directions;
    for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
            for (int z = -1; z <= 1; ++z) {
                if (x != 0 || y != 0 || z != 0) directions.push_back(glm::normalize(glm::vec3(x, y, z)));
            }
        }
    }
    for (const float z : {1.0f, -1.0f}) {  // Close to the poles, where a naive map loses half its digits.
        for (const float planar : {1e-2f, 1e-4f, 1e-6f}) {
            directions.push_back(glm::normalize(glm::vec3(planar, -0.3f * planar, z)));
        }
    }
    tests::TestRandom random(4);
    for (int i = 0; i < 100000; ++i) directions.emplace_back(random.direction());
    for (const glm::vec3& direction : directions) {
        const glm::vec2 point = core::octahedral_from_direction(direction);
        EXPECT_TRUE(point.x >= 0.0f && point.x <= 1.0f && point.y >= 0.0f && point.y <= 1.0f);
        const glm::vec3 back = core::direction_from_octahedral(point);
        EXPECT_NEAR(glm::length(back), 1.0f, 1e-6f);
        // A point has steps of 6e-8, which the map stretches by up to about 4; a few roundings on top.
        EXPECT_LT(glm::length(back - direction), 2e-6f)
            << direction.x << " " << direction.y << " " << direction.z;
    }
}

TEST(Octahedral, ReturnsEveryPointInside) {
    tests::TestRandom random(5);
    for (int i = 0; i < 100000; ++i) {
        const glm::vec2 point(0.001 + 0.998 * random.uniform(), 0.001 + 0.998 * random.uniform());
        const glm::vec2 back = core::octahedral_from_direction(core::direction_from_octahedral(point));
        EXPECT_LT(glm::length(back - point), 2e-6f) << point.x << " " << point.y;  // Rounding, as above.
    }
}

TEST(Octahedral, HasThePolesInTheCentreAndTheCorners) {
    EXPECT_FLOAT_EQ(core::direction_from_octahedral({0.5f, 0.5f}).z, 1.0f);
    for (const float x : {0.0f, 1.0f}) {
        for (const float y : {0.0f, 1.0f}) EXPECT_FLOAT_EQ(core::direction_from_octahedral({x, y}).z, -1.0f);
    }
}

TEST(Octahedral, GivesEveryTexelTheSameSolidAngle) {
    constexpr int kResolution = 8;
    constexpr int kCells = 64;  // Per texel and axis: great circles for its edges err by about 1 / 64^2.
    const auto corner = [](int x, int y) {
        return glm::dvec3(
            core::direction_from_octahedral(glm::vec2(x, y) / static_cast<float>(kResolution * kCells)));
    };
    // Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983.
    const auto solid_angle = [](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
        return 2.0 * std::atan2(glm::dot(a, glm::cross(b, c)),
                                1.0 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
    };
    for (int texel = 0; texel < kResolution * kResolution; ++texel) {
        const int first_x = texel % kResolution * kCells;
        const int first_y = texel / kResolution * kCells;
        double sum = 0.0;
        for (int y = first_y; y < first_y + kCells; ++y) {
            for (int x = first_x; x < first_x + kCells; ++x) {
                sum += solid_angle(corner(x, y), corner(x + 1, y), corner(x + 1, y + 1)) +
                       solid_angle(corner(x, y), corner(x + 1, y + 1), corner(x, y + 1));
            }
        }
        const double expected = 4.0 * 3.14159265358979 / (kResolution * kResolution);
        EXPECT_NEAR(std::abs(sum) / expected, 1.0, 1e-3) << "texel " << texel;
    }
}

TEST(Octahedral, ContinuesAcrossItsEdgesInTheWrappedTexel) {
    constexpr int kResolution = 16;
    float largest_step = 0.0f;
    float largest_diagonal = 0.0f;
    for (int y = 0; y + 1 < kResolution; ++y) {
        for (int x = 0; x + 1 < kResolution; ++x) {
            const glm::vec3 here = texel_direction({x, y}, kResolution);
            const glm::vec3 right = texel_direction({x + 1, y}, kResolution);
            const glm::vec3 below = texel_direction({x, y + 1}, kResolution);
            const glm::vec3 across = texel_direction({x + 1, y + 1}, kResolution);
            largest_step = std::max({largest_step, angle_between(here, right), angle_between(here, below)});
            largest_diagonal =
                std::max({largest_diagonal, angle_between(here, across), angle_between(right, below)});
        }
    }
    const auto step_to = [&](const glm::ivec2& inside, const glm::ivec2& outside) {
        const glm::ivec2 wrapped = core::wrap_octahedral_texel(outside, kResolution);
        EXPECT_TRUE(wrapped.x >= 0 && wrapped.x < kResolution && wrapped.y >= 0 && wrapped.y < kResolution);
        EXPECT_NE(wrapped, inside);
        return angle_between(texel_direction(inside, kResolution), texel_direction(wrapped, kResolution));
    };
    constexpr float kSlack = 1.0001f;  // Rounding.
    constexpr int kLast = kResolution - 1;
    for (int i = 0; i < kResolution; ++i) {
        EXPECT_LE(step_to({0, i}, {-1, i}), kSlack * largest_step);
        EXPECT_LE(step_to({kLast, i}, {kResolution, i}), kSlack * largest_step);
        EXPECT_LE(step_to({i, 0}, {i, -1}), kSlack * largest_step);
        EXPECT_LE(step_to({i, kLast}, {i, kResolution}), kSlack * largest_step);
    }
    for (const int x : {0, kLast}) {
        for (const int y : {0, kLast}) {
            const glm::ivec2 outside(x == 0 ? -1 : kResolution, y == 0 ? -1 : kResolution);
            EXPECT_LE(step_to({x, y}, outside), kSlack * largest_diagonal);
        }
    }
    EXPECT_EQ(core::wrap_octahedral_texel({3, 5}, kResolution), glm::ivec2(3, 5));
}

}  // namespace
