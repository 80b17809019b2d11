#include "sdf/field_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <bitset>
#include <cmath>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "sdf/distance.h"

namespace sdf {

namespace {

/// The gradients at the corners of a brick's occupied cells; nobody asks for others.
void copy_gradients(const BrickGrid& grid, const glm::ivec3& block, const Brick& brick, std::int32_t* to) {
    std::bitset<kBrickSize> wanted;
    for (int i = 0; i < kBrickSize; ++i) {
        const glm::ivec3 cell(i / 64, i / 8 % 8, i % 8);
        if (cell.x == kBrickCells || cell.y == kBrickCells || cell.z == kBrickCells) continue;
        if (!brick.is_occupied(cell.x, cell.y, cell.z)) continue;
        for (int corner = 0; corner < 8; ++corner) {
            wanted[static_cast<std::size_t>(Brick::index(cell.x + (corner >> 2), cell.y + (corner >> 1 & 1),
                                                         cell.z + (corner & 1)))] = true;
        }
    }
    for (int i = 0; i < kBrickSize; ++i) {
        if (wanted[static_cast<std::size_t>(i)]) to[i] = stored_gradient(lattice_gradient(grid, block, i));
    }
}

}  // namespace

FieldAtlas::FieldAtlas(std::span<const std::shared_ptr<const BrickGrid>> grids,
                       std::span<const core::Mesh> meshes)
    : places_(grids.size()) {
    std::size_t top_size = 0, brick_count = 0, palette_size = 0, triangle_count = 0;
    std::vector<std::size_t> palette_bases(grids.size());
    const auto is_empty = [&](std::size_t i) { return !grids[i] || grids[i]->traced_voxels().empty(); };
    for (std::size_t i = 0; i < grids.size(); ++i) {
        if (is_empty(i)) continue;
        const BrickGrid& grid = *grids[i];
        Place& place = places_[i];
        place.top_base = static_cast<std::int32_t>(top_size);
        place.brick_base = static_cast<std::int32_t>(brick_count);
        place.triangle_base = static_cast<std::int32_t>(triangle_count);
        place.octant_stride = static_cast<std::int32_t>(grid.top().size());
        place.stride_x = grid.block_count().y * grid.block_count().z;
        place.stride_y = grid.block_count().z;
        place.cell_count = glm::vec3(grid.traced_voxels().maximum);
        palette_bases[i] = palette_size;
        top_size += kOctants * grid.top().size();
        brick_count += grid.brick_count();
        palette_size += grid.palettes().size();
        triangle_count += meshes[i].triangles.size();
        constexpr std::size_t kMostTriangles = (std::size_t{1} << 31) / 9;
        if (brick_count > kMostBricks || top_size > (std::size_t{1} << 30) || palette_size > kMostTriangles ||
            triangle_count > kMostTriangles) {
            throw core::InputError(
                core::ErrorKind::kOutOfMemory,
                fmt::format("the fields of the scene have more than {} bricks of samples or {} triangles; a "
                            "lower --resolution has fewer bricks",
                            kMostBricks, kMostTriangles));
        }
    }
    top_.resize(top_size);
    // Samples and entries are read in pairs: the last ones must have a neighbour.
    boxes_.resize(brick_count * kBrickBoxes);
    slabs_.resize(brick_count * kBrickSlabs);
    samples_.resize(brick_count * kBrickSize + 1);
    palette_entries_.resize(brick_count * kBrickSize + 1);
    gradients_.resize(brick_count * kBrickSize);
    palette_first_.resize(brick_count);
    palettes_.resize(palette_size);
    triangles_.resize(triangle_count);
    for (std::size_t i = 0; i < grids.size(); ++i) {
        if (!is_empty(i)) copy_grid(*grids[i], meshes[i], places_[i], palette_bases[i]);
    }
}

void FieldAtlas::copy_grid(const BrickGrid& grid, const core::Mesh& mesh, const Place& place,
                           std::size_t palette_base) {
    const SkipBoxes skip(grid);
    std::transform(skip.top.begin(), skip.top.end(), top_.begin() + place.top_base,
                   [&](std::int32_t entry) { return entry < 0 ? entry : entry + place.brick_base; });
    std::copy(skip.boxes.begin(), skip.boxes.end(),
              boxes_.begin() + static_cast<std::ptrdiff_t>(place.brick_base) * kBrickBoxes);
    std::copy(skip.slabs.begin(), skip.slabs.end(),
              slabs_.begin() + static_cast<std::ptrdiff_t>(place.brick_base) * kBrickSlabs);
    std::transform(
        grid.palettes().begin(), grid.palettes().end(),
        palettes_.begin() + static_cast<std::ptrdiff_t>(palette_base),
        [&](std::uint32_t triangle) { return static_cast<std::int32_t>(triangle) + place.triangle_base; });
    const glm::ivec3 count = grid.block_count();
    core::parallel_for(grid.top().size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (grid.top()[i] < 0) continue;
            const Brick& brick = grid.brick_at(grid.top()[i]);
            const auto number = static_cast<std::size_t>(place.brick_base + grid.top()[i]);
            const auto first = static_cast<std::ptrdiff_t>(number * kBrickSize);
            std::copy(brick.sample.begin(), brick.sample.end(), samples_.begin() + first);
            std::copy(brick.palette_entry.begin(), brick.palette_entry.end(),
                      palette_entries_.begin() + first);
            palette_first_[number] = static_cast<std::int32_t>(palette_base + brick.palette_first);
            const auto at = static_cast<int>(i);
            const glm::ivec3 block(at / (count.y * count.z), at / count.z % count.y, at % count.z);
            copy_gradients(grid, block, brick, gradients_.data() + first);
        }
    });
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
}

std::size_t FieldAtlas::bytes() const {
    return places_.capacity() * sizeof(Place) + top_.capacity() * sizeof(top_[0]) +
           (boxes_.capacity() + slabs_.capacity()) * sizeof(boxes_[0]) +
           samples_.capacity() * sizeof(samples_[0]) + gradients_.capacity() * sizeof(gradients_[0]) +
           palette_entries_.capacity() * sizeof(palette_entries_[0]) +
           (palette_first_.capacity() + palettes_.capacity()) * sizeof(palettes_[0]) +
           triangles_.capacity() * sizeof(triangles_[0]);
}

}  // namespace sdf
