// core/scene/gltf_animations.h: glTF animations to core::Animation.
#pragma once

#include <vector>

#include "core/scene/animation.h"
#include "core/scene/gltf_document.h"

namespace core {

/// Reads all animations of the file. Channels without a target node, or with a target that an extension
/// defines, are left out. An animation is left out with a warning that says why where times do not ascend,
/// values are not finite or do not match the times in number, a node cannot be animated, or one target has
/// two channels.
/// @param nodes of the file.
/// @throws InputError (kOutOfMemory) for more keys than a file of its size may hold.
std::vector<Animation> load_animations(GltfDocument& document, const std::vector<Node>& nodes);

}  // namespace core
