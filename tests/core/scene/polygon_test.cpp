#include "core/scene/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

namespace {

using Polygon = std::vector<glm::vec3>;

std::vector<glm::uvec3> split(const Polygon& polygon) {
    core::PolygonSplitter splitter(1000);
    std::vector<glm::uvec3> triangles;
    EXPECT_TRUE(splitter.split(polygon, triangles)) << splitter.limits();
    return triangles;
}

double area(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
    return 0.5 * glm::length(glm::cross(glm::dvec3(b) - glm::dvec3(a), glm::dvec3(c) - glm::dvec3(a)));
}

glm::dvec3 area_vector(const Polygon& polygon) {
    glm::dvec3 sum(0.0);
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        sum += 0.5 * glm::cross(glm::dvec3(polygon[i]), glm::dvec3(polygon[(i + 1) % polygon.size()]));
    }
    return sum;
}

/// Triangles that face as the polygon does and whose areas add up to its own cover it without overlap: any
/// overlap or piece outside would make the sum larger.
void expect_exact_cover(const Polygon& polygon) {
    const std::vector<glm::uvec3> triangles = split(polygon);
    ASSERT_EQ(triangles.size(), polygon.size() - 2);
    const glm::dvec3 whole = area_vector(polygon);
    double sum = 0.0;
    for (const glm::uvec3& t : triangles) {
        const glm::dvec3 part = area_vector({polygon[t.x], polygon[t.y], polygon[t.z]});
        EXPECT_GE(glm::dot(part, whole), -1e-6 * glm::dot(whole, whole));
        sum += area(polygon[t.x], polygon[t.y], polygon[t.z]);
    }
    // Float corners: a relative rounding of 6e-8 each, over few of them.
    EXPECT_NEAR(sum, glm::length(whole), 1e-5 * glm::length(whole));
}

Polygon turned(Polygon polygon, const glm::mat3& rotation, const glm::vec3& shift) {
    for (glm::vec3& corner : polygon) corner = rotation * corner + shift;
    return polygon;
}

TEST(Polygon, ConvexOnesBecomeAFanOfTheirFirstCorner) {
    EXPECT_EQ(split({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), (std::vector<glm::uvec3>{{0, 1, 2}}));
    EXPECT_EQ(split({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}),
              (std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Polygon, ConcaveOnesAreCoveredFromEveryCornerAndInEveryPlane) {
    const std::vector<Polygon> shapes = {
        {{0, 0, 0}, {2, 0, 0}, {0.5f, 0.5f, 0}, {0, 2, 0}},                                        // arrow
        {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 2, 0}, {3, 2, 0}, {3, 3, 0}, {0, 3, 0}},  // C
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {1, 1, 0}, {0, 1, 0}},  // straight corner
        // A square with a square hole, joined by a slit.
        {{0, 0, 0},
         {4, 0, 0},
         {4, 4, 0},
         {0, 4, 0},
         {0, 0, 0},
         {1, 1, 0},
         {1, 3, 0},
         {3, 3, 0},
         {3, 1, 0},
         {1, 1, 0}},
    };
    const glm::mat3 rotations[] = {glm::mat3(1.0f), glm::mat3(0, 1, 0, 0, 0, 1, 1, 0, 0),
                                   glm::mat3(0, 0, 1, 1, 0, 0, 0, 1, 0),
                                   glm::mat3(-1, 0, 0, 0, 1, 0, 0, 0, -1),
                                   glm::mat3(0.36f, 0.48f, -0.8f, -0.8f, 0.6f, 0, 0.48f, 0.64f, 0.6f)};
    for (const Polygon& shape : shapes) {
        for (const glm::mat3& rotation : rotations) {
            Polygon polygon = turned(shape, rotation, {5, -3, 2});
            for (std::size_t first = 0; first < polygon.size(); ++first) {
                expect_exact_cover(polygon);
                std::rotate(polygon.begin(), polygon.begin() + 1, polygon.end());
            }
            std::reverse(polygon.begin(), polygon.end());
            expect_exact_cover(polygon);
        }
    }
}

TEST(Polygon, RandomStarsAreCovered) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> radius(0.1f, 1.0f);
    for (int round = 0; round < 200; ++round) {
        const int count = 4 + round % 60;
        Polygon polygon;
        for (int i = 0; i < count; ++i) {
            const double angle = 2.0 * std::numbers::pi * i / count;
            const float r = radius(random);
            polygon.emplace_back(r * std::cos(angle), 3.0f, r * std::sin(angle));
        }
        expect_exact_cover(polygon);
    }
}

TEST(Polygon, OnesWithoutAreaOrCrossingThemselvesStillUseEveryCorner) {
    Polygon pentagram;
    for (int i = 0; i < 5; ++i) {
        const double angle = 4.0 * std::numbers::pi * i / 5.0;
        pentagram.emplace_back(std::cos(angle), std::sin(angle), 0.0);
    }
    const std::vector<Polygon> shapes = {
        Polygon(5, glm::vec3(1.0f)),
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}},
        {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}},  // bow tie: no area in sum
        {{0, 0, 0}, {2, 1, 0}, {2, 0, 0}, {0, 3, 0}},
        pentagram,
    };
    for (const Polygon& shape : shapes) {
        const std::vector<glm::uvec3> triangles = split(shape);
        ASSERT_EQ(triangles.size(), shape.size() - 2);
        std::set<std::uint32_t> used;
        for (const glm::uvec3& t : triangles) used.insert({t.x, t.y, t.z});
        EXPECT_EQ(used.size(), shape.size());
    }
}

Polygon comb(int teeth) {
    Polygon polygon = {{static_cast<float>(teeth), -1, 0}, {0, -1, 0}};
    std::reverse(polygon.begin(), polygon.end());
    for (int i = teeth; i > 0; --i) {
        polygon.emplace_back(static_cast<float>(i), 1.0f, 0.0f);
        polygon.emplace_back(static_cast<float>(i) - 0.5f, 0.0f, 0.0f);
    }
    return polygon;
}

TEST(Polygon, ALargeCombIsCoveredAndAHugeOneRefusedInsteadOfSearchedForMinutes) {
    expect_exact_cover(comb(1000));
    core::PolygonSplitter splitter(1000);
    std::vector<glm::uvec3> triangles;
    EXPECT_FALSE(splitter.split(comb(100'000), triangles));
    EXPECT_NE(splitter.limits().find("file of 1000 bytes"), std::string::npos);
    // What is spent stays spent: many polygons cost as much as one.
    EXPECT_FALSE(splitter.split(comb(20'000), triangles));
}

TEST(Polygon, MemoryForTrianglesIsLimitedByTheFile) {
    core::PolygonSplitter small(1000);
    EXPECT_FALSE(small.charge_triangles(1'000'000));
    EXPECT_TRUE(small.charge_triangles(500'000));
    EXPECT_FALSE(small.charge_triangles(500'000));
    EXPECT_FALSE(small.charge_triangles(std::numeric_limits<std::uint64_t>::max()));
    EXPECT_TRUE(core::PolygonSplitter(10'000'000).charge_triangles(1'000'000));
}

}  // namespace
