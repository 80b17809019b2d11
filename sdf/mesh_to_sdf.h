// sdf/mesh_to_sdf.h: bakes one triangle mesh into a signed distance field.
//
// Sanitise, classify every connected component as solid or sheet, exact distances in a narrow band, signs by
// the generalised winding number (Barill et al., "Fast Winding Numbers for Soups and Clouds", TOG 2018).
// Sheets, and walls of solids too thin for the lattice, are given a half-thickness, so that no ray slips
// between samples.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "sdf/sampled_field.h"

namespace sdf {

enum class ClassOverride : std::uint8_t { kAuto, kSolid, kSheet };

/// How one mesh is baked.
struct MeshBakeOptions {
    double voxel_size = 0.0;  ///< h in local units, > 0.
    ClassOverride surface_class = ClassOverride::kAuto;
    int most_resolution = kMostVoxelsAlongSide;  ///< Warnings recommend none above it.
};

/// A mesh to bake. Indices out of range are dropped and counted like any other unusable face.
struct MeshView {
    std::span<const glm::vec3> positions;
    std::span<const glm::uvec3> triangles;
};

/// Extent of the box round the usable triangles, in local units; (0, 0, 0) if there are none.
glm::dvec3 usable_extent(const MeshView& mesh);

/// Bakes `mesh`. The same samples come out at any thread count. Leaves `source_hash` and `settings_hash`
/// empty: they are the caller's.
/// @throws core::InputError kBadData if no usable triangle is left or the lattice would be absurdly large,
/// kOutOfMemory if the samples cannot fit; the message does not name the mesh.
SampledField bake_mesh(const MeshView& mesh, const MeshBakeOptions& options);

}  // namespace sdf
