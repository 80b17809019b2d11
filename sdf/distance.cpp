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

glm::dvec3 smooth_gradient(const BrickGrid& grid, const glm::ivec3& cell, const glm::dvec3& u) {
    // The 4^3 samples round the cell, without the corners of that cube, which no difference needs.
    double value[4][4][4];
    bool known[4][4][4] = {};
    const glm::ivec3 block = cell / kBrickCells;
    const Brick* brick = grid.brick(block);
    const glm::ivec3 local = cell - block * kBrickCells;
    for (int x = 0; x < 4; ++x) {
        for (int y = 0; y < 4; ++y) {
            for (int z = 0; z < 4; ++z) {
                const int outside = (x % 3 == 0) + (y % 3 == 0) + (z % 3 == 0);
                if (outside > 1) continue;
                const glm::ivec3 position = local + glm::ivec3(x - 1, y - 1, z - 1);
                const bool is_here = brick && position.x >= 0 && position.y >= 0 && position.z >= 0 &&
                                     position.x < kBrickSamples && position.y < kBrickSamples &&
                                     position.z < kBrickSamples;
                const std::optional<float> sample =
                    is_here ? brick->voxels(Brick::index(position.x, position.y, position.z))
                            : sample_at(grid, cell + glm::ivec3(x - 1, y - 1, z - 1));
                known[x][y][z] = sample.has_value();
                value[x][y][z] = sample.value_or(0.0f);
            }
        }
    }
    glm::dvec3 gradient(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        const glm::ivec3 step(corner >> 2 & 1, corner >> 1 & 1, corner & 1);
        const double weight =
            (step.x ? u.x : 1.0 - u.x) * (step.y ? u.y : 1.0 - u.y) * (step.z ? u.z : 1.0 - u.z);
        for (int axis = 0; axis < 3; ++axis) {
            glm::ivec3 low = step + 1, high = step + 1;
            low[axis] -= 1;
            high[axis] += 1;
            double width = 2.0;
            if (!known[low.x][low.y][low.z]) {
                low[axis] += 1;
                width -= 1.0;
            }
            if (!known[high.x][high.y][high.z]) {
                high[axis] -= 1;
                width -= 1.0;
            }
            if (width > 0.0) {
                gradient[axis] +=
                    weight * (value[high.x][high.y][high.z] - value[low.x][low.y][low.z]) / width;
            }
        }
    }
    return gradient;
}

}  // namespace sdf
