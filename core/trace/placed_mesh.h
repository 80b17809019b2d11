// core/trace/placed_mesh.h: meshes as a float kernel traces them, and how its answers become exact hits.
//
// Kernels get vertices in floats, in a space where products of four coordinates stay in range; normals and
// error bounds come from here, computed from the mesh's own vertices in double.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "core/scene/scene.h"
#include "core/trace/ray_stream.h"

namespace core {

/// The triangles of a mesh in the space a kernel traces them in.
struct TriangleSoup {
    std::vector<glm::vec3> vertices;    ///< Two more than the mesh has: room for 16-byte loads of the last.
    std::vector<glm::uvec3> triangles;  ///< As in the mesh, but without area (i, i, i), which nothing hits.
    std::vector<glm::vec3> normals;     ///< Unit, one a triangle, towards the front; 0 without area.

    std::size_t bytes() const;
};

/// A mesh placed in the world, for one instance. The matrices carry one common factor, which cancels.
struct PlacedMesh {
    glm::mat3 normal_from_local{1.0f};     ///< From the soup's normals.
    glm::mat3 magnitude_from_world{1.0f};  ///< |linear part| of the soup's space from the world.
    glm::vec3 local_magnitude{0.0f};       ///< |its translation| + the soup's largest |coordinate|.
    const glm::vec3* normals = nullptr;    ///< Of the soup.
    float start_offset = 0.0f;             ///< As core::Tracer::start_offset.
};

/// Whether the instance's vertices keep their shape when rounded to floats in world space.
bool survives_flattening(const Mesh& mesh, const Instance& instance);

/// The instance's triangles in world space. Vertex order, hence barycentrics, is the mesh's.
TriangleSoup flattened_soup(const Mesh& mesh, const Instance& instance);
PlacedMesh place_flattened(const TriangleSoup& soup, const Mesh& mesh, const Instance& instance);

/// The mesh's triangles in local space times a power of two, 1 unless its coordinates are extreme.
struct SharedSoup {
    TriangleSoup triangles;
    double factor = 1.0;
};
SharedSoup shared_soup(const Mesh& mesh);
glm::dmat4 world_from_soup(const SharedSoup& soup, const Instance& instance);
/// Lengths that unit vectors along the axes grow to at most, from either space to the other.
struct Stretch {
    double world_from_soup = 1.0;
    double soup_from_world = 1.0;
};
Stretch stretch_of(const SharedSoup& soup, const Instance& instance);
PlacedMesh place_shared(const SharedSoup& soup, const Mesh& mesh, const Instance& instance);

/// Fills what follows from hits.t[i] and hits.triangle[i]: normal, side and offset.
void finish_hit(const PlacedMesh& placed, const RayStream& rays, std::size_t i, HitStream& hits);

}  // namespace core
