#include "core/scene/node.h"

#include <cassert>

namespace core {

namespace {

glm::dmat4 parent_from_node(const Node& node, const NodePose* pose) {
    if (node.matrix) return *node.matrix;
    if (!pose) return compose_transform(node.translation, node.rotation, node.scale);
    return compose_transform(pose->translation.value_or(node.translation),
                             pose->rotation.value_or(node.rotation), pose->scale.value_or(node.scale));
}

}  // namespace

glm::dmat4 compose_transform(const glm::dvec3& translation, const glm::dquat& rotation,
                             const glm::dvec3& scale) {
    glm::dmat4 matrix = glm::mat4_cast(rotation);
    for (int axis = 0; axis < 3; ++axis) matrix[axis] *= scale[axis];
    matrix[3] = glm::dvec4(translation, 1.0);
    return matrix;
}

std::vector<glm::dmat4> world_from_nodes(std::span<const Node> nodes, std::span<const NodePose> pose) {
    std::vector<const NodePose*> pose_of_node(nodes.size(), nullptr);
    for (const NodePose& entry : pose) {
        assert(entry.node < nodes.size());
        pose_of_node[entry.node] = &entry;
    }
    std::vector<glm::dmat4> result(nodes.size());
    std::vector<bool> known(nodes.size(), false);
    std::vector<std::uint32_t> path;
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
        // Up to the first ancestor that is known, then down again. Not recursive: files may be deep.
        for (std::uint32_t node = i; node != kNoNode && !known[node]; node = nodes[node].parent) {
            path.push_back(node);
        }
        for (; !path.empty(); path.pop_back()) {
            const std::uint32_t node = path.back();
            const std::uint32_t parent = nodes[node].parent;
            const glm::dmat4 world_from_parent = parent == kNoNode ? glm::dmat4(1.0) : result[parent];
            result[node] = world_from_parent * parent_from_node(nodes[node], pose_of_node[node]);
            known[node] = true;
        }
    }
    return result;
}

}  // namespace core
