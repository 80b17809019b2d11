// tests/support/exact_signs.h: signs of a baked field against the winding number summed over every triangle.
#pragma once

#include <cstddef>

#include "core/scene/scene.h"
#include "sdf/sampled_field.h"

namespace tests {

/// What a field's samples say of inside and outside, and what the exact winding number says.
struct SignAgreement {
    std::size_t samples = 0;  ///< Looked at: farther than 0.01 voxel from the surface.
    std::size_t inside = 0;   ///< Of these, by the winding number.
    std::size_t wrong = 0;    ///< On another side than it says.
};

/// Whether the field has a solid and every solid part of the mesh is watertight: each edge is used as often
/// in one direction as in the other.
bool has_only_closed_solids(const core::Mesh& mesh, const sdf::SampledField& field);

/// Looks at about `most` of the field's samples, all over the band. The winding number is the plain sum over
/// all triangles of solid parts, without a tree or an expansion. A negative sample of a sheet's or a thin
/// wall's shell has no side and is left out; a positive one must be outside as any other.
SignAgreement sign_agreement(const core::Mesh& mesh, const sdf::SampledField& field, std::size_t most);

}  // namespace tests
