#include "sdf/distance.h"

#include <cmath>

namespace sdf {

std::optional<float> sample_at(const BrickGrid& grid, const glm::ivec3& sample) {
    if (sample.x < 0 || sample.y < 0 || sample.z < 0) return std::nullopt;
    const glm::ivec3 count = grid.block_count();
    // A sample on the border of blocks is stored in up to eight bricks; any of them will do.
    for (int choice = 0; choice < 8; ++choice) {
        glm::ivec3 block = sample / kBrickCells;
        bool is_possible = true;
        for (int axis = 0; axis < 3; ++axis) {
            if ((choice >> axis & 1) == 0) continue;
            is_possible = is_possible && sample[axis] % kBrickCells == 0;
            --block[axis];
        }
        if (!is_possible || block.x < 0 || block.y < 0 || block.z < 0 || block.x >= count.x ||
            block.y >= count.y || block.z >= count.z) {
            continue;
        }
        if (const Brick* brick = grid.brick(block)) {
            const glm::ivec3 local = sample - block * kBrickCells;
            return brick->voxels(Brick::index(local.x, local.y, local.z));
        }
    }
    return std::nullopt;
}

std::optional<double> distance_at(const BrickGrid& grid, const glm::dvec3& point) {
    const core::DoubleBounds& box = grid.traced_voxels();
    for (int axis = 0; axis < 3; ++axis) {
        if (!(point[axis] >= box.minimum[axis] && point[axis] <= box.maximum[axis])) return std::nullopt;
    }
    const glm::ivec3 cell = glm::min(glm::ivec3(point), glm::ivec3(box.maximum) - 1);
    const glm::ivec3 block = cell / kBrickCells;
    const Brick* brick = grid.brick(block);
    if (!brick) return std::nullopt;
    return CellCorners::load(*brick, cell - block * kBrickCells).at(point - glm::dvec3(cell));
}

glm::dvec3 lattice_gradient(const BrickGrid& grid, const glm::ivec3& block, int index) {
    const Brick& brick = *grid.brick(block);
    const glm::ivec3 local(index / 64, index / 8 % 8, index % 8);
    constexpr int kStride[] = {64, 8, 1};
    const double here = brick.voxels(index);
    glm::dvec3 gradient(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        double value[2] = {here, here};
        double width = 0.0;
        for (int side = 0; side < 2; ++side) {
            const int step = side == 0 ? -1 : 1;
            const int there = local[axis] + step;
            if (there >= 0 && there < kBrickSamples) {
                value[side] = brick.voxels(index + step * kStride[axis]);
                width += 1.0;
                continue;
            }
            glm::ivec3 position = block * kBrickCells + local;
            position[axis] += step;
            if (const std::optional<float> sample = sample_at(grid, position)) {
                value[side] = *sample;
                width += 1.0;
            }
        }
        if (width > 0.0) gradient[axis] = (value[1] - value[0]) / width;
    }
    return gradient;
}

glm::dvec3 smooth_gradient(const BrickGrid& grid, const glm::ivec3& cell, const glm::dvec3& u) {
    const glm::ivec3 block = cell / kBrickCells;
    const glm::ivec3 local = cell - block * kBrickCells;
    glm::dvec3 gradient(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        const glm::ivec3 step(corner >> 2 & 1, corner >> 1 & 1, corner & 1);
        const double weight =
            (step.x ? u.x : 1.0 - u.x) * (step.y ? u.y : 1.0 - u.y) * (step.z ? u.z : 1.0 - u.z);
        const glm::ivec3 sample = local + step;
        gradient += weight * lattice_gradient(grid, block, Brick::index(sample.x, sample.y, sample.z));
    }
    return gradient;
}

}  // namespace sdf
