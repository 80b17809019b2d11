#include "sdf/field_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/support/error.h"
#include "core/support/parallel.h"

namespace sdf {

FieldAtlas::FieldAtlas(std::span<const std::shared_ptr<const BrickGrid>> grids) : places_(grids.size()) {
    std::size_t top_size = 0, brick_count = 0;
    for (std::size_t i = 0; i < grids.size(); ++i) {
        if (!grids[i] || grids[i]->traced_voxels().empty()) continue;
        const BrickGrid& grid = *grids[i];
        Place& place = places_[i];
        place.top_base = static_cast<std::int32_t>(top_size);
        place.brick_base = static_cast<std::int32_t>(brick_count);
        place.stride_x = grid.block_count().y * grid.block_count().z;
        place.stride_y = grid.block_count().z;
        place.cell_count = glm::vec3(grid.traced_voxels().maximum);
        top_size += grid.top().size();
        brick_count += grid.brick_count();
        if (brick_count > kMostBricks || top_size > (std::size_t{1} << 30)) {
            throw core::InputError(
                core::ErrorKind::kOutOfMemory,
                fmt::format("the fields of the scene have more than {} bricks of samples; a lower "
                            "--resolution has fewer",
                            kMostBricks));
        }
    }
    top_.resize(top_size);
    // Samples are read in pairs: the last one must have a neighbour.
    samples_.resize(brick_count * kBrickSize + 1);
    core::parallel_for(grids.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!grids[i] || grids[i]->traced_voxels().empty()) continue;
            const BrickGrid& grid = *grids[i];
            const Place& place = places_[i];
            std::transform(grid.top().begin(), grid.top().end(), top_.begin() + place.top_base,
                           [&](std::int32_t entry) { return entry >= 0 ? entry + place.brick_base : entry; });
            for (std::size_t brick = 0; brick < grid.brick_count(); ++brick) {
                const auto& sample = grid.brick_at(static_cast<std::int32_t>(brick)).sample;
                std::copy(sample.begin(), sample.end(),
                          samples_.begin() +
                              static_cast<std::ptrdiff_t>(
                                  (static_cast<std::size_t>(place.brick_base) + brick) * kBrickSize));
            }
        }
    });
}

std::size_t FieldAtlas::bytes() const {
    return places_.capacity() * sizeof(Place) + top_.capacity() * sizeof(top_[0]) +
           samples_.capacity() * sizeof(samples_[0]);
}

}  // namespace sdf
