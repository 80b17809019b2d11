#include "sdf/skip_boxes.h"

#include <algorithm>
#include <cmath>

#include "core/support/parallel.h"

namespace sdf {

namespace {

/// First cell of a region within its brick.
int region_begin(int region) {
    return region == kBrickRegions ? kBrickCells : 2 * region;
}

/// Cells below a border between regions, counted over all bricks.
int cells_below(int border) {
    return border / kBrickRegions * kBrickCells + region_begin(border % kBrickRegions);
}

/// Some of the regions of a field, from `first` up to `end`, counted over all bricks.
struct RegionBox {
    glm::ivec3 first, end;
};

/// Which regions of a field hold occupied cells, and how many do within any box.
class OccupiedRegions {
public:
    explicit OccupiedRegions(const BrickGrid& grid) : count_(grid.block_count() * kBrickRegions) {
        sums_.resize(static_cast<std::size_t>(count_.x + 1) * (count_.y + 1) * (count_.z + 1));
        const glm::ivec3 blocks = grid.block_count();
        core::parallel_for(static_cast<std::size_t>(blocks.x), 1, [&](std::size_t begin, std::size_t end) {
            for (glm::ivec3 block(static_cast<int>(begin), 0, 0); block.x < static_cast<int>(end);
                 ++block.x) {
                for (block.y = 0; block.y < blocks.y; ++block.y) {
                    for (block.z = 0; block.z < blocks.z; ++block.z) {
                        if (const Brick* brick = grid.brick(block)) mark(*brick, block * kBrickRegions);
                    }
                }
            }
        });
        for (int axis = 0; axis < 3; ++axis) sum_up(axis);
    }

    const glm::ivec3& count() const { return count_; }

    bool any_in(const RegionBox& box) const {
        const auto at = [&](int x, int y, int z) { return sums_[index({x, y, z})]; };
        const glm::ivec3 &a = box.first, &b = box.end;
        // Wraps around and back.
        return at(b.x, b.y, b.z) - at(a.x, b.y, b.z) - at(b.x, a.y, b.z) - at(b.x, b.y, a.z) +
                   at(a.x, a.y, b.z) + at(a.x, b.y, a.z) + at(b.x, a.y, a.z) - at(a.x, a.y, a.z) !=
               0;
    }

private:
    std::size_t index(const glm::ivec3& corner) const {
        return (static_cast<std::size_t>(corner.x) * (count_.y + 1) + corner.y) * (count_.z + 1) + corner.z;
    }
    void mark(const Brick& brick, const glm::ivec3& first) {
        for (int cell = 0; cell < kBrickCells * kBrickCells * kBrickCells; ++cell) {
            const glm::ivec3 at(cell / 49, cell / 7 % 7, cell % 7);
            if (!brick.is_occupied(at.x, at.y, at.z)) continue;
            const glm::ivec3 region = glm::min(at / 2, glm::ivec3(kBrickRegions - 1));
            sums_[index(first + region + 1)] = 1;
        }
    }
    void sum_up(int axis) {
        const glm::ivec3 size = count_ + 1;
        const std::size_t stride[] = {static_cast<std::size_t>(size.y) * size.z,
                                      static_cast<std::size_t>(size.z), 1};
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        core::parallel_for(static_cast<std::size_t>(size[u]), 4, [&](std::size_t begin, std::size_t end) {
            for (std::size_t row = begin; row < end; ++row) {
                for (int column = 0; column < size[v]; ++column) {
                    std::uint32_t* at =
                        &sums_[row * stride[u] + static_cast<std::size_t>(column) * stride[v]];
                    for (int i = 1; i < size[axis]; ++i) {
                        at[stride[axis]] += at[0];
                        at += stride[axis];
                    }
                }
            }
        });
    }

    glm::ivec3 count_;
    std::vector<std::uint32_t> sums_;  ///< Occupied regions below each corner.
};

bool is_negative(int octant, int axis) {
    return (octant >> (2 - axis) & 1) != 0;
}

/// Grows an empty box in an octant's direction: evenly along all axes that allow it, then along the others.
RegionBox grow(const OccupiedRegions& occupied, const RegionBox& from, int octant) {
    RegionBox box = from;
    // With `extent` more regions along the axes of `axes`, or as many as there are.
    const auto grown = [&](unsigned axes, int extent) {
        RegionBox larger = box;
        for (int axis = 0; axis < 3; ++axis) {
            if (!(axes >> axis & 1)) continue;
            if (is_negative(octant, axis)) {
                larger.first[axis] = std::max(larger.first[axis] - extent, 0);
            } else {
                larger.end[axis] = std::min(larger.end[axis] + extent, occupied.count()[axis]);
            }
        }
        return larger;
    };
    const auto ends = [&](int axis) {
        return is_negative(octant, axis) ? box.first[axis] == 0 : box.end[axis] == occupied.count()[axis];
    };
    unsigned axes = 7;
    while (axes != 0) {
        for (int axis = 0; axis < 3; ++axis) {
            if (ends(axis) || occupied.any_in(grown(1u << axis, 1))) axes &= ~(1u << axis);
        }
        if (axes == 0) break;
        // Where each alone would do, but not all together: one after the other.
        const unsigned together = occupied.any_in(grown(axes, 1)) ? axes & (~axes + 1) : axes;
        int step = 1;
        while (step < kMostBoxCells && !occupied.any_in(grown(together, 2 * step))) step *= 2;
        int extent = step;
        for (; step > 0; step /= 2) {
            if (!occupied.any_in(grown(together, extent + step))) extent += step;
        }
        box = grown(together, extent);
    }
    return box;
}

/// The box's far side, in cells from the near side of a block.
std::uint32_t packed(const RegionBox& box, const glm::ivec3& block, int octant) {
    std::uint32_t word = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int cells = is_negative(octant, axis)
                              ? (block[axis] + 1) * kBrickCells - cells_below(box.first[axis])
                              : cells_below(box.end[axis]) - block[axis] * kBrickCells;
        word = word << kBoxBits | static_cast<std::uint32_t>(std::min(cells, kMostBoxCells));
    }
    return word;
}

/// A slab as its word keeps it.
struct Slab {
    int normal_x = 0, normal_y = 0;
    int begin = 0, thickness = kMostSlabSteps;

    std::uint32_t word() const {
        return (static_cast<std::uint32_t>(normal_x) & 0xffu) |
               (static_cast<std::uint32_t>(normal_y) & 0xffu) << 8 | static_cast<std::uint32_t>(begin) << 16 |
               static_cast<std::uint32_t>(thickness) << 24;
    }
};

/// The slab of a brick's occupied cells within [first, end). With k f(p) = n . p + e(p), the surface f = 0
/// lies where n . p = -e, and e, trilinear in each cell, is largest and smallest at its corners. The normal
/// is the mean gradient, up or down; where none stands out, the slab has no bound.
Slab slab_of(const Brick& brick, const glm::ivec3& first, const glm::ivec3& end) {
    const auto for_each_corner = [&](const auto& visit) {
        for (int x = first.x; x < end.x; ++x) {
            for (int y = first.y; y < end.y; ++y) {
                for (int z = first.z; z < end.z; ++z) {
                    if (!brick.is_occupied(x, y, z)) continue;
                    for (int corner = 0; corner < 8; ++corner) {
                        const glm::ivec3 side(corner >> 2 & 1, corner >> 1 & 1, corner & 1);
                        const glm::ivec3 at = glm::ivec3(x, y, z) + side;
                        visit(at, side, static_cast<double>(brick.voxels(Brick::index(at.x, at.y, at.z))));
                    }
                }
            }
        }
    };
    // Each cell has four edges along an axis.
    glm::dvec3 gradient(0.0);
    double corners = 0.0;
    for_each_corner([&](const glm::ivec3&, const glm::ivec3& side, double value) {
        gradient += 2.0 * value * (glm::dvec3(side) - 0.5);
        corners += 1.0;
    });
    gradient /= std::max(0.5 * corners, 1.0);
    const double length = std::abs(gradient.x) + std::abs(gradient.y) + std::abs(gradient.z);
    constexpr double kLeastGradient = 0.05;
    if (!(length > kLeastGradient)) return {};
    // Steeper than 127 : 1 along x or y is as good as that.
    const double k = (gradient.z < 0.0 ? -kSlabNormal : kSlabNormal) / length;
    Slab slab;
    // Towards zero: z is not negative.
    slab.normal_x = static_cast<int>(k * gradient.x);
    slab.normal_y = static_cast<int>(k * gradient.y);
    const glm::dvec3 normal(slab.normal_x, slab.normal_y,
                            kSlabNormal - std::abs(slab.normal_x) - std::abs(slab.normal_y));
    double least = 1e30, most = -1e30;
    for_each_corner([&](const glm::ivec3& at, const glm::ivec3&, double value) {
        const double e = k * value - glm::dot(normal, glm::dvec3(at) - 0.5 * kBrickCells);
        least = std::min(least, e);
        most = std::max(most, e);
    });
    // More than positions round within 4096 voxels.
    constexpr double kMargin = 2e-3 * kSlabNormal;
    const double begin = std::floor((-most - kMargin) / static_cast<double>(kSlabStep)),
                 finish = std::ceil((-least + kMargin) / static_cast<double>(kSlabStep));
    if (begin < -kSlabMiddle || begin >= kSlabMiddle || !(finish - begin < kMostSlabSteps)) return {};
    slab.begin = static_cast<int>(begin) + kSlabMiddle;
    slab.thickness = static_cast<int>(finish - begin);
    return slab;
}

/// A slab of the whole brick takes a ray further than its region's, if it is not much thicker.
std::uint32_t wider(const Slab& of_region, const Slab& of_brick) {
    constexpr int kThicker = 8;
    const bool is_wide =
        of_brick.thickness < kMostSlabSteps && of_brick.thickness <= of_region.thickness + kThicker;
    return is_wide ? kWideSlab | of_brick.word() : of_region.word();
}

glm::ivec3 region_at(int number) {
    return {number / 9, number / 3 % 3, number % 3};
}

}  // namespace

SkipBoxes::SkipBoxes(const BrickGrid& grid)
    : top(kOctants * grid.top().size()), boxes(kBrickBoxes * grid.brick_count()) {
    const OccupiedRegions occupied(grid);
    const glm::ivec3 blocks = grid.block_count();
    const std::size_t block_total = grid.top().size();
    core::parallel_for(block_total, 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t number = begin; number < end; ++number) {
            const auto i = static_cast<int>(number);
            const glm::ivec3 block(i / (blocks.y * blocks.z), i / blocks.z % blocks.y, i % blocks.z);
            const std::int32_t entry = grid.top()[number];
            const glm::ivec3 first = block * kBrickRegions;
            if (entry < 0) {
                for (int octant = 0; octant < kOctants; ++octant) {
                    const RegionBox box = grow(occupied, {first, first + kBrickRegions}, octant);
                    top[static_cast<std::size_t>(octant) * block_total + number] =
                        static_cast<std::int32_t>(kEmptyBox | packed(box, block, octant));
                }
                continue;
            }
            const Brick& brick = grid.brick_at(entry);
            const auto number_of_brick = static_cast<std::size_t>(entry);
            for (int octant = 0; octant < kOctants; ++octant) {
                top[static_cast<std::size_t>(octant) * block_total + number] = entry;
            }
            const Slab of_brick = slab_of(brick, glm::ivec3(0), glm::ivec3(kBrickCells));
            for (int region = 0; region < kRegions; ++region) {
                const glm::ivec3 at = region_at(region);
                const RegionBox own{first + at, first + at + 1};
                const bool is_occupied = occupied.any_in(own);
                std::uint32_t slab = 0;
                if (is_occupied) {
                    slab = wider(
                        slab_of(brick, {region_begin(at.x), region_begin(at.y), region_begin(at.z)},
                                {region_begin(at.x + 1), region_begin(at.y + 1), region_begin(at.z + 1)}),
                        of_brick);
                }
                for (int octant = 0; octant < kOctants; ++octant) {
                    boxes[number_of_brick * kBrickBoxes +
                          static_cast<std::size_t>(octant * kRegions + region)] =
                        is_occupied ? slab : kEmptyBox | packed(grow(occupied, own, octant), block, octant);
                }
            }
        }
    });
}

}  // namespace sdf
