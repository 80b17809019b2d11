#include "sdf/field_memory.h"

#include "sdf/field_table.h"
#include "sdf/triangle_ray_tree.h"

namespace sdf {

FieldMemory field_memory(const BrickGrid& grid, std::size_t triangle_count) {
    FieldMemory memory;
    memory.samples = grid.bytes();
    if (!grid.traced_voxels().empty()) {
        // As FieldAtlas lays it out: samples and boxes of a brick, what its occupied cells know, the top
        // grid.
        constexpr std::size_t kAtlasBrick =
            kBrickSize * sizeof(std::int16_t) + kBrickBoxes * sizeof(std::uint32_t) + sizeof(BrickCells);
        memory.samples += sizeof(FieldAtlas::Place) + grid.brick_count() * kAtlasBrick +
                          occupied_count(grid) * sizeof(CellSurface) +
                          kOctants * grid.top().size() * sizeof(std::int32_t);
        memory.triangles += triangle_count * sizeof(VoxelTriangle);
    }
    if (grid.half_thickness_voxels() > 0.0) memory.triangles += TriangleRayTree::bytes_of(triangle_count);
    return memory;
}

}  // namespace sdf
