// core/scene/gltf_nodes.h: the node hierarchy of one glTF scene: where meshes, lights and cameras stand.
#pragma once

#include <string>

#include "core/scene/gltf_document.h"
#include "core/scene/gltf_meshes.h"
#include "core/scene/scene.h"

namespace core {

/// Sets `scene.nodes` to all nodes of the file, walks the chosen glTF scene in document order and appends
/// instances, lights and cameras to `scene`.
/// @param selection name or number of the glTF scene; empty: the file's own choice, or scene 0. A file
/// without scenes has an empty one.
/// @throws InputError for node cycles, a node with two parents, singular or unbounded transforms.
void load_nodes(GltfDocument& document, const std::string& selection, GltfMeshes& meshes, Scene& scene);

}  // namespace core
