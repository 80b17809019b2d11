// sdf/distance.h: the trilinear field of a brick grid: values and smooth normals.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>

#include "sdf/brick_grid.h"

namespace sdf {

/// The samples at the corners of one cell, in voxels; corner 4 x + 2 y + z.
struct CellCorners {
    std::array<double, 8> value;

    static CellCorners load(const Brick& brick, const glm::ivec3& cell) {
        CellCorners corners;
        for (int i = 0; i < 8; ++i) {
            corners.value[static_cast<std::size_t>(i)] =
                brick.voxels(Brick::index(cell.x + (i >> 2), cell.y + (i >> 1 & 1), cell.z + (i & 1)));
        }
        return corners;
    }

    /// Trilinear value. At a coordinate of exactly 0 or 1 it depends on that face's samples alone, by the
    /// same operations in both cells that share the face, so that neighbours agree to the last bit.
    double at(const glm::dvec3& u) const {
        const double rx = 1.0 - u.x, ry = 1.0 - u.y, rz = 1.0 - u.z;
        const double c00 = rx * value[0] + u.x * value[4], c01 = rx * value[1] + u.x * value[5];
        const double c10 = rx * value[2] + u.x * value[6], c11 = rx * value[3] + u.x * value[7];
        const double c0 = ry * c00 + u.y * c10, c1 = ry * c01 + u.y * c11;
        return rz * c0 + u.z * c1;
    }
};

/// One stored sample in voxels, or nothing where no brick holds it.
std::optional<float> sample_at(const BrickGrid& grid, const glm::ivec3& sample);

/// The trilinear value at a point in voxel coordinates, or nothing in empty blocks and outside.
std::optional<double> distance_at(const BrickGrid& grid, const glm::dvec3& point);

/// Gradient of the field at sample `index` of a block's brick, in voxels: central differences, one-sided
/// where a neighbour is not stored.
/// @pre the block has a brick
glm::dvec3 lattice_gradient(const BrickGrid& grid, const glm::ivec3& block, int index);

/// Gradient of the field at a point: central differences of the samples at the cell's corners, interpolated
/// trilinearly; one-sided where a neighbour is not stored. Far smoother than the gradient of the trilinear
/// cell itself, which serves root finding alone.
/// @param cell the cell that holds the point, inside a block with a brick
/// @returns a vector of length about 1, in voxel coordinates; (0, 0, 0) at worst
glm::dvec3 smooth_gradient(const BrickGrid& grid, const glm::ivec3& cell, const glm::dvec3& u);

}  // namespace sdf
