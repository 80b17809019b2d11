#include "core/scene/mesh_assembly.h"

#include <utility>

#include "core/scene/tangent_space.h"

namespace core {

namespace {

/// Appends an optional attribute, filling up where only some parts of the mesh have it.
template <typename Value>
void append(std::vector<Value>& all, const std::vector<Value>& added, std::size_t vertices_before,
            std::size_t vertices_added, const Value& filler) {
    if (all.empty() && added.empty()) return;
    all.resize(vertices_before, filler);
    all.insert(all.end(), added.begin(), added.end());
    all.resize(vertices_before + vertices_added, filler);
}

/// Parts whose materials need no tangents still get valid ones, so that the array can be read blindly.
void fill_missing_tangents(Mesh& mesh) {
    for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
        if (mesh.tangents[i].w == 0.0f) mesh.tangents[i] = any_tangent(mesh.normals[i]);
    }
}

}  // namespace

void append_part(Mesh& mesh, PrimitiveGeometry part) {
    const std::size_t before = mesh.positions.size();
    const std::size_t added = part.positions.size();
    const auto part_index = static_cast<std::uint32_t>(mesh.parts.size());
    mesh.parts.push_back({static_cast<std::uint32_t>(mesh.triangles.size()),
                          static_cast<std::uint32_t>(part.triangles.size())});
    if (before == 0) {
        // Most meshes have one part, and need not be copied.
        mesh.positions = std::move(part.positions);
        mesh.normals = std::move(part.normals);
        mesh.tangents = std::move(part.tangents);
        mesh.uvs = std::move(part.uvs);
        mesh.colors = std::move(part.colors);
        mesh.triangles = std::move(part.triangles);
        mesh.part_of_triangle.assign(mesh.triangles.size(), part_index);
        return;
    }
    mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
    mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
    append(mesh.tangents, part.tangents, before, added, glm::vec4(0.0f));
    for (std::size_t set = 0; set < mesh.uvs.size(); ++set) {
        append(mesh.uvs[set], part.uvs[set], before, added, glm::vec2(0.0f));
    }
    append(mesh.colors, part.colors, before, added, glm::vec4(1.0f));
    for (const glm::uvec3& triangle : part.triangles) {
        mesh.triangles.push_back(triangle + static_cast<std::uint32_t>(before));
    }
    mesh.part_of_triangle.resize(mesh.triangles.size(), part_index);
}

void finish_mesh(Mesh& mesh) {
    fill_missing_tangents(mesh);
    for (const glm::uvec3& triangle : mesh.triangles) {
        for (int corner = 0; corner < 3; ++corner) mesh.bounds.include(mesh.positions[triangle[corner]]);
    }
}

void place_mesh(Scene& scene, Mesh mesh, std::vector<std::uint32_t> materials) {
    const auto index = static_cast<std::uint32_t>(scene.meshes.size());
    scene.instances.push_back(make_instance(mesh.name, index, std::move(materials), glm::dmat4(1.0)));
    scene.meshes.push_back(std::move(mesh));
}

Material plain_material(bool has_vertex_colors) {
    Material material;
    material.name = "default";
    if (!has_vertex_colors) {
        material.base_color = glm::vec4(kPlainAlbedo, kPlainAlbedo, kPlainAlbedo, 1.0f);
    }
    material.metallic = 0.0f;
    material.specular = 0.0f;
    material.double_sided = true;
    return material;
}

}  // namespace core
