// core/scene/mesh_assembly.h: from primitives to the meshes of a scene.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/primitive_geometry.h"
#include "core/scene/scene.h"

namespace core {

/// Adds a primitive to a mesh as its next part. Attributes that only some parts have are filled up: texture
/// coordinates with 0, colours with 1. @pre the mesh stays under 2^32 vertices
void append_part(Mesh& mesh, PrimitiveGeometry part);

/// Completes a mesh after its last part: tangents that some parts lack, and the bounds.
void finish_mesh(Mesh& mesh);

/// Adds a finished mesh to the scene with one instance of the same name, where its vertices are.
/// @param materials one a part
void place_mesh(Scene& scene, Mesh mesh, std::vector<std::uint32_t> materials);

/// Albedo of surfaces whose file says nothing about them.
inline constexpr float kPlainAlbedo = 0.8f;

/// What surfaces are made of whose file names no material: Lambert, double-sided, and white where vertices
/// bring the colour.
Material plain_material(bool has_vertex_colors);

}  // namespace core
