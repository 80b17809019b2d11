// sdf/surface_kernel.h: what lies at a crossing: the field's normal and the closest of the cell's triangles,
// for many crossings at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "core/trace/ray_stream.h"
#include "sdf/field_kernel.h"

namespace sdf {

/// A triangle in the voxels of its field.
struct VoxelTriangle {
    float a[3];          ///< First corner.
    float ab[3], ac[3];  ///< To the second and the third.
};

/// A gradient of the field in one word: three components of 10 bits, in steps of kGradientStep.
inline constexpr float kGradientStep = 1.0f / 400.0f;
std::int32_t stored_gradient(const glm::dvec3& gradient);

/// Distances in voxels that a gap may be known to have at least. A triangle that lies so far off its cell
/// need not be looked at where another is nearer.
inline constexpr std::array<float, 4> kGaps = {0.0f, 0.0625f, 0.25f, 0.5f};
/// The largest of kGaps that a gap has, by its number.
int stored_gap(double voxels);

/// Where the surface of all fields is kept; triangles are numbered over all of them.
struct SurfaceTable {
    const CellSurface* cells = nullptr;
    const VoxelTriangle* triangles = nullptr;
};

/// Crossings and what was found there, one column a component, at least as long as whole vectors need.
struct SurfacePoints {
    // In.
    core::Column<float> x, y, z;                                ///< Voxel coordinates.
    core::Column<float> direction_x, direction_y, direction_z;  ///< Of the ray, voxels.
    core::Column<float> cell_x, cell_y, cell_z;  ///< The cell's lowest corner, voxel coordinates.
    core::Column<std::int32_t> cell;             ///< Its entry in SurfaceTable::cells.
    // Out.
    core::Column<float> gradient_x, gradient_y, gradient_z;  ///< Of the field, in voxels.
    core::Column<std::int32_t>
        triangle;              ///< The closest of the cell's corners' triangles; -1: they name none.
    core::Column<float> u, v;  ///< Barycentrics of its closest point: second and third corner.
    core::Column<float> distance_squared;  ///< From that point, voxels.
    core::Column<float> side;              ///< Negative where the ray comes from that triangle's front.

    std::size_t size() const { return size_; }
    /// Padding is filled with crossings of the first cell.
    void resize(std::size_t count);
    /// Sets a crossing that march_rays() found.
    void set(std::size_t index, const MarchRay& ray, const MarchHit& hit);

    core::Column<std::int32_t> work;  ///< For find_surface().
    /// The number of a crossing that is there and nobody's.
    std::size_t spare() const { return core::padded_stream_size(size_); }

private:
    std::size_t size_ = 0;
};

/// Fills the columns marked Out. The gradient is the trilinear mean of the corners' gradients; among equally
/// close triangles the lowest number wins. Same bits on every instruction set.
void find_surface(const SurfaceTable& table, SurfacePoints& points);

}  // namespace sdf
