// sdf/field_memory.h: what a tracer will hold of one field, known before there is one.
#pragma once

#include <cstddef>

#include "sdf/brick_grid.h"

namespace sdf {

/// Bytes of one field in an SdfTracer. Instances cost little beside it and are left out.
struct FieldMemory {
    std::size_t samples = 0;    ///< The grid and its copy in the tracer's FieldAtlas: goes with 1 / h^2.
    std::size_t triangles = 0;  ///< What the mesh costs at any voxel size: its triangles, and a tree of them
                                ///< where features are thickened.

    std::size_t total() const { return samples + triangles; }
};

/// @param triangle_count of the mesh, faces that the bake dropped included
FieldMemory field_memory(const BrickGrid& grid, std::size_t triangle_count);

}  // namespace sdf
