// core/scene/scene.h: everything a picture depends on, as plain data.
//
// Built by core/scene/scene_loader; read-only afterwards. World unit = glTF unit, +Y up. Matrices read
// out-from-in.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/math/bounds.h"
#include "core/scene/animation.h"
#include "core/scene/camera.h"
#include "core/scene/light.h"
#include "core/scene/material.h"
#include "core/scene/node.h"
#include "core/scene/sky.h"
#include "core/scene/texture.h"

namespace core {

/// A contiguous range of a mesh's triangles that share one material slot: one glTF primitive.
struct MeshPart {
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;
};

/// Triangles in local space. Per-vertex arrays are as long as `positions` or empty.
struct Mesh {
    std::string name;
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;   ///< Unit. Never empty: made per specification where missing.
    std::vector<glm::vec4> tangents;  ///< xyz unit, w = handedness. Empty where no material needs them.
    std::array<std::vector<glm::vec2>, 2> uvs;
    std::vector<glm::vec4> colors;                ///< COLOR_0, linear.
    std::vector<glm::uvec3> triangles;            ///< Indices into positions, all in range.
    std::vector<MeshPart> parts;                  ///< In order; they cover all triangles.
    std::vector<std::uint32_t> part_of_triangle;  ///< As long as `triangles`.
    Bounds bounds;                                ///< Local, over the triangles' vertices.
};

/// One placed mesh. Its transform is finite and invertible (the loader refuses others by name).
struct Instance {
    std::string name;  ///< Of the node.
    std::uint32_t mesh = 0;
    std::vector<std::uint32_t> materials;  ///< One a part of the mesh.
    glm::dmat4 world_from_local{1.0};
    glm::dmat4 local_from_world{1.0};
    glm::mat3 normal_from_local{
        1.0f};                     ///< Inverse transpose of the linear part: front stays front in mirrors.
    std::uint32_t node = kNoNode;  ///< Index into Scene::nodes.
    glm::dmat4 node_from_local{
        1.0};  ///< Of EXT_mesh_gpu_instancing; world_from_local is the node's times it.
};

/// Fills the derived matrices. @throws InputError (kBadData, naming the instance) if the matrix is singular
/// or not finite.
Instance make_instance(std::string name, std::uint32_t mesh, std::vector<std::uint32_t> materials,
                       const glm::dmat4& world_from_local);

struct Scene {
    std::string name;  ///< The file's name, for messages.
    std::vector<Mesh> meshes;
    std::vector<Instance> instances;
    std::vector<Material> materials;
    std::vector<Texture> textures;
    std::vector<TextureImage> images;
    std::vector<Light> lights;
    std::vector<Camera> cameras;
    Sky sky;
    std::string sky_description = "none";  ///< As in `--sky`, for reports.
    std::vector<std::string> extensions_used;
    std::vector<Node> nodes;            ///< All of the file, in its order, whatever hangs on them.
    std::vector<Animation> animations;  ///< All of the file; pictures show the rest pose.
    std::vector<std::string> warnings;

    const Material& material_of(std::uint32_t instance, std::uint32_t triangle) const {
        const Instance& placed = instances[instance];
        return materials[placed.materials[meshes[placed.mesh].part_of_triangle[triangle]]];
    }
};

/// World box over all instances.
DoubleBounds world_bounds(const Scene& scene);

/// Triangles drawn, instances counted.
std::uint64_t drawn_triangle_count(const Scene& scene);

/// Whether any surface is meant as a light: emits, and not merely by being unlit.
bool has_emissive_surface(const Scene& scene);

/// 128-bit hash, in hex, of everything that decides a picture (geometry, materials, textures, lights, sky),
/// but not of names, paths or cameras.
std::string scene_hash(const Scene& scene);

/// Interpolated uv and vertex colour of a point of a triangle.
/// @param barycentrics weights of the second and third vertex.
SurfaceCoordinates surface_coordinates(const Mesh& mesh, std::uint32_t triangle,
                                       const glm::vec2& barycentrics);

}  // namespace core
