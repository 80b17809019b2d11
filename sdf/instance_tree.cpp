#include "sdf/instance_tree.h"

#include <cmath>

namespace sdf {

InstanceTree::InstanceTree(std::span<const core::DoubleBounds> boxes) {
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        if (!boxes[i].empty()) order.push_back(i);
    }
    if (order.size() == 1) only_instance_ = order[0];
    BoxTree tree(boxes, order, 1);
    nodes_ = std::move(tree.nodes);
    for (Node& node : nodes_) {
        for (std::int32_t& child : node.child) {
            // Instances instead of leaves.
            if (child < 0) child = ~static_cast<std::int32_t>(tree.order[static_cast<std::size_t>(~child)]);
        }
    }
}

void InstanceTree::Walk::start(const InstanceTree& tree, const core::Ray& ray, double limit) {
    nodes = tree.nodes_.data();
    depth = 0;
    t_min = ray.t_min;
    if (tree.nodes_.empty() || !(t_min <= limit)) return;
    for (int axis = 0; axis < 3; ++axis) {
        constexpr float kHuge = 1e30f;
        const float d = ray.direction[axis];
        origin[axis] = ray.origin[axis];
        inverse[axis] = std::abs(d) < 1e-30f ? kHuge : 1.0f / d;
    }
    stack[depth++] = {t_min, 0};
}

bool InstanceTree::Walk::next(double limit, std::uint32_t& instance) {
    const std::uint32_t slot = 0;
    find_next(std::span(this, 1), std::span(&slot, 1), &limit, &instance);
    return instance != core::kNoIndex;
}

}  // namespace sdf
