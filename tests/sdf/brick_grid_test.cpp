#include "sdf/brick_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sdf/distance.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

TEST(BrickGrid, NoPointOfAnEmptyBlockIsNearerToAnOccupiedCellThanItsBound) {
    const auto grid = grid_of(merged(torus(1.0f, 0.3f, 48, 24), moved(box(), translation({2, 1, 1}))), 96);
    std::vector<glm::dvec3> occupied;
    const glm::ivec3 count = grid->block_count();
    for (int i = 0; i < count.x * count.y * count.z; ++i) {
        const glm::ivec3 block(i / (count.y * count.z), i / count.z % count.y, i % count.z);
        const sdf::Brick* brick = grid->brick(block);
        if (!brick) continue;
        for (int cell = 0; cell < 343; ++cell) {
            const glm::ivec3 local(cell / 49, cell / 7 % 7, cell % 7);
            if (brick->is_occupied(local.x, local.y, local.z)) {
                occupied.push_back(glm::dvec3(block * sdf::kBrickCells + local));
            }
        }
    }
    ASSERT_GT(occupied.size(), 1000u);
    TestRandom random(21);
    int checked = 0, violations = 0;
    while (checked < 400) {
        const glm::dvec3 point = glm::dvec3(random.uniform(), random.uniform(), random.uniform()) *
                                 glm::dvec3(count * sdf::kBrickCells);
        const std::int32_t entry = grid->entry(glm::ivec3(point) / sdf::kBrickCells);
        if (entry >= 0) continue;
        ++checked;
        double nearest = 1e9;
        for (const glm::dvec3& cell : occupied) {
            const glm::dvec3 outside = glm::max(glm::max(cell - point, point - cell - 1.0), glm::dvec3(0.0));
            nearest = std::min(nearest, glm::length(outside));
        }
        violations += nearest < sdf::BrickGrid::empty_distance(entry);
        EXPECT_GE(sdf::BrickGrid::empty_distance(entry), 0.0);
    }
    EXPECT_EQ(violations, 0);
}

TEST(BrickGrid, HoldsTheSamplesOfTheField) {
    const sdf::SampledField field = bake(icosphere(3), 32);
    const sdf::BrickGrid grid(field);
    std::size_t compared = 0;
    for_each_sample(field, [&](const glm::dvec3& position, float value, std::int32_t) {
        const glm::dvec3 voxel = (position - grid.origin()) / grid.voxel_size();
        const std::optional<float> stored = sdf::sample_at(grid, glm::ivec3(glm::round(voxel)));
        if (!stored) return;
        ++compared;
        // In 16 bits.
        ASSERT_NEAR(*stored, value / grid.voxel_size(), 0.51 * sdf::kSampleStepVoxels + 1e-6);
        ASSERT_EQ(*stored < 0.0f, value < 0.0f);
    });
    EXPECT_GT(compared, 10'000u);
}

TEST(Distance, SmoothGradientIsTheNormalOfASphere) {
    const auto grid = grid_of(icosphere(5), 40);
    TestRandom random(2);
    double worst = 0.0;
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 direction = random.direction();
        const glm::dvec3 voxel = (0.999 * direction - grid->origin()) / grid->voxel_size();
        const glm::ivec3 cell(glm::floor(voxel));
        if (!grid->brick(cell / sdf::kBrickCells)) continue;
        const glm::dvec3 normal = sdf::smooth_gradient(*grid, cell, voxel - glm::dvec3(cell));
        worst = std::max(worst, std::acos(std::min(1.0, glm::dot(glm::normalize(normal), direction))));
    }
    // 0.2 degrees at worst on a sphere of 8 voxels (design); this one has 20, and facets half a degree
    // across.
    EXPECT_LT(glm::degrees(worst), 0.6);
}

}  // namespace
}  // namespace tests
