// sdf/entry_kernel.h: rays into the voxels of instances' fields, many at once.
//
// The ray is transformed and not the field: o' = M^-1 o, d' = M^-1 d in double, clipped to the field's box.
// From there on single precision suffices, since it is that of one box and not of the camera's distance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "core/trace/ray_stream.h"
#include "sdf/field_kernel.h"

namespace sdf {

/// An instance's field as rays find it.
struct FieldPlacement {
    double voxel_from_world[9];  ///< For directions, column by column.
    double voxel_origin[3];      ///< Voxel coordinates of the world's origin.
    double box[3];               ///< Rays are clipped to [0, box], in voxels.
    std::int32_t top_base = 0, top_octant = 0, top_stride_x = 0, top_stride_y = 0;  ///< As in MarchRay.
};

/// Rays that are brought to the boxes of instances, one column a component, padded to whole vectors.
struct Entries {
    // In.
    core::Column<std::int32_t> ray;       ///< Index into the stream.
    core::Column<std::int32_t> instance;  ///< Index into the placements.
    core::Column<double> limit;           ///< Nothing beyond this t counts.
    // Out.
    core::Column<double> t_min, t_max;  ///< Within the box; the ray misses it unless t_min <= t_max.
    core::Column<double> t_per_voxel;   ///< Ray parameters a voxel: 1 / |d'|.

    /// Entries that the columns have room for.
    explicit Entries(std::size_t capacity);
};

/// Fills what is marked Out for the first `count` entries. Same bits on every instruction set.
/// @param passing room for `count` rays: those that meet their box, in order
/// @pre the rays are valid
void enter_fields(const core::RayStream& rays, const FieldPlacement* placements, Entries& entries,
                  std::size_t count, MarchRay* passing);

}  // namespace sdf
