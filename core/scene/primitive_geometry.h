// core/scene/primitive_geometry.h: triangles with complete vertices, and how missing parts of them are made.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace core {

/// Triangles and their vertices. Arrays are as long as `positions` or empty.
struct PrimitiveGeometry {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;  ///< Unit; never empty once the geometry is complete.
    std::vector<glm::vec4> tangents;
    std::array<std::vector<glm::vec2>, 2> uvs;
    std::vector<glm::vec4> colors;
    std::vector<glm::uvec3> triangles;
};

bool is_finite(const glm::vec3& v);

/// Renumbers the triangles' vertices without gaps and returns the old number of each. Many exporters keep all
/// meshes' vertices in one array; copying all of it for each mesh would be quadratic.
std::vector<std::uint32_t> compact_vertices(std::vector<glm::uvec3>& triangles, std::size_t vertex_count);

/// Replaces the vertices: new vertex i is a copy of vertex source[i]. Leaves the triangles alone.
void gather_vertices(PrimitiveGeometry& geometry, const std::vector<std::uint32_t>& source);

/// Flat normals, as glTF demands where a file has none: no vertex is shared afterwards.
void make_flat_normals(PrimitiveGeometry& geometry);

/// Normalises the file's normals; those that have no direction take that of the faces around them. Returns
/// how many had none.
std::size_t mend_normals(PrimitiveGeometry& geometry);

/// Makes tangents that follow a set of texture coordinates, and splits the vertices where these are mirrored.
/// @pre normals are unit
void make_tangents(PrimitiveGeometry& geometry, std::size_t uv_set);

/// Normalises the file's tangents; broken ones become any perpendicular direction. @pre normals are unit
void mend_tangents(PrimitiveGeometry& geometry);

}  // namespace core
