// tests/support/analytic_scenes.h: shapes whose hits are known by formula, and small scenes made of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <random>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/trace/ray_stream.h"

namespace tests {

// --- Meshes. All closed ones wind outwards (counter-clockwise seen from outside), in one part.

/// Fills parts, part_of_triangle and bounds. Empty `uvs` leave TEXCOORD_0 absent.
core::Mesh make_mesh(std::string name, std::vector<glm::vec3> positions, std::vector<glm::vec3> normals,
                     std::vector<glm::vec2> uvs, std::vector<glm::uvec3> triangles);

/// A subdivided icosahedron: 20 x 4^level triangles, vertices on the sphere about the origin, smooth normals,
/// uv = (1 + n.xy) / 2.
core::Mesh icosphere(int level, float radius = 1.0f);

/// The least distance from the centre to the faces of icosphere(level, radius): the polyhedron lies between
/// it and `radius`.
double icosphere_inner_radius(int level, double radius = 1.0);

/// An axis-aligned box about the origin: 24 vertices, flat normals, every face with uv over [0, 1]^2.
core::Mesh box(const glm::vec3& half_extent = glm::vec3(0.5f));

/// A rectangle in the plane z = 0 about the origin that faces +Z; uv over [0, 1]^2, u along +X, v along +Y;
/// columns x rows cells of two triangles.
core::Mesh quad(float width = 1.0f, float height = 1.0f, int columns = 1, int rows = 1);

/// A closed cylinder about the Y axis, centred at the origin, with flat caps.
core::Mesh cylinder(float radius, float height, int segments = 64);

/// A torus about the Y axis.
core::Mesh torus(float major_radius, float minor_radius, int major_segments = 64, int minor_segments = 32);

/// The same surface seen from the other side: winding and normals reversed. A reversed box is a room.
core::Mesh reversed(core::Mesh mesh);

/// Both in one mesh, `second` in parts of its own after those of `first`.
core::Mesh merged(core::Mesh first, const core::Mesh& second);

/// Positions and normals moved by `matrix`; a mirroring one also reverses the winding, so that outside stays
/// outside.
core::Mesh moved(core::Mesh mesh, const glm::dmat4& matrix);

// --- Scenes.

/// A Lambert material as the conventions define it: metallic 0, specularFactor 0.
core::Material lambert(const glm::vec3& albedo);

/// Appends and returns the index.
std::uint32_t add_mesh(core::Scene& scene, core::Mesh mesh);
std::uint32_t add_material(core::Scene& scene, core::Material material);

/// Places a mesh, all parts with one material; returns the instance's index.
std::uint32_t add_instance(core::Scene& scene, std::uint32_t mesh,
                           const glm::dmat4& world_from_local = glm::dmat4(1.0), std::uint32_t material = 0);

/// Appends an image of texels[y][x] with a nearest-texel, clamping sampler; returns the texture's index.
int add_texture(core::Scene& scene, int width, int height, const std::vector<glm::u8vec4>& texels);

/// One instance of one mesh with lambert(0.5).
core::Scene scene_of(core::Mesh mesh, const glm::dmat4& world_from_local = glm::dmat4(1.0));

/// Shorthands for matrices.
glm::dmat4 translation(const glm::dvec3& offset);
glm::dmat4 scaling(const glm::dvec3& factors);
glm::dmat4 rotation(double angle, const glm::dvec3& axis);

// --- Rays.

/// Random numbers that are the same everywhere (the standard's distributions are not).
class TestRandom {
public:
    explicit TestRandom(std::uint32_t seed) : engine_(seed) {}

    /// Uniform in [0, 1).
    double uniform() { return engine_() * 0x1p-32; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    std::uint32_t bits() { return static_cast<std::uint32_t>(engine_()); }
    /// Uniform over the unit sphere.
    glm::dvec3 direction();
    /// Cosine-weighted about `normal`.
    glm::dvec3 cosine_direction(const glm::dvec3& normal);

private:
    std::mt19937 engine_;
};

/// A ray with the direction normalised in double.
core::Ray make_ray(const glm::dvec3& origin, const glm::dvec3& direction,
                   float t_max = std::numeric_limits<float>::infinity(), std::uint32_t seed = 0);

core::RayStream stream_of(const std::vector<core::Ray>& rays);

/// Isotropic uniform random lines through a sphere, each starting on the plane that touches the sphere: their
/// density does not depend on place or direction.
core::RayStream random_lines(const glm::dvec3& center, double radius, std::size_t count, std::uint32_t seed);

}  // namespace tests
