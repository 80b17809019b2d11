// tests/sdf/skip_boxes_test.cpp: what rays skip holds no surface, from every place and for every direction.
#include "sdf/skip_boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sdf/sphere_trace.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

class SkipBoxes : public testing::Test {
protected:
    const core::Mesh mesh_ = merged(torus(1.0f, 0.3f, 48, 24), moved(box(), translation({0.4, 0.6, 0.9})));
    const std::shared_ptr<const sdf::BrickGrid> grid_ = grid_of(mesh_, 64);
    const sdf::SkipBoxes skip_{*grid_};

    bool is_occupied(const glm::ivec3& cell) const {
        const sdf::Brick* brick = grid_->brick_or_null(cell);
        const glm::ivec3 local = cell % sdf::kBrickCells;
        return brick && brick->is_occupied(local.x, local.y, local.z);
    }
    static glm::ivec3 region_of(const glm::ivec3& local) { return glm::min(local / 2, glm::ivec3(2)); }
    static int region_number(const glm::ivec3& region) { return (region.x * 3 + region.y) * 3 + region.z; }

    std::uint32_t word_at(int octant, const glm::ivec3& cell) const {
        const glm::ivec3 block = cell / sdf::kBrickCells, count = grid_->block_count();
        const auto number = static_cast<std::size_t>((block.x * count.y + block.y) * count.z + block.z);
        const std::int32_t entry = skip_.top[static_cast<std::size_t>(octant) * grid_->top().size() + number];
        if (entry < 0) return static_cast<std::uint32_t>(entry);
        const int region = region_number(region_of(cell % sdf::kBrickCells));
        return skip_
            .boxes[static_cast<std::size_t>((entry * sdf::kOctants + octant) * sdf::kRegions + region)];
    }
    /// The cells of a box, from where `cell` is.
    sdf::CellBox cells_of(std::uint32_t word, int octant, const glm::ivec3& cell) const {
        const glm::ivec3 first = cell / sdf::kBrickCells * sdf::kBrickCells;
        sdf::CellBox cells{cell, cell + 1};
        if (!(word & sdf::kEmptyBox)) return cells;
        for (int axis = 0; axis < 3; ++axis) {
            const auto extent = static_cast<int>(word >> ((2 - axis) * sdf::kBoxBits) & sdf::kMostBoxCells);
            if (octant >> (2 - axis) & 1) {
                cells.first[axis] = first[axis] + sdf::kBrickCells - extent;
            } else {
                cells.end[axis] = first[axis] + extent;
            }
        }
        return cells;
    }
    glm::ivec3 cell_count() const { return grid_->block_count() * sdf::kBrickCells; }
};

TEST_F(SkipBoxes, EmptyBoxesHoldNoOccupiedCellAndTheirOwn) {
    TestRandom random(1);
    int empty = 0, far = 0;
    for (int i = 0; i < 20'000; ++i) {
        const glm::ivec3 cell(glm::dvec3(random.uniform(), random.uniform(), random.uniform()) *
                              glm::dvec3(cell_count()));
        const int octant = i % sdf::kOctants;
        const std::uint32_t word = word_at(octant, cell);
        const sdf::CellBox cells = cells_of(word, octant, cell);
        ASSERT_TRUE(glm::all(glm::lessThan(cells.first, cells.end)));
        ASSERT_TRUE(glm::all(glm::lessThanEqual(cells.first, cell)) &&
                    glm::all(glm::lessThan(cell, cells.end)));
        if (!(word & sdf::kEmptyBox)) continue;
        ++empty;
        const glm::ivec3 size = cells.end - cells.first;
        far += std::max({size.x, size.y, size.z}) > sdf::kBrickCells;
        for (glm::ivec3 at = cells.first; at.x < cells.end.x; ++at.x) {
            for (at.y = cells.first.y; at.y < cells.end.y; ++at.y) {
                for (at.z = cells.first.z; at.z < cells.end.z; ++at.z) ASSERT_FALSE(is_occupied(at));
            }
        }
    }
    EXPECT_GT(empty, 5'000);
    EXPECT_GT(far, 2'000);
}

TEST_F(SkipBoxes, BoxesCannotGrowAlongAnyAxis) {
    // One more layer of regions would hold an occupied cell, or there is none.
    TestRandom random(2);
    for (int i = 0; i < 2'000; ++i) {
        const glm::ivec3 cell(glm::dvec3(random.uniform(), random.uniform(), random.uniform()) *
                              glm::dvec3(cell_count()));
        const int octant = i % sdf::kOctants;
        const std::uint32_t word = word_at(octant, cell);
        if (!(word & sdf::kEmptyBox)) continue;
        // From the region's, or the block's, near corner on.
        const glm::ivec3 block = cell / sdf::kBrickCells * sdf::kBrickCells;
        const bool is_brick = grid_->brick_or_null(cell) != nullptr;
        const glm::ivec3 region = region_of(cell - block);
        const glm::ivec3 low = is_brick ? block + 2 * region : block;
        const glm::ivec3 high =
            is_brick ? low + 2 + glm::ivec3(glm::equal(region, glm::ivec3(2))) : block + sdf::kBrickCells;
        sdf::CellBox cells = cells_of(word, octant, cell);
        for (int axis = 0; axis < 3; ++axis) {
            (octant >> (2 - axis) & 1 ? cells.end : cells.first)[axis] =
                (octant >> (2 - axis) & 1 ? high : low)[axis];
        }
        for (int axis = 0; axis < 3; ++axis) {
            sdf::CellBox layer = cells;
            if (octant >> (2 - axis) & 1) {
                layer.end[axis] = cells.first[axis];
                layer.first[axis] = std::max(cells.first[axis] - 3, 0);
            } else {
                layer.first[axis] = cells.end[axis];
                layer.end[axis] = std::min(cells.end[axis] + 3, cell_count()[axis]);
            }
            if (layer.first[axis] == layer.end[axis]) continue;
            bool any = false;
            for (glm::ivec3 at = layer.first; at.x < layer.end.x; ++at.x) {
                for (at.y = layer.first.y; at.y < layer.end.y; ++at.y) {
                    for (at.z = layer.first.z; at.z < layer.end.z; ++at.z) any = any || is_occupied(at);
                }
            }
            EXPECT_TRUE(any) << "octant " << octant << ", axis " << axis;
        }
    }
}

TEST_F(SkipBoxes, SlabsHoldTheSurfaceOfTheirRegions) {
    TestRandom random(3);
    std::size_t crossings = 0, regions = 0, unbound = 0, wide = 0;
    double thickness = 0.0;
    for (std::size_t number = 0; number < grid_->brick_count(); ++number) {
        const sdf::Brick& brick = grid_->brick_at(static_cast<std::int32_t>(number));
        for (int cell = 0; cell < 343; ++cell) {
            const glm::ivec3 at(cell / 49, cell / 7 % 7, cell % 7);
            if (!brick.is_occupied(at.x, at.y, at.z)) continue;
            const int region = region_number(region_of(at));
            const std::uint32_t word = skip_.boxes[number * sdf::kBrickBoxes + std::size_t(region)];
            ASSERT_FALSE(word & sdf::kEmptyBox);
            const int x = static_cast<std::int8_t>(word & 0xff),
                      y = static_cast<std::int8_t>(word >> 8 & 0xff);
            const glm::dvec3 normal(x, y, sdf::kSlabNormal - std::abs(x) - std::abs(y));
            ASSERT_GE(normal.z, 0.0);
            const int begin = static_cast<int>(word >> 16 & 0xff) - sdf::kSlabMiddle,
                      steps = static_cast<int>(word >> 24 & sdf::kMostSlabSteps);
            ++regions;
            unbound += steps == sdf::kMostSlabSteps;
            wide += (word & sdf::kWideSlab) != 0;
            if (steps == sdf::kMostSlabSteps) continue;
            const double low = begin * static_cast<double>(sdf::kSlabStep),
                         high = (begin + steps) * static_cast<double>(sdf::kSlabStep);
            const sdf::CellCorners corners = sdf::CellCorners::load(brick, at);
            for (int i = 0; i < 20; ++i) {
                const glm::dvec3 a(random.uniform(), random.uniform(), random.uniform()),
                    b(random.uniform(), random.uniform(), random.uniform());
                const double fa = corners.at(a), fb = corners.at(b);
                if ((fa < 0.0) == (fb < 0.0)) continue;
                // Halve until the crossing is found.
                glm::dvec3 p = a, q = b;
                for (int k = 0; k < 40; ++k) {
                    const glm::dvec3 middle = 0.5 * (p + q);
                    ((corners.at(middle) < 0.0) == (fa < 0.0) ? p : q) = middle;
                }
                const double height = glm::dot(normal, glm::dvec3(at) + p - 3.5);
                ASSERT_GE(height, low) << "brick " << number;
                ASSERT_LE(height, high) << "brick " << number;
                ++crossings;
                thickness += (high - low) / glm::length(normal);
            }
        }
    }
    ASSERT_GT(crossings, 50'000u);
    EXPECT_LT(unbound, regions / 4);
    EXPECT_GT(wide, regions / 10);
    // A tight bound, and not one of everything.
    EXPECT_LT(thickness / static_cast<double>(crossings), 0.6);
}

}  // namespace
}  // namespace tests
