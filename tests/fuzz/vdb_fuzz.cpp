// A .vdb file as `inspect` reads any, and as a bake that is used again.
#include <cstddef>
#include <cstdint>

#include "sdf/brick_grid.h"
#include "sdf/distance.h"
#include "sdf/vdb_file.h"
#include "tests/fuzz/fuzz_input.h"

namespace {

/// Lays a field out and looks it up along the diagonal of its box.
void exercise_field(const sdf::SampledField& field) {
    const sdf::BrickGrid grid(field);
    grid.local_bounds();
    const core::DoubleBounds& box = grid.traced_voxels();
    if (box.empty()) return;
    constexpr int kSteps = 64;
    for (int i = -1; i <= kSteps; ++i) {
        const glm::dvec3 point =
            box.minimum + (box.maximum - box.minimum) * (static_cast<double>(i) / kSteps);
        sdf::distance_at(grid, point);
        const glm::ivec3 cell(glm::floor(point));
        if (grid.brick_or_null(cell)) sdf::smooth_gradient(grid, cell, point - glm::dvec3(cell));
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto path = fuzz::input_file("input.vdb", {data, size});
    fuzz::read_or_refuse([&] { sdf::summarise_vdb(path); });
    fuzz::read_or_refuse([&] { sdf::read_bake_key(path); });
    fuzz::read_or_refuse([&] { exercise_field(sdf::read_field(path)); });
    return 0;
}
