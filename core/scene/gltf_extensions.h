// core/scene/gltf_extensions.h: which glTF extensions are read, which are known and left out, which refused.
#pragma once

#include <string>
#include <vector>

#include "core/scene/gltf_json.h"

namespace core {

/// Checks `extensionsRequired` and `extensionsUsed` of a file and returns one warning for each extension that
/// is not read, with what the picture loses.
/// @param root of the document.
/// @throws InputError naming a required extension without which the file cannot be read.
std::vector<std::string> check_extensions(const JsonElement& root);

/// Whether `extensionsUsed` or `extensionsRequired` lists it.
bool lists_extension(const JsonElement& root, const char* name);

}  // namespace core
