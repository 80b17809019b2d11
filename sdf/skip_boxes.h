// sdf/skip_boxes.h: how far rays may go through a field without looking at it, by the way they run.
//
// A brick of 7^3 cells is cut into 3^3 regions of two, two and three cells a side. For every region, every
// empty block and each of the eight octants of directions there is a box that begins there, reaches in that
// direction, and holds no occupied cell: a ray that leaves a wall crosses the room in one step. Regions with
// occupied cells have a slab instead, between two parallel planes, that holds all of the surface there: a ray
// that does not come into it cannot meet the surface. Both are rigorous for the trilinear surface.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdf/brick_grid.h"

namespace sdf {

inline constexpr int kOctants = 8;

/// Regions along one side of a brick, and in all. Region i begins at cell 2 i; the last has three cells.
inline constexpr int kBrickRegions = 3;
inline constexpr int kRegions = kBrickRegions * kBrickRegions * kBrickRegions;

/// Words a brick in SkipBoxes::boxes.
inline constexpr int kBrickBoxes = kOctants * kRegions;

/// A box that holds no occupied cell is kEmptyBox and, along x, y and z, the cells from its block's near side
/// (as the ray comes) to the box's far side, ten bits each, x highest.
inline constexpr std::uint32_t kEmptyBox = 0x80000000u;
inline constexpr int kBoxBits = 10;
inline constexpr int kMostBoxCells = (1 << kBoxBits) - 1;

/// Any other word is a slab: of the whole brick where kWideSlab is set, else of the region. From the lowest
/// bits: x and y of the normal, eight bits each, signed; z is what is left to kSlabNormal, never negative.
/// Heights are normal . (position - middle of the brick) in steps of kSlabStep: where the slab begins, plus
/// 128, eight bits; how thick it is, six bits, the most for one without a bound.
inline constexpr std::uint32_t kWideSlab = 0x40000000u;
inline constexpr int kSlabNormal = 127;
inline constexpr float kSlabStep = 7.0f * 127.0f / 256.0f;
inline constexpr int kSlabMiddle = 128, kMostSlabSteps = 63;

/// The boxes and slabs of one field.
struct SkipBoxes {
    /// By octant, then block as in BrickGrid::top(): the box of an empty block, or a brick's number. Octant:
    /// bit 2 where directions along x are negative, bit 1 y, bit 0 z.
    std::vector<std::int32_t> top;
    /// By brick, octant, region (x slowest).
    std::vector<std::uint32_t> boxes;

    explicit SkipBoxes(const BrickGrid& grid);
};

}  // namespace sdf
