#include "sdf/brick_grid.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>

#include "core/support/parallel.h"
#include "sdf/band.h"

namespace sdf {

namespace {

using LeafMask = std::bitset<kLeafSize>;

/// Cells, named by their lowest corner, that hold a zero crossing: all corners known and not of one sign.
/// Cells behind a surface that lies in their own corners count as well: where rounding hides a crossing in
/// the face of a cell, it is the next one that tells.
/// @param zero_below values from 0 up to this are stored as 0
LeafMask occupied_cells(const LeafMap& map, const FieldLeaf& leaf, float zero_below) {
    LeafMask occupied;
    for (int i = 0; i < kLeafSize; ++i) {
        if (!leaf.is_active(i)) continue;
        const glm::ivec3 cell(i / 64, i / 8 % 8, i % 8);
        int negative = 0, zero = 0;
        bool is_known = true;
        for (int corner = 0; corner < 8 && is_known; ++corner) {
            const glm::ivec3 local = cell + glm::ivec3(corner >> 2 & 1, corner >> 1 & 1, corner & 1);
            float value = 0.0f;
            if (local.x < kLeafSide && local.y < kLeafSide && local.z < kLeafSide) {
                const int index = FieldLeaf::index(local.x, local.y, local.z);
                is_known = leaf.is_active(index);
                value = leaf.distance[static_cast<std::size_t>(index)];
            } else {
                const float* sample = map.value(leaf.origin + local);
                is_known = sample != nullptr;
                if (sample) value = *sample;
            }
            negative += value < 0.0f;
            zero += value >= 0.0f && value <= zero_below;
        }
        occupied[static_cast<std::size_t>(i)] = is_known && negative < 8 && negative + zero > 0;
    }
    return occupied;
}

/// Counts cells as occupied over which the sign changes between samples that the band does not all hold: the
/// lids of holes reach farther than it.
void occupy_lids(Brick& brick) {
    constexpr int kCorners[] = {0, 1, 8, 9, 64, 65, 72, 73};
    for (int x = 0; x < kBrickCells; ++x) {
        for (int y = 0; y < kBrickCells; ++y) {
            for (int z = 0; z < kBrickCells; ++z) {
                int negative = 0;
                for (const int corner : kCorners) {
                    negative += brick.sample[static_cast<std::size_t>(Brick::index(x, y, z) + corner)] < 0;
                }
                if (negative == 0 || negative == 8) continue;
                brick.occupied[static_cast<std::size_t>(x)] |= std::uint64_t{1} << (kBrickCells * y + z);
            }
        }
    }
}

/// Gives samples that the band does not hold the sign of their neighbours, in waves from those it holds.
/// @param farthest sample that there is
void fill_unknown(std::array<std::int16_t, kBrickSize>& sample, std::bitset<kBrickSize> is_known,
                  std::int16_t farthest) {
    constexpr int kStride[] = {64, 8, 1};
    while (!is_known.all() && is_known.any()) {
        std::bitset<kBrickSize> reached = is_known;
        for (int i = 0; i < kBrickSize; ++i) {
            if (is_known[static_cast<std::size_t>(i)]) continue;
            const int position[] = {i / 64, i / 8 % 8, i % 8};
            for (int side = 0; side < 6; ++side) {
                const int axis = side / 2, step = side % 2 == 0 ? -1 : 1;
                const int there = position[axis] + step;
                if (there < 0 || there >= kBrickSamples) continue;
                const auto neighbor = static_cast<std::size_t>(i + step * kStride[axis]);
                if (!is_known[neighbor]) continue;
                sample[static_cast<std::size_t>(i)] =
                    sample[neighbor] < 0 ? static_cast<std::int16_t>(-farthest) : farthest;
                reached[static_cast<std::size_t>(i)] = true;
                break;
            }
        }
        is_known = reached;
    }
}

/// Squared distance, in blocks, between two boxes of one block whose numbers differ by `offset` along an
/// axis.
std::int64_t gap_squared(int offset) {
    const std::int64_t gap = std::max(std::abs(offset) - 1, 0);
    return gap * gap;
}

}  // namespace

CellBox occupied_box(const Brick& brick) {
    CellBox box{glm::ivec3(kBrickCells), glm::ivec3(0)};
    for (int cell = 0; cell < kBrickCells * kBrickCells * kBrickCells; ++cell) {
        const glm::ivec3 position(cell / 49, cell / 7 % 7, cell % 7);
        if (!brick.is_occupied(position.x, position.y, position.z)) continue;
        box.first = glm::min(box.first, position);
        box.end = glm::max(box.end, position + 1);
    }
    return box;
}

std::int16_t stored_sample(float voxels, SampleBits bits) {
    const int unit = bits == SampleBits::k8 ? kCoarseSteps : 1;
    const int farthest = 32767 / unit;
    const auto most = static_cast<float>(farthest);
    const float steps =
        std::clamp(std::round(voxels / (kSampleStepVoxels * static_cast<float>(unit))), -most, most);
    const auto stored = static_cast<int>(steps);
    return static_cast<std::int16_t>(voxels < 0.0f && stored == 0 ? -unit : stored * unit);
}

BrickGrid::BrickGrid(const SampledField& field, SampleBits bits)
    : info_(field.info), bits_(bits), features_(field.features) {
    const LeafMap map(field.leaves);
    std::vector<LeafMask> occupied(field.leaves.size());
    const double step_voxels =
        static_cast<double>(kSampleStepVoxels) * (bits == SampleBits::k8 ? kCoarseSteps : 1);
    const auto zero_below = static_cast<float>(0.5 * step_voxels * field.info.voxel_size);
    core::parallel_for(field.leaves.size(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            occupied[i] = occupied_cells(map, field.leaves[i], zero_below);
    });

    core::BasicBounds<glm::dvec3> cells;
    for (std::size_t i = 0; i < occupied.size(); ++i) {
        if (occupied[i].none()) continue;
        for (int cell = 0; cell < kLeafSize; ++cell) {
            if (!occupied[i][static_cast<std::size_t>(cell)]) continue;
            cells.include(glm::dvec3(field.leaves[i].origin + glm::ivec3(cell / 64, cell / 8 % 8, cell % 8)));
        }
    }
    if (cells.empty()) return;
    // One more cell on every side: a surface may lie in the very faces of its cells, and a ray must see the
    // sign before it.
    const glm::ivec3 first = glm::ivec3(cells.minimum) - 1;
    const glm::ivec3 cell_count = glm::ivec3(cells.maximum) + 2 - first;
    traced_voxels_.include(glm::dvec3(0.0));
    traced_voxels_.include(glm::dvec3(cell_count));
    origin_ = info_.origin + info_.voxel_size * glm::dvec3(first);
    block_count_ = (cell_count + kBrickCells - 1) / kBrickCells;
    top_.assign(static_cast<std::size_t>(block_count_.x) * block_count_.y * block_count_.z, -1);

    std::vector<glm::ivec3> blocks;
    for (std::size_t i = 0; i < occupied.size(); ++i) {
        if (occupied[i].none()) continue;
        for (int cell = 0; cell < kLeafSize; ++cell) {
            if (!occupied[i][static_cast<std::size_t>(cell)]) continue;
            const glm::ivec3 position =
                field.leaves[i].origin + glm::ivec3(cell / 64, cell / 8 % 8, cell % 8) - first;
            const glm::ivec3 block = position / kBrickCells;
            std::int32_t& entry = top_[block_index(block)];
            if (entry < 0) {
                entry = static_cast<std::int32_t>(blocks.size());
                blocks.push_back(block);
                bricks_.emplace_back();
                bricks_.back().occupied.fill(0);
            }
            const glm::ivec3 local = position - block * kBrickCells;
            bricks_[static_cast<std::size_t>(entry)].occupied[static_cast<std::size_t>(local.x)] |=
                std::uint64_t{1} << (kBrickCells * local.y + local.z);
        }
    }
    std::vector<std::vector<std::uint32_t>> palettes(blocks.size());
    core::parallel_for(blocks.size(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t number = begin; number < end; ++number) {
            fill_brick(map, first + blocks[number] * kBrickCells, bricks_[number], palettes[number]);
        }
    });
    for (std::size_t number = 0; number < blocks.size(); ++number) {
        bricks_[number].palette_first = static_cast<std::uint32_t>(palettes_.size());
        palettes_.insert(palettes_.end(), palettes[number].begin(), palettes[number].end());
    }
    palettes_.shrink_to_fit();
    bricks_.shrink_to_fit();
    fill_empty_distances();
}

void BrickGrid::fill_brick(const LeafMap& map, const glm::ivec3& first_sample, Brick& brick,
                           std::vector<std::uint32_t>& palette) const {
    constexpr std::uint32_t kUnknown = kNoTriangle;
    std::array<std::uint32_t, kBrickSize> triangles;
    std::bitset<kBrickSize> is_known;
    for (int i = 0; i < kBrickSize; ++i) {
        const auto at = static_cast<std::size_t>(i);
        const glm::ivec3 sample = first_sample + glm::ivec3(i / 64, i / 8 % 8, i % 8);
        const FieldLeaf* leaf = map.find(sample);
        const auto slot = static_cast<std::size_t>(LeafMap::offset_in_leaf(sample));
        is_known[at] = leaf && leaf->is_active(static_cast<int>(slot));
        triangles[at] = kUnknown;
        if (!is_known[at]) continue;
        brick.sample[at] = stored_sample(static_cast<float>(leaf->distance[slot] / info_.voxel_size), bits_);
        if (leaf->triangle[slot] < 0) continue;
        triangles[at] = static_cast<std::uint32_t>(leaf->triangle[slot]);
        palette.push_back(triangles[at]);
    }
    std::sort(palette.begin(), palette.end());
    palette.erase(std::unique(palette.begin(), palette.end()), palette.end());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto entry = std::lower_bound(palette.begin(), palette.end(), triangles[i]);
        brick.palette_entry[i] =
            triangles[i] == kUnknown ? kNoPaletteEntry : static_cast<std::uint16_t>(entry - palette.begin());
    }
    fill_unknown(brick.sample, is_known, stored_sample(kBandVoxels, bits_));
    occupy_lids(brick);
}

void BrickGrid::fill_empty_distances() {
    // An exact distance transform over blocks, axis by axis: squared gaps between boxes add up over axes.
    constexpr std::int64_t kFar = std::numeric_limits<std::int32_t>::max();
    const glm::ivec3 count = block_count_;
    std::vector<std::int64_t> squared(top_.size());
    for (std::size_t i = 0; i < top_.size(); ++i) squared[i] = top_[i] >= 0 ? 0 : kFar;
    for (int axis = 2; axis >= 0; --axis) {
        const int length = count[axis];
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        core::parallel_for(static_cast<std::size_t>(count[u]), 4, [&](std::size_t begin, std::size_t end) {
            std::vector<std::int64_t> line(static_cast<std::size_t>(length));
            for (std::size_t row = begin; row < end; ++row) {
                for (int column = 0; column < count[v]; ++column) {
                    glm::ivec3 block(0);
                    block[u] = static_cast<int>(row);
                    block[v] = column;
                    for (int i = 0; i < length; ++i) {
                        block[axis] = i;
                        line[static_cast<std::size_t>(i)] = squared[block_index(block)];
                    }
                    for (int i = 0; i < length; ++i) {
                        std::int64_t best = line[static_cast<std::size_t>(i)];
                        for (int offset = 1; offset < length && gap_squared(offset) < best; ++offset) {
                            const std::int64_t gap = gap_squared(offset);
                            if (i >= offset) {
                                best = std::min(best, gap + line[static_cast<std::size_t>(i - offset)]);
                            }
                            if (i + offset < length) {
                                best = std::min(best, gap + line[static_cast<std::size_t>(i + offset)]);
                            }
                        }
                        block[axis] = i;
                        squared[block_index(block)] = best;
                    }
                }
            }
        });
    }
    std::vector<CellBox> boxes(bricks_.size());
    for (std::size_t i = 0; i < bricks_.size(); ++i) boxes[i] = occupied_box(bricks_[i]);
    std::vector<std::int32_t> entries = top_;
    core::parallel_for(static_cast<std::size_t>(count.x), 1, [&](std::size_t begin, std::size_t end) {
        for (glm::ivec3 block(static_cast<int>(begin), 0, 0); block.x < static_cast<int>(end); ++block.x) {
            for (block.y = 0; block.y < count.y; ++block.y) {
                for (block.z = 0; block.z < count.z; ++block.z) {
                    const std::size_t i = block_index(block);
                    if (top_[i] >= 0) continue;
                    double voxels = kBrickCells * std::sqrt(static_cast<double>(squared[i]));
                    if (squared[i] < kNearBlocks * kNearBlocks) voxels = distance_to_near_cells(block, boxes);
                    entries[i] =
                        -1 - static_cast<std::int32_t>(std::floor(voxels * (1.0 - 1e-12) / kDistanceStep));
                }
            }
        }
    });
    top_ = std::move(entries);
}

double BrickGrid::distance_to_near_cells(const glm::ivec3& block, const std::vector<CellBox>& boxes) const {
    // Bricks farther off leave a gap of kNearBlocks at least.
    double nearest = kBrickCells * kNearBlocks;
    const glm::ivec3 low = glm::max(block - kNearBlocks, glm::ivec3(0)),
                     high = glm::min(block + kNearBlocks, block_count_ - 1);
    for (glm::ivec3 other = low; other.x <= high.x; ++other.x) {
        for (other.y = low.y; other.y <= high.y; ++other.y) {
            for (other.z = low.z; other.z <= high.z; ++other.z) {
                const std::int32_t entry = top_[block_index(other)];
                if (entry < 0) continue;
                const CellBox& box = boxes[static_cast<std::size_t>(entry)];
                const glm::ivec3 first = (other - block) * kBrickCells;
                const glm::ivec3 gap =
                    glm::max(glm::max(first + box.first - kBrickCells, -(first + box.end)), glm::ivec3(0));
                nearest = std::min(nearest, glm::length(glm::dvec3(gap)));
            }
        }
    }
    return nearest;
}

core::DoubleBounds BrickGrid::local_bounds() const {
    core::DoubleBounds result;
    if (traced_voxels_.empty()) return result;
    result.include(origin_ + info_.voxel_size * traced_voxels_.minimum);
    result.include(origin_ + info_.voxel_size * traced_voxels_.maximum);
    return result;
}

std::size_t BrickGrid::bytes() const {
    return sizeof(*this) + top_.capacity() * sizeof(top_[0]) + bricks_.capacity() * sizeof(Brick) +
           palettes_.capacity() * sizeof(palettes_[0]) + features_.capacity();
}

}  // namespace sdf
