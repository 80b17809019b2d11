// sdf/thin_walls.h: parts of solids that the lattice cannot hold: walls that are too thin, and rims of holes.
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

    /// Those whose two sides are about parallel. A finer voxel holds them.
    struct Walls {
        double area_fraction = 0.0;     ///< Of all solid triangles' area.
        double thinnest = 0.0;          ///< Voxels.
        glm::dvec3 thinnest_at{0.0};    ///< On the surface, in voxels.
        double tenth_percentile = 0.0;  ///< Nine tenths are thicker, in voxels.
    } walls;
    /// The rest, where two sides run together at an edge: as thin as one likes at any voxel.
    double edge_area_fraction = 0.0;
};

/// Walls thicker than this, in voxels, are always held by the lattice: along any direction two voxels hold a
/// sample whose neighbours are inside as well.
inline constexpr double kSafeThickness = 2.0;

/// @param corners the clean triangles in voxels; @param components their classes.
/// @param solids tree over the solid ones; @param winding of them; @param field distances in voxels, sheets
/// not yet thickened by thin walls.
ThinWalls find_thin_walls(const std::vector<Triangle>& corners, const std::vector<Component>& components,
                          const TriangleBvh& solids, const WindingNumber& winding, const LeafMap& field);

/// Triangles beside holes of open solids. The winding number closes a hole with a lid, a change of sign away
/// from any triangle, which looks like a surface where it comes close to one.
/// @param is_sheet one entry a triangle; @param leaves distances in voxels, nothing thickened by thin walls
/// yet.
/// @returns ascending
std::vector<std::uint32_t> find_rims(const std::vector<std::uint8_t>& is_sheet,
                                     const std::vector<FieldLeaf>& leaves);

/// Adds whole triangles to what is to be thickened.
void add_pieces(const std::vector<Triangle>& corners, const std::vector<std::uint32_t>& triangles,
                ThinWalls& walls);

}  // namespace sdf
