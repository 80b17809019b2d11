// core/scene/gltf_meshes.h: glTF meshes to core::Mesh, one for each distinct list of accessors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/gltf_document.h"
#include "core/scene/gltf_primitive.h"
#include "core/scene/scene.h"

namespace core {

/// Collects the meshes that nodes place, then decodes each geometry once. Materials belong to the instances,
/// so glTF meshes that differ in nothing else share one core::Mesh.
class GltfMeshes {
public:
    /// @param materials of the file; the index one past them stands for glTF's default material.
    GltfMeshes(GltfDocument& document, const std::vector<Material>& materials);

    struct Placement {
        std::uint32_t mesh = 0;                ///< Index into what build() returns.
        std::vector<std::uint32_t> materials;  ///< One a part.
    };
    /// Notes that a node shows a glTF mesh. @param node_weights of the morph targets, where the node has
    /// some; they replace the mesh's.
    const Placement& place(std::size_t gltf_mesh, const std::vector<double>* node_weights);

    bool uses_default_material() const { return uses_default_material_; }

    /// Decodes all that was placed. @throws InputError
    std::vector<Mesh> build();

private:
    struct Primitive {
        PrimitiveSource source;
        JsonElement element;
        std::uint32_t material;
    };
    struct GltfMesh {
        std::string name;
        std::vector<Primitive> primitives;  ///< Those that draw triangles.
        std::vector<double> weights;
    };
    struct Geometry {
        const GltfMesh* mesh;  ///< The first that uses it.
        std::vector<double> weights;
        std::vector<int> tangent_uv_sets;  ///< One a part; negative: no material needs tangents.
    };
    struct Key {
        std::vector<PrimitiveSource> sources;
        std::vector<double> weights;
        auto operator<=>(const Key&) const = default;
    };

    const GltfMesh& parsed(std::size_t gltf_mesh);
    void warn_of_missing_uvs(const GltfMesh& mesh) const;
    Mesh build_one(const Geometry& geometry);

    GltfDocument& document_;
    const std::vector<Material>& materials_;
    std::map<std::size_t, GltfMesh> parsed_;
    std::map<std::pair<std::size_t, std::vector<double>>, Placement> placements_;  ///< By mesh and weights.
    std::map<Key, std::uint32_t> mesh_of_key_;
    std::vector<Geometry> geometries_;
    bool uses_default_material_ = false;
};

}  // namespace core
