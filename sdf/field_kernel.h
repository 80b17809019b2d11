// sdf/field_kernel.h: many rays through distance fields at once, in whatever vectors the processor has.
//
// The vectorised twin of RayMarch: it finds where a ray first crosses the surface of a field. Every lane is a
// ray of its own, and a lane whose ray has ended takes the next one from the queue. Rays cross empty space
// from box to box (skip_boxes.h), and the cells that they then come to are searched many at once. No vector
// type and no instruction set shows here; the widest that the processor has is chosen at run time.
//
// The sign of the field is carried along each ray from sample to sample, so that a crossing is seen as a
// change of sign however the positions round: cells, bricks and blocks meet without gaps.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sdf/brick_grid.h"

namespace sdf {

/// How a crossing is found: the dial between accuracy and time.
enum class HitMode : std::uint8_t {
    kEps,     ///< A change of sign over a cell, then false positions until a sample is within kHitEpsVoxels.
    kSecant,  ///< A change of sign over a cell, then three false positions.
    kCubic,   ///< The first root of the cell's cubic: the exact surface of the trilinear field.
};

/// Below this distance a sample counts as a hit in HitMode::kEps, in voxels.
inline constexpr float kHitEpsVoxels = 0.1f;

inline constexpr int kBrickBits = 21;

/// What an occupied cell knows besides its samples.
struct alignas(64) CellSurface {
    /// At the corners, corner 4 x + 2 y + z: stored_gradient(), and in the two lowest bits the stored_gap()
    /// between the cell and the triangle of the same place.
    std::int32_t gradient[8];
    /// The distinct ones that the corners name, by their gaps and then ascending; the rest -1.
    std::int32_t triangle[8];
};

/// The occupied cells of a brick.
struct alignas(16) BrickCells {
    std::array<std::uint64_t, kBrickCells> occupied{};  ///< As in Brick.
    std::array<std::uint16_t, kBrickCells> before{};    ///< Occupied cells in the layers below.
    std::int32_t first = 0;  ///< Of its cells among the CellSurfaces of all fields.

    int count() const { return before.back() + std::popcount(occupied.back()); }
    /// The CellSurface of a cell, counted over all fields. A crossing in the very face of a cell may be seen
    /// from the empty one beyond it: that has the next cell's. @param y_z 7 y + z
    std::int32_t entry(int x, int y_z) const {
        const auto layer = static_cast<std::size_t>(x);
        const std::uint64_t below = (std::uint64_t{1} << y_z) - 1;
        const int rank = before[layer] + std::popcount(occupied[layer] & below);
        return first + std::min(rank, count() - 1);
    }
};

/// Fields of many meshes laid out for the kernel: blocks of 7^3 cells, those near the surface with a brick of
/// 8^3 samples (see brick_grid.h), and how far rays may skip (see skip_boxes.h).
struct FieldTable {
    /// Entries of all fields, each by octant and block, as SkipBoxes::top; bricks numbered over all fields.
    const std::int32_t* top = nullptr;
    const std::uint32_t* boxes = nullptr;  ///< As SkipBoxes::boxes.
    const BrickCells* bricks = nullptr;    ///< What surface of each brick is stored where.
    const CellSurface* cells = nullptr;
    /// kBrickSize a brick, as in Brick, and one more in all. Of 8 bits, in units of kCoarseSteps, a pair
    /// each: the sample in the lower half, its neighbour along y in the upper.
    const std::int16_t* samples = nullptr;
    SampleBits bits = SampleBits::k16;
};

/// A ray in the voxels of one field, and where that field lies in the table.
struct alignas(64) MarchRay {
    float origin[3];        ///< Within the field's box.
    float direction[3];     ///< Unit length; components under 1e-20 are 0.
    float length;           ///< Voxels to the ray's end, or to where it leaves the box.
    std::int32_t top_base;  ///< First entry of the field.
    std::int32_t top_octant, top_stride_x,
        top_stride_y;     ///< Entries from octant to octant, and block to block.
    float cell_count[3];  ///< Cells along each side of the box.
};

enum class MarchStatus : std::uint8_t { kMiss, kHit, kExhausted };

/// Where a ray crosses the surface.
struct MarchHit {
    float distance;        ///< Voxels from the origin.
    std::int32_t brick;    ///< Over all fields.
    std::int32_t surface;  ///< The cell's entry in FieldTable::cells.
    std::int16_t cell[3];  ///< Within the field.
    MarchStatus status;
    bool enters_negative;  ///< From positive to negative values.
    std::uint32_t steps;   ///< Boxes crossed and cells searched.
};

/// Marches every ray to its first crossing. Each answer depends on its own ray alone, and is the same to the
/// last bit on every instruction set.
/// @pre hits.size() == rays.size()
void march_rays(const FieldTable& fields, HitMode mode, std::span<const MarchRay> rays,
                std::span<MarchHit> hits);

/// Names of the instruction sets that this build has kernels for and this processor can run, best first.
std::vector<std::string> kernel_targets();

/// Runs kernels with the named instruction set from now on; empty: the best. For tests and measurements; not
/// while others trace. @returns false if there is no such target
bool select_kernel_target(const std::string& name);

}  // namespace sdf
