// sdf/bake_error.h: how far a baked field lies from the mesh it stands for, and whether its signs are right.
//
// Three figures, since none implies another: from the mesh to the field one does not see surfaces that the
// field has too many, from the field to the mesh not those that it lacks, and neither sees a region with the
// wrong sign beside a surface in its place.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/band.h"
#include "sdf/sampled_field.h"
#include "sdf/triangle_bvh.h"
#include "sdf/winding_number.h"

namespace sdf {

/// What a field was baked from, in voxels.
struct BakedSurfaces {
    const std::vector<Triangle>& corners;
    const std::vector<Feature>& features;  ///< One entry a triangle.
    const TriangleBvh& solids;             ///< Over the triangles of solid components.
    const TriangleBvh& sheets;             ///< Over all others.
    const WindingNumber& winding;          ///< Of the solids.
};

/// |field| at points spread evenly over the mesh, in voxels; on sheets and thin walls how far that is from
/// the half-thickness. Points that lie within the union of the solids are no surface and do not count.
/// @param field values in voxels.
ErrorFigures measure_error(const BakedSurfaces& surfaces, const LeafMap& field);

/// Distance from points spread evenly over the trilinear isosurface to their closest triangle, in voxels; on
/// sheets and thin walls how far that is from the half-thickness. A triangle farther than the band counts as
/// kBandVoxels.
/// @param leaves values in voxels, triangles as indices into the surfaces' corners.
ErrorFigures measure_field_error(const BakedSurfaces& surfaces, const std::vector<FieldLeaf>& leaves);

/// Holds signs of samples against the exact winding number of the solids: of up to about `most` samples, more
/// than 0.01 voxel off the surface and not of thickened features, whose sign is another one.
/// @param leaves as above.
SignMismatches count_sign_mismatches(const BakedSurfaces& surfaces, const std::vector<FieldLeaf>& leaves,
                                     std::size_t most = 2'000);

}  // namespace sdf
