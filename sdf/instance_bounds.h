// sdf/instance_bounds.h: boxes round the surface of a field, wherever an instance of it stands.
//
// The box of a turned box is larger than that of the surface within it: by the more, the more instances
// overlap, the more of them a ray would enter for nothing.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

#include "core/math/bounds.h"
#include "sdf/brick_grid.h"

namespace sdf {

/// Local boxes that hold all occupied cells of a field: those of its bricks, merged until there are few.
std::vector<core::DoubleBounds> surface_boxes(const BrickGrid& grid);

/// World box of local boxes. @pre not empty
core::DoubleBounds world_bounds(const std::vector<core::DoubleBounds>& boxes,
                                const glm::dmat4& world_from_local);

}  // namespace sdf
