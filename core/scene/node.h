// core/scene/node.h: the hierarchy that things of a scene hang on, and where it stands in a pose.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace core {

/// Stands for no node: of roots their parent, of the command line's sun and camera their node.
inline constexpr std::uint32_t kNoNode = std::numeric_limits<std::uint32_t>::max();

/// A node as the file gives it, at rest.
struct Node {
    std::string name;
    std::uint32_t parent = kNoNode;
    glm::dvec3 translation{0.0};
    glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  ///< Unit; w first.
    glm::dvec3 scale{1.0};
    std::optional<glm::dmat4> matrix;  ///< Instead of the three above; such a node cannot be animated.
};

/// What an animation changes of one node at one time. What is absent stays as it is at rest.
struct NodePose {
    std::uint32_t node = kNoNode;
    std::optional<glm::dvec3> translation;
    std::optional<glm::dquat> rotation;
    std::optional<glm::dvec3> scale;
    std::vector<double> weights;  ///< Of the morph targets of the node's mesh; empty: as at rest.
};

/// Translation after rotation after scale. @pre `rotation` is unit.
glm::dmat4 compose_transform(const glm::dvec3& translation, const glm::dquat& rotation,
                             const glm::dvec3& scale);

/// The world transform of every node. @param pose of any nodes, each at most once; empty: the rest pose.
/// @pre `nodes` form trees; poses name nodes that exist and have no matrix.
std::vector<glm::dmat4> world_from_nodes(std::span<const Node> nodes, std::span<const NodePose> pose = {});

}  // namespace core
