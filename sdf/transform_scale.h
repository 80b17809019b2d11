// sdf/transform_scale.h: how much a linear map stretches.
#pragma once

#include <glm/glm.hpp>

namespace sdf {

/// Largest singular value of a 3x3 matrix, to about 1e-12 of itself.
double largest_singular_value(const glm::dmat3& matrix);

}  // namespace sdf
