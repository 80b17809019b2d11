// sdf/brick_grid.h: the field as the tracer walks it: bricks of samples, occupied cells, safe steps between.
//
// Space is cut into blocks of 7^3 cells. A block that holds a piece of the surface has a brick of 8^3
// samples of 16 bits, a mask of the cells that hold a zero crossing, and each sample's closest triangle.
// Every other block holds a lower bound of the distance to the nearest occupied cell, which is rigorous for
// the trilinear surface whatever the interpolation error (raw samples are not).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "core/math/bounds.h"
#include "sdf/sampled_field.h"
#include "sdf/triangle_bvh.h"

namespace sdf {

class LeafMap;

/// Cells of a brick from `first` up to `end`.
struct CellBox {
    glm::ivec3 first, end;
};

/// Cells, and samples, along one side of a brick.
inline constexpr int kBrickCells = 7;
inline constexpr int kBrickSamples = kBrickCells + 1;

inline constexpr int kBrickSize = kBrickSamples * kBrickSamples * kBrickSamples;

/// Samples are stored in steps of this many voxels, +-32767 of them: as far as the band reaches.
inline constexpr float kSampleStepVoxels = kBandVoxels / 32767.0f;

/// How finely samples are stored.
enum class SampleBits : std::uint8_t {
    k8 = 8,    ///< Only every kCoarseSteps-th step: 0.03 voxel.
    k16 = 16,  ///< Every step: 1e-4 voxel.
};

/// Steps from one 8-bit sample to the next: 127 of them reach as far as the band.
inline constexpr int kCoarseSteps = 258;

/// The stored form of a distance in voxels, in steps of kSampleStepVoxels: the nearest that there is, save
/// that no value changes its sign. (0 counts as positive.)
std::int16_t stored_sample(float voxels, SampleBits bits = SampleBits::k16);

/// 8^3 samples in steps of kSampleStepVoxels, negative inside; x runs slowest, z fastest. Where the band
/// holds nothing the sample is the farthest one of its neighbours' sign, so that it makes no crossing.
struct Brick {
    std::array<std::int16_t, kBrickSize> sample;
    std::array<std::uint16_t, kBrickSize> palette_entry;  ///< Of the closest triangle.
    /// One word an x-layer of cells, bit 7 y + z: the cell holds a zero crossing.
    std::array<std::uint64_t, kBrickCells> occupied;
    std::uint32_t palette_first;  ///< Where the brick's palette begins among those of all bricks.
    std::uint32_t unused;

    static constexpr int index(int x, int y, int z) { return (x * kBrickSamples + y) * kBrickSamples + z; }
    float voxels(int i) const {
        return static_cast<float>(sample[static_cast<std::size_t>(i)]) * kSampleStepVoxels;
    }
    bool is_occupied(int x, int y, int z) const { return (occupied[x] >> (kBrickCells * y + z)) & 1; }
};

/// The least box of a brick's occupied cells.
CellBox occupied_box(const Brick& brick);

/// An immutable field ready for tracing. Voxel coordinates: sample (i, j, k) lies at (i, j, k), and block
/// (0, 0, 0) starts at 0; all coordinates inside the grid are >= 0.
class BrickGrid {
public:
    /// Lays out a baked field.
    explicit BrickGrid(const SampledField& field, SampleBits bits = SampleBits::k16);

    const FieldInfo& info() const { return info_; }
    SampleBits sample_bits() const { return bits_; }
    double voxel_size() const { return info_.voxel_size; }
    /// Local position of voxel coordinate (0, 0, 0).
    const glm::dvec3& origin() const { return origin_; }
    const glm::ivec3& block_count() const { return block_count_; }

    /// Box that holds all occupied cells with one more on every side, in voxels; empty if the field has no
    /// surface.
    const core::DoubleBounds& traced_voxels() const { return traced_voxels_; }
    /// The same in local units.
    core::DoubleBounds local_bounds() const;

    /// The block's brick, or nothing where it is empty. @pre coordinates in range
    const Brick* brick(const glm::ivec3& block) const {
        const std::int32_t entry = top_[block_index(block)];
        return entry >= 0 ? &bricks_[static_cast<std::size_t>(entry)] : nullptr;
    }
    /// The brick that holds a cell, or nothing in empty blocks and outside the grid.
    const Brick* brick_or_null(const glm::ivec3& cell) const {
        if (cell.x < 0 || cell.y < 0 || cell.z < 0) return nullptr;
        const glm::ivec3 block = cell / kBrickCells;
        if (block.x >= block_count_.x || block.y >= block_count_.y || block.z >= block_count_.z)
            return nullptr;
        return brick(block);
    }
    /// Entry of the top grid: a brick number if >= 0, else see empty_distance().
    std::int32_t entry(const glm::ivec3& block) const { return top_[block_index(block)]; }
    const std::vector<std::uint32_t>& palettes() const { return palettes_; }
    /// All entries, z fastest.
    const std::vector<std::int32_t>& top() const { return top_; }
    const Brick& brick_at(std::int32_t entry) const { return bricks_[static_cast<std::size_t>(entry)]; }
    /// Voxels from anywhere in an empty block to the nearest occupied cell, rounded down.
    static double empty_distance(std::int32_t entry) { return -(entry + 1) * kDistanceStep; }

    /// The triangle closest to a sample of a brick; kNoTriangle where the band holds no sample.
    std::uint32_t triangle(const Brick& brick, int i) const {
        const std::uint16_t entry = brick.palette_entry[static_cast<std::size_t>(i)];
        return entry == kNoPaletteEntry ? kNoTriangle : palettes_[brick.palette_first + entry];
    }

    Feature feature(std::uint32_t triangle) const {
        return features_.empty() ? Feature::kSurface : features_[triangle];
    }
    /// tau in voxels; 0 where nothing is inflated.
    double half_thickness_voxels() const { return info_.half_thickness / info_.voxel_size; }

    std::size_t brick_count() const { return bricks_.size(); }
    /// Memory held.
    std::size_t bytes() const;

private:
    static constexpr double kDistanceStep = 1.0 / 64.0;
    static constexpr int kNearBlocks = 2;
    static constexpr std::uint16_t kNoPaletteEntry = 0xffff;

    std::size_t block_index(const glm::ivec3& block) const {
        return (static_cast<std::size_t>(block.x) * block_count_.y + block.y) * block_count_.z + block.z;
    }
    void fill_brick(const LeafMap& map, const glm::ivec3& first_sample, Brick& brick,
                    std::vector<std::uint32_t>& palette) const;
    void fill_empty_distances();
    /// Voxels from an empty block to the nearest occupied cell within kNearBlocks, or as many blocks.
    double distance_to_near_cells(const glm::ivec3& block, const std::vector<CellBox>& boxes) const;

    FieldInfo info_;
    SampleBits bits_;
    glm::dvec3 origin_{0.0};
    glm::ivec3 block_count_{0};
    core::DoubleBounds traced_voxels_;
    std::vector<std::int32_t> top_;
    std::vector<Brick> bricks_;
    std::vector<std::uint32_t> palettes_;  ///< The distinct triangles of each brick, ascending.
    std::vector<Feature> features_;
};

}  // namespace sdf
