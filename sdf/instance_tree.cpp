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

}  // namespace sdf
