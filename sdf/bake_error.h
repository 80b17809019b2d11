// sdf/bake_error.h: how far a baked field lies from the mesh it stands for.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/band.h"
#include "sdf/sampled_field.h"
#include "sdf/triangle_bvh.h"
#include "sdf/winding_number.h"

namespace sdf {

/// |field| at points spread evenly over the mesh, in voxels; on sheets and thin walls how far that is from
/// the half-thickness. Points that lie within the union of the solids are no surface and do not count.
/// @param corners triangles in voxels; @param features one entry a triangle; @param field values in voxels.
ErrorFigures measure_error(const std::vector<Triangle>& corners, const std::vector<Feature>& features,
                           const WindingNumber& winding, const LeafMap& field);

}  // namespace sdf
