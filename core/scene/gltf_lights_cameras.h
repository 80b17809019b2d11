// core/scene/gltf_lights_cameras.h: glTF cameras and KHR_lights_punctual, placed by their nodes.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "core/scene/camera.h"
#include "core/scene/gltf_document.h"
#include "core/scene/light.h"

namespace core {

/// A camera at a node, without the node's scale. It is named after the node, or else after the camera.
/// @throws InputError for a field of view or magnification that shows nothing.
Camera read_camera(const JsonElement& element, const JsonElement& node, const glm::dmat4& world_from_node);

/// The light that a node's KHR_lights_punctual refers to. It shines along the node's -Z. Nothing, with a
/// warning, for a type that the extension does not know.
/// @throws InputError for negative intensity, cones out of order.
std::optional<Light> read_light(GltfDocument& document, const JsonElement& reference, const JsonElement& node,
                                const glm::dmat4& world_from_node);

}  // namespace core
