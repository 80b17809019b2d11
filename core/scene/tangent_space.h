// core/scene/tangent_space.h: tangents for normal maps where a file brings none.
//
// After M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008, section 2.4.2: each face's tangent
// is projected into the plane of the vertex normal and averaged, weighted by the face's angle at the vertex,
// over the faces that share position, normal, texture coordinates and handedness there. Where we differ:
// faces that share all of these are averaged even if no edge joins them.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace core {

/// One tangent for each corner of each triangle: xyz unit and perpendicular to the normal, w the handedness
/// of glTF: bitangent = cross(normal, tangent) * w points towards decreasing v, up in the picture.
/// Corners of one vertex differ only where mirrored texture coordinates meet.
/// @pre positions, normals and uvs are equally long and finite, normals unit, indices in range.
std::vector<glm::vec4> corner_tangents(std::span<const glm::vec3> positions,
                                       std::span<const glm::vec3> normals, std::span<const glm::vec2> uvs,
                                       std::span<const glm::uvec3> triangles);

/// Some unit vector perpendicular to a unit `normal`, with handedness 1.
glm::vec4 any_tangent(const glm::vec3& normal);

}  // namespace core
