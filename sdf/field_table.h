// sdf/field_table.h: the fields of all meshes of a scene in one piece of memory, as the kernels walk them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/scene/scene.h"
#include "sdf/brick_grid.h"
#include "sdf/field_kernel.h"
#include "sdf/skip_boxes.h"
#include "sdf/surface_kernel.h"

namespace sdf {

/// Cells of a field that hold a zero crossing.
std::size_t occupied_count(const BrickGrid& grid);

/// Top grids, samples and triangles of several grids, one after the other.
class FieldAtlas {
public:
    /// Where one grid lies.
    struct Place {
        std::int32_t top_base = 0;
        std::int32_t brick_base = 0;
        std::int32_t cell_base = 0;
        std::int32_t triangle_base = 0;
        std::int32_t octant_stride = 0, stride_x = 0, stride_y = 0;  ///< Of top entries.
        glm::vec3 cell_count{0.0f};
    };

    FieldAtlas() = default;

    /// Copies the grids in their order; null ones and those without a surface have an empty place.
    /// @param meshes that the grids were made from, by the same index
    /// @pre all grids have the same sample_bits()
    /// @throws core::InputError (kOutOfMemory) past kMostBricks
    FieldAtlas(std::span<const std::shared_ptr<const BrickGrid>> grids, std::span<const core::Mesh> meshes);

    const Place& place(std::size_t grid) const { return places_[grid]; }
    FieldTable table() const {
        return {top_.data(), boxes_.data(), bricks_.data(), cells_.data(), samples_.data(), bits_};
    }
    SurfaceTable surface_table() const { return {cells_.data(), triangles_.data()}; }
    std::size_t bytes() const;

    /// Kernels address samples by 32 bits: 2 GiB of them.
    static constexpr std::size_t kMostBricks = std::size_t{1} << kBrickBits;

private:
    void copy_grid(const BrickGrid& grid, const core::Mesh& mesh, const Place& place);

    std::vector<Place> places_;
    std::vector<std::int32_t> top_;
    std::vector<std::uint32_t> boxes_;
    std::vector<std::int16_t> samples_;
    SampleBits bits_ = SampleBits::k16;
    std::vector<BrickCells> bricks_;
    std::vector<CellSurface> cells_;
    std::vector<VoxelTriangle> triangles_;
};

}  // namespace sdf
