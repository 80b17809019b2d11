// core/scene/scene_loader.h: the one door through which a scene comes in, whatever its format.
#pragma once

#include <filesystem>
#include <string>

#include "core/scene/load_options.h"
#include "core/scene/scene.h"

namespace core {

/// Whether the name ends, in any case, as the files that load_scene_file() reads.
bool is_scene_file(const std::filesystem::path& path);

/// Those endings, for messages and help: ".gltf, .glb, .obj, .ply or .stl".
std::string scene_file_endings();

/// Reads a scene with the reader that its ending names; the two forms of glTF, and text and binary of PLY and
/// STL, are told apart by content.
/// @throws InputError (kUsage) for other endings and for options that the format has no use for, (kBadData)
/// for contents that belong to another ending; what the readers throw
Scene load_scene_file(const std::filesystem::path& path, const LoadOptions& options = {});

}  // namespace core
