#include "core/scene/gltf_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "core/scene/mesh_assembly.h"

namespace core {

namespace {

constexpr const char* kModeNames[] = {"POINTS",    "LINES",          "LINE_LOOP",   "LINE_STRIP",
                                      "TRIANGLES", "TRIANGLE_STRIP", "TRIANGLE_FAN"};
constexpr std::uint64_t kFirstTriangleMode = 4;

}  // namespace

GltfMeshes::GltfMeshes(GltfDocument& document, const std::vector<Material>& materials)
    : document_(document), materials_(materials) {}

const GltfMeshes::GltfMesh& GltfMeshes::parsed(std::size_t gltf_mesh) {
    const auto [entry, is_new] = parsed_.try_emplace(gltf_mesh);
    GltfMesh& result = entry->second;
    if (!is_new) return result;
    const JsonElement mesh = document_.element("meshes", gltf_mesh);
    result.name = mesh.text_or("name", "");
    if (result.name.empty()) result.name = fmt::format("mesh_{}", gltf_mesh);
    if (const auto weights = mesh.find("weights")) result.weights = weights->numbers(weights->size());
    const JsonElement primitives = mesh.require("primitives");
    for (std::size_t i = 0; i < primitives.size(); ++i) {
        const JsonElement primitive = primitives.at(i);
        PrimitiveSource source = read_primitive_source(document_, primitive);
        if (source.mode >= std::size(kModeNames)) {
            primitive.fail(fmt::format("mode is {}; it must be from 0 to 6", source.mode));
        }
        if (source.mode < kFirstTriangleMode) {
            document_.warn_once(
                fmt::format("mesh '{}' primitive {} has mode {} and is skipped; only triangles "
                            "are drawn",
                            result.name, i, kModeNames[source.mode]));
            continue;
        }
        if (source.position == kNoAccessor) {
            document_.warn_once(
                fmt::format("mesh '{}' primitive {} has no POSITION and is skipped", result.name, i));
            continue;
        }
        if (!source.targets.empty()) {
            document_.warn_once("morph targets stand still: meshes keep the weights they have at rest");
        }
        auto material = static_cast<std::uint32_t>(materials_.size());
        if (const auto index = primitive.find("material")) {
            material = static_cast<std::uint32_t>(index->index(materials_.size(), "materials"));
        } else {
            uses_default_material_ = true;
        }
        result.primitives.push_back({std::move(source), primitive, material});
    }
    warn_of_missing_uvs(result);
    return result;
}

void GltfMeshes::warn_of_missing_uvs(const GltfMesh& mesh) const {
    for (const Primitive& primitive : mesh.primitives) {
        if (primitive.material >= materials_.size()) continue;
        const Material& material = materials_[primitive.material];
        for (const TextureUse* use :
             {&material.base_color_texture, &material.metallic_roughness_texture, &material.normal_texture,
              &material.emission_texture, &material.specular_texture, &material.specular_color_texture}) {
            if (!use->present()) continue;
            if (primitive.source.uvs[static_cast<std::size_t>(use->uv_set)] != kNoAccessor) continue;
            document_.warn_once(
                fmt::format("{}: material '{}' needs TEXCOORD_{}, which is missing; textures "
                            "show their corner alone",
                            primitive.element.path(), material.name, use->uv_set));
        }
    }
}

const GltfMeshes::Placement& GltfMeshes::place(std::size_t gltf_mesh,
                                               const std::vector<double>* node_weights) {
    const GltfMesh& mesh = parsed(gltf_mesh);
    Key key;
    key.weights = node_weights ? *node_weights : mesh.weights;
    // Weights of 0 leave the geometry as it is.
    while (!key.weights.empty() && key.weights.back() == 0.0) key.weights.pop_back();
    // A mesh of many primitives at many nodes is gone through once.
    const auto [known, is_first] = placements_.try_emplace({gltf_mesh, key.weights});
    Placement& placement = known->second;
    if (!is_first) return placement;
    for (const Primitive& primitive : mesh.primitives) {
        key.sources.push_back(primitive.source);
        placement.materials.push_back(primitive.material);
    }
    const auto [entry, is_new] =
        mesh_of_key_.try_emplace(std::move(key), static_cast<std::uint32_t>(geometries_.size()));
    if (is_new) {
        geometries_.push_back({&mesh, entry->first.weights, std::vector<int>(mesh.primitives.size(), -1)});
    }
    placement.mesh = entry->second;
    Geometry& geometry = geometries_[placement.mesh];
    for (std::size_t part = 0; part < placement.materials.size(); ++part) {
        const std::uint32_t material = placement.materials[part];
        if (material >= materials_.size() || !materials_[material].normal_texture.present()) continue;
        if (geometry.tangent_uv_sets[part] < 0) {
            geometry.tangent_uv_sets[part] = materials_[material].normal_texture.uv_set;
        }
    }
    return placement;
}

std::vector<Mesh> GltfMeshes::build() {
    std::vector<Mesh> meshes;
    meshes.reserve(geometries_.size());
    for (const Geometry& geometry : geometries_) meshes.push_back(build_one(geometry));
    return meshes;
}

Mesh GltfMeshes::build_one(const Geometry& geometry) {
    Mesh mesh;
    mesh.name = geometry.mesh->name;
    for (std::size_t i = 0; i < geometry.mesh->primitives.size(); ++i) {
        const Primitive& primitive = geometry.mesh->primitives[i];
        PrimitiveGeometry part = decode_primitive(document_, primitive.element, primitive.source,
                                                  geometry.weights, geometry.tangent_uv_sets[i]);
        if (mesh.positions.size() + part.positions.size() > std::numeric_limits<std::uint32_t>::max()) {
            primitive.element.fail(
                "brings the mesh to more than 2^32 vertices; split it into several meshes");
        }
        append_part(mesh, std::move(part));
    }
    finish_mesh(mesh);
    return mesh;
}

}  // namespace core
