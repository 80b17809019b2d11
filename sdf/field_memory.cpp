#include "sdf/field_memory.h"

#include "sdf/field_table.h"
#include "sdf/triangle_ray_tree.h"

namespace sdf {

FieldMemory field_memory(const BrickGrid& grid, std::size_t triangle_count) {
    FieldMemory memory;
    memory.samples = grid.bytes();
    if (!grid.traced_voxels().empty()) {
        // As FieldAtlas lays it out: a sample, its triangle and its gradient; a palette's first entry.
        constexpr std::size_t kAtlasBrick =
            kBrickSize * (sizeof(std::int16_t) + sizeof(std::uint16_t) + sizeof(std::int32_t)) +
            sizeof(std::int32_t);
        memory.samples += sizeof(FieldAtlas::Place) + grid.brick_count() * kAtlasBrick +
                          (grid.top().size() + grid.palettes().size()) * sizeof(std::int32_t);
        memory.triangles += triangle_count * sizeof(VoxelTriangle);
    }
    if (grid.half_thickness_voxels() > 0.0) memory.triangles += TriangleRayTree::bytes_of(triangle_count);
    return memory;
}

}  // namespace sdf
