#include "core/scene/gltf_loader.h"

#include <utility>

#include "core/scene/gltf_animations.h"
#include "core/scene/gltf_document.h"
#include "core/scene/gltf_materials.h"
#include "core/scene/gltf_meshes.h"
#include "core/scene/gltf_nodes.h"

namespace core {

Scene load_gltf(const std::filesystem::path& path, const LoadOptions& options) {
    GltfDocument document(path, options.allow_external);
    Scene scene;
    scene.name = document.file_name();
    if (const auto used = document.root().find("extensionsUsed")) {
        for (std::size_t i = 0; i < used->size(); ++i) scene.extensions_used.push_back(used->at(i).text());
    }

    GltfMaterials materials = load_materials(document);
    scene.textures = std::move(materials.textures);
    scene.images = std::move(materials.images);

    GltfMeshes meshes(document, materials.materials);
    load_nodes(document, options.scene, meshes, scene);
    scene.meshes = meshes.build();
    scene.animations = load_animations(document, scene.nodes);

    scene.materials = std::move(materials.materials);
    if (meshes.uses_default_material()) scene.materials.emplace_back().name = "default";
    scene.warnings = document.warnings();
    return scene;
}

}  // namespace core
