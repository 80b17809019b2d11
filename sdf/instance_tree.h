// sdf/instance_tree.h: a bounding volume hierarchy over the world boxes of instances.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/math/bounds.h"
#include "core/math/ray.h"

namespace sdf {

/// A binary tree, walked front to back with pruning at the nearest hit so far.
class InstanceTree {
public:
    /// The median splits of 2^32 instances end at depth 32.
    static constexpr int kMaxDepth = 34;

    /// One box an instance; empty boxes are never visited.
    InstanceTree() = default;
    explicit InstanceTree(std::span<const core::DoubleBounds> boxes);

    /// A walk along one ray: the instances whose box it meets, near boxes first as far as the tree can tell.
    class Walk {
    public:
        /// @param limit beyond which nothing counts
        void start(const InstanceTree& tree, const glm::dvec3& origin, const glm::dvec3& direction,
                   double t_min, double limit);

        /// The next instance whose box begins before `limit`, which may shrink from call to call; false once
        /// there is none.
        bool next(double limit, std::uint32_t& instance);

    private:
        struct Entry {
            double t;
            std::uint32_t node;
        };
        bool entry_distance(std::uint32_t node, double limit, double& t) const;
        void push(std::uint32_t node, double t) { stack_[depth_++] = {t, node}; }

        const InstanceTree* tree_ = nullptr;
        glm::dvec3 origin_{0.0}, inverse_{0.0};
        double t_min_ = 0.0;
        std::uint32_t leaf_next_ = 0, leaf_end_ = 0;  ///< What is left of the last leaf.
        int depth_ = 0;
        Entry stack_[kMaxDepth];
    };

    /// The instance, if exactly one can be met; kNoIndex else.
    std::uint32_t only_instance() const { return order_.size() == 1 ? order_[0] : core::kNoIndex; }

    std::size_t bytes() const { return nodes_.size() * sizeof(Node) + order_.size() * sizeof(order_[0]); }

private:
    struct Node {
        core::DoubleBounds box;
        std::uint32_t first = 0;  ///< Leaf: first entry of order_. Inner: index of the second child.
        std::uint32_t count = 0;  ///< Leaf: number of entries. Inner: 0; the first child follows the node.
    };
    static constexpr std::uint32_t kLeafSize = 2;

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

}  // namespace sdf
