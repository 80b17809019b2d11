// core/scene/gltf_animations.h: glTF animations to core::Animation.
#pragma once

#include <vector>

#include "core/scene/animation.h"
#include "core/scene/gltf_document.h"

namespace core {

/// Reads all animations of the file. Channels without a target node, or with a target that an extension
/// defines, are left out.
/// @param nodes of the file.
/// @throws InputError for times that do not ascend, values that are not finite or do not match the times in
/// number, nodes that cannot be animated, or one target with two channels.
std::vector<Animation> load_animations(GltfDocument& document, const std::vector<Node>& nodes);

}  // namespace core
