#include "sdf/instance_bounds.h"

#include <array>
#include <map>

namespace sdf {

namespace {

/// Enough for boxes that hug a shape, few enough for thousands of instances.
constexpr std::size_t kMostBoxes = 256;

using BlockKey = std::array<int, 3>;

}  // namespace

std::vector<core::DoubleBounds> surface_boxes(const BrickGrid& grid) {
    std::map<BlockKey, core::DoubleBounds> boxes;
    const glm::ivec3 count = grid.block_count();
    for (glm::ivec3 block(0); block.x < count.x; ++block.x) {
        for (block.y = 0; block.y < count.y; ++block.y) {
            for (block.z = 0; block.z < count.z; ++block.z) {
                const Brick* brick = grid.brick(block);
                if (!brick) continue;
                const CellBox cells = occupied_box(*brick);
                const glm::dvec3 first(block * kBrickCells);
                core::DoubleBounds& box = boxes[{block.x, block.y, block.z}];
                box.include(grid.origin() + grid.voxel_size() * (first + glm::dvec3(cells.first)));
                box.include(grid.origin() + grid.voxel_size() * (first + glm::dvec3(cells.end)));
            }
        }
    }
    while (boxes.size() > kMostBoxes) {
        std::map<BlockKey, core::DoubleBounds> merged;
        for (const auto& [key, box] : boxes) {
            core::DoubleBounds& whole = merged[{key[0] / 2, key[1] / 2, key[2] / 2}];
            whole.include(box.minimum);
            whole.include(box.maximum);
        }
        boxes = std::move(merged);
    }
    std::vector<core::DoubleBounds> result;
    for (const auto& [key, box] : boxes) result.push_back(box);
    return result;
}

core::DoubleBounds world_bounds(const std::vector<core::DoubleBounds>& boxes,
                                const glm::dmat4& world_from_local) {
    core::DoubleBounds result;
    for (const core::DoubleBounds& box : boxes) {
        const core::DoubleBounds part = core::transformed(box, world_from_local);
        result.include(part.minimum);
        result.include(part.maximum);
    }
    return result;
}

}  // namespace sdf
