// sdf/thin_walls.h: parts of solids that the lattice cannot hold, and how thin they are.
//
// A wall thinner than the spacing of samples can pass between them and vanish. What the field misses is found
// by asking it: the middle of every wall must be inside.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/band.h"
#include "sdf/clean_mesh.h"
#include "sdf/triangle_bvh.h"
#include "sdf/winding_number.h"

namespace sdf {

/// Small pieces of triangles that bound walls which the field does not show.
struct ThinWalls {
    std::vector<Triangle> pieces;                  ///< Voxel units, edges of about a voxel.
    std::vector<std::uint32_t> triangle_of_piece;  ///< The clean triangle each was cut from.
    double area_fraction = 0.0;                    ///< Of all solid triangles' area.
    double thickness = 0.0;                        ///< Of the 10th percentile of those walls, in voxels.
};

/// @param corners the clean triangles in voxels; @param components their classes.
/// @param solids tree over the solid ones; @param winding of them; @param field distances in voxels, sheets
/// not yet thickened by thin walls.
ThinWalls find_thin_walls(const std::vector<Triangle>& corners, const std::vector<Component>& components,
                          const TriangleBvh& solids, const WindingNumber& winding, const LeafMap& field);

}  // namespace sdf
