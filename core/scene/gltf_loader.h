// core/scene/gltf_loader.h: glTF 2.0 files to core::Scene.
//
// Khronos Group, "glTF 2.0 Specification", 2021, as far as it touches a picture, with KHR_lights_punctual,
// KHR_materials_{emissive_strength, unlit, ior, specular}, KHR_texture_transform and EXT_mesh_gpu_instancing.
#pragma once

#include <filesystem>

#include "core/scene/load_options.h"
#include "core/scene/scene.h"

namespace core {

/// Reads a .gltf or .glb. Points and lines are skipped with a warning; skins are ignored with a warning.
/// Meshes whose primitives use the same accessors become one Mesh with many instances.
/// @throws InputError naming file and element for anything that is missing, out of range, malformed or needs
/// an unknown required extension.
Scene load_gltf(const std::filesystem::path& path, const LoadOptions& options = {});

}  // namespace core
