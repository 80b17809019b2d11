// sdf/border_edges.h: which edges of a mesh bound a sheet.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/mesh_to_sdf.h"

namespace sdf {

/// One byte a triangle: bit 0, 1, 2 where the edge opposite its first, second, third corner belongs to no
/// other triangle. Vertices at equal positions are one.
std::vector<std::uint8_t> find_border_edges(const MeshView& mesh);

}  // namespace sdf
