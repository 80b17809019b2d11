// sdf/field_table.h: the fields of all meshes of a scene in one piece of memory, as the kernels walk them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdf/brick_grid.h"
#include "sdf/field_kernel.h"

namespace sdf {

/// Top grids and samples of several grids, one after the other.
class FieldAtlas {
public:
    /// Where one grid lies.
    struct Place {
        std::int32_t top_base = 0;
        std::int32_t brick_base = 0;
        std::int32_t stride_x = 0, stride_y = 0;
        glm::vec3 cell_count{0.0f};
    };

    FieldAtlas() = default;

    /// Copies the grids in their order; null ones and those without a surface have an empty place.
    /// @throws core::InputError (kOutOfMemory) past kMostBricks
    explicit FieldAtlas(std::span<const std::shared_ptr<const BrickGrid>> grids);

    const Place& place(std::size_t grid) const { return places_[grid]; }
    FieldTable table() const { return {top_.data(), samples_.data()}; }
    std::size_t bytes() const;

    /// Kernels address samples by 32 bits: 2 GiB of them.
    static constexpr std::size_t kMostBricks = (std::size_t{1} << 21) - 1;

private:
    std::vector<Place> places_;
    std::vector<std::int32_t> top_;
    std::vector<std::int16_t> samples_;
};

}  // namespace sdf
