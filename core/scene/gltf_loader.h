// core/scene/gltf_loader.h: glTF 2.0 files to core::Scene.
//
// Khronos Group, "glTF 2.0 Specification", 2021, as far as it touches a picture, with the extensions that
// gltf_extensions.cpp lists.
#pragma once

#include <filesystem>

#include "core/scene/load_options.h"
#include "core/scene/scene.h"

namespace core {

/// Reads a .gltf or .glb. Points and lines are skipped, skins ignored and morph targets left at rest, each
/// with a warning. Animations are read, but the scene stands as at rest.
/// Meshes whose primitives use the same accessors become one Mesh with many instances.
/// @throws InputError naming file and element for anything that is missing, out of range, malformed or needs
/// an unknown required extension.
Scene load_gltf(const std::filesystem::path& path, const LoadOptions& options = {});

}  // namespace core
