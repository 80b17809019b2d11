// sdf/clean_mesh.h: what is left of a mesh once everything that a bake cannot use is gone.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "core/math/bounds.h"
#include "sdf/mesh_to_sdf.h"
#include "sdf/triangle_bvh.h"

namespace sdf {

/// Welded, non-degenerate, distinct triangles.
struct CleanMesh {
    std::vector<glm::dvec3> vertices;            ///< Distinct, local units.
    std::vector<glm::uvec3> triangles;           ///< Indices into `vertices`.
    std::vector<std::uint32_t> source_triangle;  ///< Of each triangle, ascending.
    core::DoubleBounds bounds;                   ///< Over the triangles.
    std::uint32_t out_of_range_count = 0;        ///< Dropped: an index beyond the positions.
    std::uint32_t not_finite_count = 0;          ///< Dropped: a NaN, infinite or absurd (> 1e30) coordinate.
    std::uint32_t zero_area_count = 0;           ///< Dropped: no area.
    std::uint32_t duplicate_count =
        0;  ///< Dropped: the same three vertices as an earlier face, however wound.

    std::uint32_t dropped_count() const {
        return out_of_range_count + not_finite_count + zero_area_count + duplicate_count;
    }
};

/// Drops and welds. Vertices weld where all three coordinates are equal.
CleanMesh clean_mesh(const MeshView& mesh);

/// One connected part of a clean mesh.
struct Component {
    std::vector<std::uint32_t> triangles;
    bool is_closed = false;  ///< Every edge is used equally often in both directions.
    bool is_sheet = false;
    /// Whether the winding makes the outside what lies behind the triangles.
    bool is_inverted = false;
};

/// Splits by shared vertices and classifies each part: closed ones are solid, others by their winding number
/// just off the surface on either side.
/// @param corners the triangles in voxel units.
std::vector<Component> classify_components(const CleanMesh& mesh, const std::vector<Triangle>& corners,
                                           ClassOverride override_class);

}  // namespace sdf
