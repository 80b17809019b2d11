// sdf/instance_tree.h: a bounding volume hierarchy over the world boxes of instances.
//
// What its boxes let through is clipped exactly later, in each field's own space.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/math/bounds.h"
#include "core/math/ray.h"
#include "sdf/box_tree.h"

namespace sdf {

/// Walked front to back with pruning at the nearest hit so far.
class InstanceTree {
public:
    static constexpr std::size_t kWidth = BoxTree::kWidth;
    static constexpr std::size_t kStackSize = BoxTree::kStackSize;
    using Node = BoxTree::Node;  ///< Its children: node numbers, or ~instance.

    /// One box an instance; empty boxes are never visited.
    InstanceTree() = default;
    explicit InstanceTree(std::span<const core::DoubleBounds> boxes);

    /// A walk along one ray: the instances whose box it meets, by the distance at which it enters them.
    class Walk {
    public:
        /// @param limit beyond which nothing counts
        void start(const InstanceTree& tree, const core::Ray& ray, double limit);

        /// The next instance whose box begins before `limit`, which may shrink from call to call; false once
        /// there is none.
        bool next(double limit, std::uint32_t& instance);

        struct Entry {
            float t;
            std::int32_t child;
        };
        const Node* nodes = nullptr;
        float origin[3], inverse[3], t_min;
        std::int32_t depth = 0;
        Entry stack[kStackSize];
    };

    /// next() for many walks: of walks[slots[i]] before limits[i]; kNoIndex where there is none.
    static void find_next(std::span<Walk> walks, std::span<const std::uint32_t> slots, const double* limits,
                          std::uint32_t* instances);

    /// The instance, if exactly one can be met; kNoIndex else.
    std::uint32_t only_instance() const { return only_instance_; }

    std::size_t bytes() const { return nodes_.capacity() * sizeof(Node); }

private:
    std::vector<Node> nodes_;
    std::uint32_t only_instance_ = core::kNoIndex;
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
