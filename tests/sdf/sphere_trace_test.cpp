#include "sdf/sphere_trace.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sdf/instance_tree.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

/// First crossing of a local ray, or NaN. Checks that no step cap was met.
double first_crossing(const sdf::BrickGrid& grid, const glm::dvec3& origin, const glm::dvec3& direction,
                      sdf::Crossing* found = nullptr) {
    const glm::dvec3 voxel_origin = (origin - grid.origin()) / grid.voxel_size();
    const glm::dvec3 voxel_direction = direction / grid.voxel_size();
    double t_min = 0.0, t_max = 1e9;
    sdf::Crossing crossing;
    if (!sdf::clip_to_box(grid.traced_voxels(), voxel_origin, sdf::finite_inverse(voxel_direction), t_min,
                          t_max)) {
        return std::nan("");
    }
    sdf::RayMarch march(grid, voxel_origin, voxel_direction, t_min, t_max);
    const bool hit = march.next(crossing);
    EXPECT_FALSE(march.is_exhausted());
    if (found) *found = crossing;
    return hit ? crossing.t : std::nan("");
}

/// The field as the lattice gives it, with the far value where nothing is stored.
double field_at(const sdf::BrickGrid& grid, const glm::dvec3& local) {
    return sdf::distance_at(grid, (local - grid.origin()) / grid.voxel_size()).value_or(4.0);
}

TEST(RayMarch, FindsTheSphereWhereItIs) {
    const auto grid = grid_of(icosphere(5), 64);
    const double h = grid->voxel_size();
    // Facets lie up to 1 - inner radius below the sphere; a trilinear cell up to h^2 / 4r.
    const double slack = (1.0 - icosphere_inner_radius(5)) + h * h / 4.0;
    TestRandom random(4);
    for (int i = 0; i < 5000; ++i) {
        const glm::dvec3 origin = 3.0 * random.direction();
        const glm::dvec3 target = 0.9 * std::cbrt(random.uniform()) * random.direction();
        const glm::dvec3 direction = glm::normalize(target - origin);
        const double b = glm::dot(origin, direction);
        const double discriminant = b * b - glm::dot(origin, origin) + 1.0;
        const double expected = -b - std::sqrt(discriminant);
        const double t = first_crossing(*grid, origin, direction);
        ASSERT_FALSE(std::isnan(t));
        const double cosine = std::sqrt(discriminant);
        ASSERT_NEAR(t, expected, slack / cosine) << "ray " << i;
    }
}

TEST(RayMarch, AgreesWithAFineWalkOnTheSameField) {
    // The reference walks the trilinear field in steps of a hundredth of a voxel and bisects sign changes.
    const auto grid = grid_of(torus(1.0f, 0.35f, 40, 20), 24);
    const double h = grid->voxel_size();
    const core::DoubleBounds bounds = grid->local_bounds();
    TestRandom random(6);
    int hits = 0;
    for (int i = 0; i < 400; ++i) {
        const glm::dvec3 origin = 2.0 * random.direction();
        const glm::dvec3 target =
            glm::dvec3(1.3, 0.35, 1.3) *
            (2.0 * glm::dvec3(random.uniform(), random.uniform(), random.uniform()) - 1.0);
        const glm::dvec3 direction = glm::normalize(target - origin);
        double reference = std::nan(""), lowest = 1e9;
        double t_min = 0.0, t_max = 10.0;
        if (sdf::clip_to_box(bounds, origin, sdf::finite_inverse(direction), t_min, t_max)) {
            double previous = field_at(*grid, origin + t_min * direction);
            for (double t = t_min; t < t_max; t += 0.01 * h) {
                const double value = field_at(*grid, origin + t * direction);
                if (value < 0.0 && previous >= 0.0) {
                    double low = t - 0.01 * h, high = t;
                    for (int k = 0; k < 50; ++k) {
                        const double middle = 0.5 * (low + high);
                        (field_at(*grid, origin + middle * direction) < 0.0 ? high : low) = middle;
                    }
                    reference = high;
                    break;
                }
                lowest = std::min(lowest, value);
                previous = value;
            }
        }
        const double t = first_crossing(*grid, origin, direction);
        if (std::isnan(reference)) {
            // A dip below zero that is shorter than a step of the reference is all it may have missed.
            EXPECT_TRUE(std::isnan(t) || lowest < 1e-3) << "ray " << i;
            continue;
        }
        ++hits;
        ASSERT_FALSE(std::isnan(t)) << "ray " << i;
        // An earlier crossing is right if it is one: a dip shorter than a step of the reference.
        if (t < reference - 1e-6 * h) {
            EXPECT_NEAR(field_at(*grid, origin + t * direction), 0.0, 1e-6) << "ray " << i;
        } else {
            EXPECT_NEAR(t, reference, 1e-6 * h) << "ray " << i;
        }
    }
    EXPECT_GT(hits, 100);
}

TEST(RayMarch, AxisParallelRaysInVoxelFacesAndEdgesHit) {
    // At 32 voxels on the longest side the box's centre is a lattice point: these rays run in faces, edges
    // and corners of cells.
    const auto grid = grid_of(box({0.5f, 0.5f, 0.5f}), 32);
    const double h = grid->voxel_size();
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-1.0, 1.0}) {
            for (int i = -14; i <= 14; ++i) {
                for (const double j : {0.0, 3.0, 3.5}) {
                    glm::dvec3 origin(0.0), direction(0.0);
                    origin[axis] = 2.0 * side;
                    origin[(axis + 1) % 3] = i * h;
                    origin[(axis + 2) % 3] = j * h;
                    direction[axis] = -side;
                    direction[(axis + 1) % 3] = side * 0.0;
                    EXPECT_NEAR(first_crossing(*grid, origin, direction), 1.5, 1e-6);
                }
            }
        }
    }
}

TEST(RayMarch, DiagonalRaysThroughLatticePointsHit) {
    const auto grid = grid_of(box({0.5f, 0.5f, 0.5f}), 32);
    const double h = grid->voxel_size();
    for (int i = -12; i <= 12; ++i) {
        for (int j = -12; j <= 12; ++j) {
            const glm::dvec3 target(i * h, j * h, 0.5);
            for (const glm::dvec3& slope :
                 {glm::dvec3(1, 1, -1), glm::dvec3(-1, 0, -1), glm::dvec3(1, 2, -2)}) {
                const double t = first_crossing(*grid, target - slope, slope);
                EXPECT_NEAR(t, 1.0, 1e-6) << i << " " << j;
            }
        }
    }
}

TEST(RayMarch, EveryCrossingAlternatesAndTheLastIsOutwards) {
    const auto grid = grid_of(torus(1.0f, 0.35f, 64, 32), 64);
    TestRandom random(8);
    int most = 0;
    for (int i = 0; i < 5000; ++i) {
        const glm::dvec3 origin = 3.0 * random.direction();
        const glm::dvec3 direction = glm::normalize(random.direction() - origin);
        const glm::dvec3 voxel_origin = (origin - grid->origin()) / grid->voxel_size();
        const glm::dvec3 voxel_direction = direction / grid->voxel_size();
        double t_min = 0.0, t_max = 1e9;
        if (!sdf::clip_to_box(grid->traced_voxels(), voxel_origin, sdf::finite_inverse(voxel_direction),
                              t_min, t_max)) {
            continue;
        }
        sdf::RayMarch march(*grid, voxel_origin, voxel_direction, t_min, t_max);
        sdf::Crossing crossing;
        bool inside = false;
        double last = -1.0;
        int count = 0;
        while (march.next(crossing)) {
            ASSERT_EQ(crossing.enters_negative, !inside) << "ray " << i;
            ASSERT_GE(crossing.t, last);
            inside = crossing.enters_negative;
            last = crossing.t;
            ++count;
        }
        ASSERT_FALSE(inside) << "ray " << i << " left through the surface without meeting it";
        most = std::max(most, count);
    }
    EXPECT_GE(most, 4);
}

TEST(RayMarch, PositionsThatNoIntegerHoldsEnd) {
    // A ray that starts 1e24 voxels away, as at an instance of a tiny scale, has no position left when it
    // comes to the grid. What it meets is open; that it ends, without a conversion that is undefined, is not.
    const auto grid = grid_of(icosphere(2), 16);
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    for (const double far : {1e10, -1e10, 1e24, -1e24, 1e300, nan, inf, -inf}) {
        for (const glm::dvec3& direction : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0.5, 1e-3)}) {
            for (const double t_min : {0.0, 1.0, 1e24}) {
                sdf::RayMarch march(*grid, glm::dvec3(far, 3.0, far), direction, t_min, 1e30);
                sdf::Crossing crossing;
                int count = 0;
                while (count < 1000 && march.next(crossing)) ++count;
                EXPECT_LT(count, 1000) << far;
            }
        }
    }
}

}  // namespace
}  // namespace tests
