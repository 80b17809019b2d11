// core/scene/gltf_materials.h: glTF materials, textures, samplers and images.
#pragma once

#include <vector>

#include "core/scene/gltf_document.h"
#include "core/scene/material.h"
#include "core/scene/texture.h"

namespace core {

/// All materials of the file, those of KHR_materials_pbrSpecularGlossiness converted, with only the textures
/// and images that some material uses.
struct GltfMaterials {
    std::vector<Material> materials;
    std::vector<Texture> textures;
    std::vector<TextureImage> images;
};

/// Reads them and decodes the images in parallel. What is not supported is warned about through `document`.
/// @throws InputError
GltfMaterials load_materials(GltfDocument& document);

}  // namespace core
