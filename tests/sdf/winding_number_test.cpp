#include "sdf/winding_number.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

std::vector<std::uint32_t> all_of(const std::vector<sdf::Triangle>& triangles) {
    std::vector<std::uint32_t> all(triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    return all;
}

/// Largest difference between fast and exact over random points in a box of twice the shape's size.
double largest_error(const core::Mesh& mesh, double beta) {
    const std::vector<sdf::Triangle> triangles = triangles_of(mesh);
    const sdf::TriangleBvh tree(triangles, all_of(triangles));
    const sdf::WindingNumber winding(tree);
    TestRandom random(7);
    double largest = 0.0;
    for (int i = 0; i < 400; ++i) {
        const glm::dvec3 point(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
        const double exact = sdf::exact_winding_number(triangles, point);
        largest = std::max(largest, std::abs(winding.at(point, beta) - exact));
    }
    return largest;
}

TEST(WindingNumber, OfAClosedMeshIsOneInsideAndZeroOutside) {
    const std::vector<sdf::Triangle> triangles = triangles_of(torus(1.0f, 0.4f));
    // Rounding of 4,096 terms of at most 1e-2 in double.
    EXPECT_NEAR(sdf::exact_winding_number(triangles, {1.0, 0.0, 0.0}), 1.0, 1e-12);
    EXPECT_NEAR(sdf::exact_winding_number(triangles, {0.0, 0.0, 0.0}), 0.0, 1e-12);
    EXPECT_NEAR(sdf::exact_winding_number(triangles_of(reversed(torus(1.0f, 0.4f))), {1.0, 0.0, 0.0}), -1.0,
                1e-12);
}

TEST(WindingNumber, OfATriangleIsItsSolidAngleOverFourPi) {
    // The three coordinate axes span an octant: an eighth of the sphere seen from the origin.
    const sdf::Triangle octant{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    EXPECT_NEAR(sdf::triangle_winding_number(octant, glm::dvec3(0.0)), 0.125, 1e-15);
    const sdf::Triangle turned{{1, 0, 0}, {0, 0, 1}, {0, 1, 0}};
    EXPECT_NEAR(sdf::triangle_winding_number(turned, glm::dvec3(0.0)), -0.125, 1e-15);
}

TEST(WindingNumber, FastAgreesWithExact) {
    // The expansion is cut after the third order: with beta = 2 what is left is of the order (1/2)^3 of each
    // cluster's share of the solid angle. Measured: 6.4e-3 at worst on these shapes; signs need 0.5.
    EXPECT_LT(largest_error(icosphere(4), 2.0), 1e-2);
    EXPECT_LT(largest_error(torus(1.0f, 0.4f), 2.0), 1e-2);
    EXPECT_LT(largest_error(quad(2.0f, 2.0f, 20, 20), 2.0), 1e-2);
}

TEST(WindingNumber, FastConvergesToExactAsBetaGrows) {
    const core::Mesh mesh = torus(1.0f, 0.4f);
    const double coarse = largest_error(mesh, 2.0), fine = largest_error(mesh, 6.0);
    // The truncated terms fall at least with the third power of the ratio, 27; half of it for noise.
    EXPECT_LT(fine, coarse / 13.0);
    // With infinity nothing is expanded; only the order of the sum differs.
    EXPECT_LT(largest_error(mesh, std::numeric_limits<double>::infinity()), 1e-12);
}

TEST(WindingNumber, InsideHoldsThroughAHoleAndUnderReversedWinding) {
    core::Mesh holed = icosphere(3);
    holed.triangles.resize(holed.triangles.size() - 1);
    for (const core::Mesh& mesh : {holed, reversed(holed)}) {
        const std::vector<sdf::Triangle> triangles = triangles_of(mesh);
        const sdf::TriangleBvh tree(triangles, all_of(triangles));
        const sdf::WindingNumber winding(tree);
        EXPECT_TRUE(winding.is_inside({0.0, 0.0, 0.0}));
        EXPECT_TRUE(winding.is_inside({0.9, 0.0, 0.0}));
        EXPECT_FALSE(winding.is_inside({1.1, 0.0, 0.0}));
        EXPECT_FALSE(winding.is_inside({0.0, -3.0, 0.0}));
    }
}

TEST(TriangleBvh, FindsTheClosestTriangleThatBruteForceFinds) {
    const std::vector<sdf::Triangle> triangles = triangles_of(torus(1.0f, 0.4f));
    const sdf::TriangleBvh tree(triangles, all_of(triangles));
    TestRandom random(3);
    for (int i = 0; i < 300; ++i) {
        const glm::dvec3 point(random.uniform(-2, 2), random.uniform(-1, 1), random.uniform(-2, 2));
        sdf::ClosestTriangle expected;
        for (std::uint32_t t = 0; t < triangles.size(); ++t) {
            const glm::dvec3 offset = sdf::closest_point(triangles[t], point).position - point;
            const double squared = glm::dot(offset, offset);
            if (squared < expected.distance_squared) expected = {squared, t};
        }
        const sdf::ClosestTriangle found = tree.closest(point);
        EXPECT_EQ(found.distance_squared, expected.distance_squared);
        EXPECT_EQ(found.triangle, expected.triangle);
        // A seed that is farther changes nothing; one that is nearer stays.
        EXPECT_EQ(tree.closest(point, {100.0, 5}).triangle, expected.triangle);
        EXPECT_EQ(tree.closest(point, {0.0, 5}).triangle, 5u);
    }
}

TEST(ClosestPoint, LiesOnTheTriangleAndItsBarycentricsSaySo) {
    const sdf::Triangle triangle{{0, 0, 0}, {2, 0, 0}, {0.5, 1, 0.25}};
    TestRandom random(9);
    for (int i = 0; i < 500; ++i) {
        const glm::dvec3 point(random.uniform(-2, 4), random.uniform(-2, 3), random.uniform(-2, 2));
        const sdf::TrianglePoint closest = sdf::closest_point(triangle, point);
        const glm::dvec2& b = closest.barycentrics;
        EXPECT_GE(b.x, 0.0);
        EXPECT_GE(b.y, 0.0);
        EXPECT_LE(b.x + b.y, 1.0 + 1e-15);
        const glm::dvec3 rebuilt =
            triangle.a + b.x * (triangle.b - triangle.a) + b.y * (triangle.c - triangle.a);
        EXPECT_LT(glm::distance(rebuilt, closest.position), 1e-14);
        // No point of a fine sampling of the triangle is nearer.
        for (int k = 0; k < 50; ++k) {
            double u = random.uniform(), v = random.uniform();
            if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
            const glm::dvec3 other =
                triangle.a + u * (triangle.b - triangle.a) + v * (triangle.c - triangle.a);
            EXPECT_GE(glm::distance(other, point), glm::distance(closest.position, point) - 1e-14);
        }
    }
}

}  // namespace
}  // namespace tests
