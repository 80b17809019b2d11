// sdf/instance_tree.h: a bounding volume hierarchy over the world boxes of instances.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/math/bounds.h"

namespace sdf {

/// A binary tree, walked front to back with pruning at the nearest hit so far.
class InstanceTree {
public:
    /// One box an instance; empty boxes are never visited.
    InstanceTree() = default;
    explicit InstanceTree(std::span<const core::DoubleBounds> boxes);

    /// Calls visit(instance) for instances whose box the ray meets within [t_min, limit()], near boxes first
    /// as far as the tree can tell; `limit` is read anew before every step. visit returns true to stop.
    template <typename Limit, typename Visit>
    void walk(const glm::dvec3& origin, const glm::dvec3& direction, double t_min, const Limit& limit,
              const Visit& visit) const;

    std::size_t bytes() const { return nodes_.size() * sizeof(Node) + order_.size() * sizeof(order_[0]); }

private:
    struct Node {
        core::DoubleBounds box;
        std::uint32_t first = 0;  ///< Leaf: first entry of order_. Inner: index of the second child.
        std::uint32_t count = 0;  ///< Leaf: number of entries. Inner: 0; the first child follows the node.
    };
    static constexpr std::uint32_t kLeafSize = 2;
    static constexpr int kMaxDepth = 64;

    void build(std::span<const core::DoubleBounds> boxes, std::uint32_t begin, std::uint32_t end);

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> order_;
};

/// 1 / direction with something finite in place of infinity, so that a ray in the face of a box (0 times the
/// inverse) counts as inside that slab and no NaN arises.
inline glm::dvec3 finite_inverse(const glm::dvec3& direction) {
    constexpr double kHuge = 1e200;
    glm::dvec3 inverse;
    for (int axis = 0; axis < 3; ++axis)
        inverse[axis] = direction[axis] == 0.0 ? kHuge : 1.0 / direction[axis];
    return inverse;
}

/// Narrows [t_min, t_max] to the part inside a box; false if there is none.
inline bool clip_to_box(const core::DoubleBounds& box, const glm::dvec3& origin,
                        const glm::dvec3& inverse_direction, double& t_min, double& t_max) {
    for (int axis = 0; axis < 3; ++axis) {
        const double a = (box.minimum[axis] - origin[axis]) * inverse_direction[axis];
        const double b = (box.maximum[axis] - origin[axis]) * inverse_direction[axis];
        const double near = a > b ? b : a;
        const double far = a > b ? a : b;
        if (near > t_min) t_min = near;
        if (far < t_max) t_max = far;
    }
    return t_min <= t_max;
}

template <typename Limit, typename Visit>
void InstanceTree::walk(const glm::dvec3& origin, const glm::dvec3& direction, double t_min,
                        const Limit& limit, const Visit& visit) const {
    if (nodes_.empty()) return;
    const glm::dvec3 inverse = finite_inverse(direction);
    struct Entry {
        std::uint32_t node;
        double t;
    };
    const auto entry_distance = [&](std::uint32_t node, double& t) {
        double far = limit();
        t = t_min;
        return clip_to_box(nodes_[node].box, origin, inverse, t, far);
    };
    Entry stack[kMaxDepth];
    int depth = 0;
    double t = 0.0;
    if (!entry_distance(0, t)) return;
    stack[depth++] = {0, t};
    while (depth > 0) {
        const Entry entry = stack[--depth];
        if (entry.t > limit()) continue;
        const Node& node = nodes_[entry.node];
        if (node.count > 0) {
            for (std::uint32_t i = 0; i < node.count; ++i) {
                if (visit(order_[node.first + i])) return;
            }
            continue;
        }
        double t_first = 0.0, t_second = 0.0;
        const bool first = entry_distance(entry.node + 1, t_first);
        const bool second = entry_distance(node.first, t_second);
        const Entry near_entry{entry.node + 1, t_first}, far_entry{node.first, t_second};
        if (first && second) {
            const bool in_order = t_first <= t_second;
            stack[depth++] = in_order ? far_entry : near_entry;
            stack[depth++] = in_order ? near_entry : far_entry;
        } else if (first) {
            stack[depth++] = near_entry;
        } else if (second) {
            stack[depth++] = far_entry;
        }
    }
}

}  // namespace sdf
