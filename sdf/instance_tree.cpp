#include "sdf/instance_tree.h"

#include <algorithm>

namespace sdf {

InstanceTree::InstanceTree(std::span<const core::DoubleBounds> boxes) {
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        if (!boxes[i].empty()) order_.push_back(i);
    }
    if (order_.empty()) return;
    nodes_.reserve(order_.size() * 2);
    build(boxes, 0, static_cast<std::uint32_t>(order_.size()));
}

void InstanceTree::build(std::span<const core::DoubleBounds> boxes, std::uint32_t begin, std::uint32_t end) {
    const std::size_t index = nodes_.size();
    nodes_.emplace_back();
    core::DoubleBounds box, centers;
    for (std::uint32_t i = begin; i < end; ++i) {
        box.include(boxes[order_[i]]);
        centers.include(boxes[order_[i]].center());
    }
    nodes_[index].box = box;
    if (end - begin <= kLeafSize) {
        nodes_[index].first = begin;
        nodes_[index].count = end - begin;
        return;
    }
    const glm::dvec3 extent = centers.extent();
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : (extent.y >= extent.z ? 1 : 2);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t left, std::uint32_t right) {
                         const double l = boxes[left].center()[axis], r = boxes[right].center()[axis];
                         return l != r ? l < r : left < right;
                     });
    build(boxes, begin, middle);
    nodes_[index].first = static_cast<std::uint32_t>(nodes_.size());
    build(boxes, middle, end);
}

void InstanceTree::Walk::start(const InstanceTree& tree, const glm::dvec3& origin,
                               const glm::dvec3& direction, double t_min, double limit) {
    tree_ = &tree;
    leaf_next_ = leaf_end_ = 0;
    depth_ = 0;
    if (tree.nodes_.empty()) return;
    if (tree.nodes_.size() == 1) {
        // The few instances there are clip the ray themselves.
        leaf_end_ = tree.nodes_[0].count;
        return;
    }
    origin_ = origin;
    inverse_ = finite_inverse(direction);
    t_min_ = t_min;
    double t = 0.0;
    if (entry_distance(0, limit, t)) push(0, t);
}

bool InstanceTree::Walk::entry_distance(std::uint32_t node, double limit, double& t) const {
    t = t_min_;
    return clip_to_box(tree_->nodes_[node].box, origin_, inverse_, t, limit);
}

bool InstanceTree::Walk::next(double limit, std::uint32_t& instance) {
    while (leaf_next_ == leaf_end_) {
        if (depth_ == 0) return false;
        const Entry entry = stack_[--depth_];
        if (entry.t > limit) continue;
        const Node& node = tree_->nodes_[entry.node];
        if (node.count > 0) {
            leaf_next_ = node.first;
            leaf_end_ = node.first + node.count;
            break;
        }
        const std::uint32_t children[] = {entry.node + 1, node.first};
        double t[2];
        const bool met[] = {entry_distance(children[0], limit, t[0]),
                            entry_distance(children[1], limit, t[1])};
        const int near = met[0] && met[1] && t[1] < t[0] ? 1 : 0;
        if (met[1 - near]) push(children[1 - near], t[1 - near]);
        if (met[near]) push(children[near], t[near]);
    }
    instance = tree_->order_[leaf_next_++];
    return true;
}

}  // namespace sdf
