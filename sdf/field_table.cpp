#include "sdf/field_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "sdf/distance.h"

namespace sdf {

namespace {

int occupied_count(const Brick& brick) {
    int count = 0;
    for (const std::uint64_t layer : brick.occupied) count += std::popcount(layer);
    return count;
}

/// A lower bound of the distance between a triangle and a cell: the widest gap along any of the axes that
/// could part them (Gottschalk et al., "OBBTree", 1996).
double gap_between(const VoxelTriangle& triangle, const glm::dvec3& cell_middle) {
    const auto vector = [](const float(&v)[3]) { return glm::dvec3(v[0], v[1], v[2]); };
    const glm::dvec3 ab = vector(triangle.ab), ac = vector(triangle.ac), a = vector(triangle.a) - cell_middle;
    const glm::dvec3 b = a + ab, c = a + ac;
    double widest = 0.0;
    const auto try_axis = [&](const glm::dvec3& axis) {
        const double length = glm::length(axis);
        if (!(length > 1e-9)) return;
        const double pa = glm::dot(axis, a), pb = glm::dot(axis, b), pc = glm::dot(axis, c);
        const double reach = 0.5 * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
        widest = std::max(widest,
                          std::max(std::min({pa, pb, pc}) - reach, -reach - std::max({pa, pb, pc})) / length);
    };
    try_axis(glm::cross(ab, ac));
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 unit(0.0);
        unit[axis] = 1.0;
        try_axis(unit);
        for (const glm::dvec3& side : {ab, ac, ac - ab}) try_axis(glm::cross(unit, side));
    }
    return widest;
}

/// What the brick's cells know, from `to` on in the order of its mask.
/// @param triangles of all fields; @param triangle_base where those of this one begin
void copy_cells(const BrickGrid& grid, const glm::ivec3& block, const Brick& brick,
                std::span<const VoxelTriangle> triangles, std::int32_t triangle_base, CellSurface* to) {
    // Neighbours share corners.
    constexpr std::int32_t kUnknown = -1;  // No gradient is stored so: its lowest bits are 0.
    std::array<std::int32_t, kBrickSize> gradients;
    gradients.fill(kUnknown);
    struct Candidate {
        int apart;
        std::int32_t triangle;
        auto operator<=>(const Candidate&) const = default;
    };
    for (int i = 0; i < kBrickCells * kBrickCells * kBrickCells; ++i) {
        const glm::ivec3 cell(i / 49, i / 7 % 7, i % 7);
        if (!brick.is_occupied(cell.x, cell.y, cell.z)) continue;
        const glm::dvec3 middle = glm::dvec3(block * kBrickCells + cell) + 0.5;
        std::array<Candidate, 8> candidates;
        std::size_t count = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const int sample =
                Brick::index(cell.x + (corner >> 2), cell.y + (corner >> 1 & 1), cell.z + (corner & 1));
            std::int32_t& gradient = gradients[static_cast<std::size_t>(sample)];
            if (gradient == kUnknown) gradient = stored_gradient(lattice_gradient(grid, block, sample));
            to->gradient[corner] = gradient;
            to->triangle[corner] = -1;
            const std::uint32_t triangle = grid.triangle(brick, sample);
            if (triangle == kNoTriangle) continue;
            const std::int32_t number = static_cast<std::int32_t>(triangle) + triangle_base;
            const auto has_number = [number](const Candidate& other) { return other.triangle == number; };
            const auto end = candidates.begin() + static_cast<std::ptrdiff_t>(count);
            if (std::any_of(candidates.begin(), end, has_number)) continue;
            const double gap = gap_between(triangles[static_cast<std::size_t>(number)], middle);
            candidates[count++] = {stored_gap(gap), number};
        }
        for (std::size_t k = 0; k < count; ++k) {
            const auto rest = candidates.begin() + static_cast<std::ptrdiff_t>(k);
            std::iter_swap(rest,
                           std::min_element(rest, candidates.begin() + static_cast<std::ptrdiff_t>(count)));
            to->triangle[k] = candidates[k].triangle;
            to->gradient[k] |= candidates[k].apart;
        }
        ++to;
    }
}

/// A brick's samples as FieldTable has them.
void copy_samples(const Brick& brick, SampleBits bits, std::vector<std::int16_t>::iterator to) {
    if (bits == SampleBits::k16) {
        std::copy(brick.sample.begin(), brick.sample.end(), to);
        return;
    }
    constexpr int kAlongY = 8;
    for (int i = 0; i < kBrickSize; ++i) {
        const bool has_neighbor = i / kAlongY % kBrickSamples < kBrickCells;
        const int here = brick.sample[static_cast<std::size_t>(i)] / kCoarseSteps;
        const int above =
            has_neighbor ? brick.sample[static_cast<std::size_t>(i + kAlongY)] / kCoarseSteps : 0;
        *to++ = static_cast<std::int16_t>((here & 0xff) | above * 256);
    }
}

BrickCells brick_cells(const Brick& brick, std::size_t first) {
    BrickCells cells;
    cells.occupied = brick.occupied;
    int before = 0;
    for (std::size_t layer = 0; layer < brick.occupied.size(); ++layer) {
        cells.before[layer] = static_cast<std::uint16_t>(before);
        before += std::popcount(brick.occupied[layer]);
    }
    cells.first = static_cast<std::int32_t>(first);
    return cells;
}

}  // namespace

std::size_t occupied_count(const BrickGrid& grid) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < grid.brick_count(); ++i) {
        count += static_cast<std::size_t>(occupied_count(grid.brick_at(static_cast<std::int32_t>(i))));
    }
    return count;
}

FieldAtlas::FieldAtlas(std::span<const std::shared_ptr<const BrickGrid>> grids,
                       std::span<const core::Mesh> meshes)
    : places_(grids.size()) {
    std::size_t top_size = 0, brick_count = 0, cell_count = 0, triangle_count = 0;
    const auto is_empty = [&](std::size_t i) { return !grids[i] || grids[i]->traced_voxels().empty(); };
    for (std::size_t i = 0; i < grids.size(); ++i) {
        if (is_empty(i)) continue;
        const BrickGrid& grid = *grids[i];
        assert(brick_count == 0 || grid.sample_bits() == bits_);
        bits_ = grid.sample_bits();
        Place& place = places_[i];
        place.top_base = static_cast<std::int32_t>(top_size);
        place.brick_base = static_cast<std::int32_t>(brick_count);
        place.triangle_base = static_cast<std::int32_t>(triangle_count);
        place.octant_stride = static_cast<std::int32_t>(grid.top().size());
        place.stride_x = grid.block_count().y * grid.block_count().z;
        place.stride_y = grid.block_count().z;
        place.cell_count = glm::vec3(grid.traced_voxels().maximum);
        place.cell_base = static_cast<std::int32_t>(cell_count);
        top_size += kOctants * grid.top().size();
        brick_count += grid.brick_count();
        cell_count += occupied_count(grid);
        triangle_count += meshes[i].triangles.size();
        constexpr std::size_t kMostCells = (std::size_t{1} << 31) / 16;
        constexpr std::size_t kMostTriangles = (std::size_t{1} << 31) / 9;
        if (brick_count > kMostBricks || top_size > (std::size_t{1} << 30) || cell_count > kMostCells ||
            triangle_count > kMostTriangles) {
            throw core::InputError(
                core::ErrorKind::kOutOfMemory,
                fmt::format("the fields of the scene have more than {} bricks of samples or {} triangles; a "
                            "lower --resolution has fewer bricks",
                            kMostBricks, kMostTriangles));
        }
    }
    top_.resize(top_size);
    boxes_.resize(brick_count * kBrickBoxes);
    // Samples are read in pairs: the last one must have a neighbour.
    samples_.resize(brick_count * kBrickSize + 1);
    bricks_.resize(brick_count);
    cells_.resize(cell_count);
    triangles_.resize(triangle_count);
    for (std::size_t i = 0; i < grids.size(); ++i) {
        if (!is_empty(i)) copy_grid(*grids[i], meshes[i], places_[i]);
    }
}

void FieldAtlas::copy_grid(const BrickGrid& grid, const core::Mesh& mesh, const Place& place) {
    core::parallel_for(mesh.triangles.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const glm::uvec3& corner = mesh.triangles[i];
            const auto voxel = [&](std::uint32_t vertex) {
                return (glm::dvec3(mesh.positions[vertex]) - grid.origin()) / grid.voxel_size();
            };
            const glm::dvec3 a = voxel(corner.x), ab = voxel(corner.y) - a, ac = voxel(corner.z) - a;
            VoxelTriangle& triangle = triangles_[static_cast<std::size_t>(place.triangle_base) + i];
            for (int axis = 0; axis < 3; ++axis) {
                triangle.a[axis] = static_cast<float>(a[axis]);
                triangle.ab[axis] = static_cast<float>(ab[axis]);
                triangle.ac[axis] = static_cast<float>(ac[axis]);
            }
        }
    });
    const SkipBoxes skip(grid);
    std::transform(skip.top.begin(), skip.top.end(), top_.begin() + place.top_base,
                   [&](std::int32_t entry) { return entry < 0 ? entry : entry + place.brick_base; });
    std::copy(skip.boxes.begin(), skip.boxes.end(),
              boxes_.begin() + static_cast<std::ptrdiff_t>(place.brick_base) * kBrickBoxes);
    auto first_cell = static_cast<std::size_t>(place.cell_base);
    for (std::size_t i = 0; i < grid.brick_count(); ++i) {
        const Brick& brick = grid.brick_at(static_cast<std::int32_t>(i));
        bricks_[static_cast<std::size_t>(place.brick_base) + i] = brick_cells(brick, first_cell);
        first_cell += static_cast<std::size_t>(occupied_count(brick));
    }
    const glm::ivec3 count = grid.block_count();
    core::parallel_for(grid.top().size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (grid.top()[i] < 0) continue;
            const Brick& brick = grid.brick_at(grid.top()[i]);
            const auto number = static_cast<std::size_t>(place.brick_base + grid.top()[i]);
            const auto first = static_cast<std::ptrdiff_t>(number * kBrickSize);
            copy_samples(brick, bits_, samples_.begin() + first);
            const auto at = static_cast<int>(i);
            const glm::ivec3 block(at / (count.y * count.z), at / count.z % count.y, at % count.z);
            copy_cells(grid, block, brick, triangles_, place.triangle_base,
                       &cells_[static_cast<std::size_t>(bricks_[number].first)]);
        }
    });
}

std::size_t FieldAtlas::bytes() const {
    return places_.capacity() * sizeof(Place) + top_.capacity() * sizeof(top_[0]) +
           boxes_.capacity() * sizeof(boxes_[0]) + samples_.capacity() * sizeof(samples_[0]) +
           bricks_.capacity() * sizeof(bricks_[0]) + cells_.capacity() * sizeof(cells_[0]) +
           triangles_.capacity() * sizeof(triangles_[0]);
}

}  // namespace sdf
