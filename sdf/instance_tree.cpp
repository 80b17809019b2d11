#include "sdf/instance_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace sdf {

namespace {

/// A subtree of the binary tree that is built first.
struct BinaryNode {
    core::DoubleBounds box;
    std::int32_t left = -1, right = -1;
    std::uint32_t instance = core::kNoIndex;  ///< Of a leaf.
};

double half_area(const core::DoubleBounds& box) {
    const glm::dvec3 e = box.extent();
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

/// A binary tree over boxes: split where the surface area heuristic is least (Wald, "On fast Construction of
/// SAH-based Bounding Volume Hierarchies", RT 2007), or in the middle of the order.
class BinaryTree {
public:
    BinaryTree(std::span<const core::DoubleBounds> boxes, std::vector<std::uint32_t> order, bool balanced)
        : boxes_(boxes), order_(std::move(order)), balanced_(balanced) {
        nodes_.reserve(2 * order_.size());
        build(0, order_.size());
    }

    const std::vector<BinaryNode>& nodes() const { return nodes_; }

private:
    std::int32_t build(std::size_t begin, std::size_t end) {
        const auto number = static_cast<std::int32_t>(nodes_.size());
        nodes_.emplace_back();
        core::DoubleBounds box, centers;
        for (std::size_t i = begin; i < end; ++i) {
            box.include(boxes_[order_[i]]);
            centers.include(boxes_[order_[i]].center());
        }
        nodes_[static_cast<std::size_t>(number)].box = box;
        if (end - begin == 1) {
            nodes_[static_cast<std::size_t>(number)].instance = order_[begin];
            return number;
        }
        std::size_t middle = balanced_ ? begin : split(begin, end, centers);
        if (middle == begin || middle == end) middle = split_in_half(begin, end, centers);
        const std::int32_t left = build(begin, middle);
        const std::int32_t right = build(middle, end);
        nodes_[static_cast<std::size_t>(number)].left = left;
        nodes_[static_cast<std::size_t>(number)].right = right;
        return number;
    }

    static int longest_axis(const core::DoubleBounds& centers) {
        const glm::dvec3 extent = centers.extent();
        return extent.x >= extent.y && extent.x >= extent.z ? 0 : (extent.y >= extent.z ? 1 : 2);
    }

    std::size_t split_in_half(std::size_t begin, std::size_t end, const core::DoubleBounds& centers) {
        const int axis = longest_axis(centers);
        const std::size_t middle = begin + (end - begin) / 2;
        const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t left, std::uint32_t right) {
            const double l = boxes_[left].center()[axis], r = boxes_[right].center()[axis];
            return l != r ? l < r : left < right;
        });
        return middle;
    }

    /// The end of the left half; `begin` where no split separates the centres.
    std::size_t split(std::size_t begin, std::size_t end, const core::DoubleBounds& centers) {
        constexpr int kBins = 16;
        double best_cost = std::numeric_limits<double>::infinity();
        int best_axis = -1, best_bin = 0;
        const auto bin_of = [&](std::uint32_t instance, int axis) {
            const double width = centers.extent()[axis];
            const double part = (boxes_[instance].center()[axis] - centers.minimum[axis]) / width;
            return std::clamp(static_cast<int>(part * kBins), 0, kBins - 1);
        };
        for (int axis = 0; axis < 3; ++axis) {
            if (!(centers.extent()[axis] > 0.0) || !std::isfinite(centers.extent()[axis])) continue;
            std::array<core::DoubleBounds, kBins> bins;
            std::array<std::size_t, kBins> counts{};
            for (std::size_t i = begin; i < end; ++i) {
                const auto bin = static_cast<std::size_t>(bin_of(order_[i], axis));
                bins[bin].include(boxes_[order_[i]]);
                ++counts[bin];
            }
            std::array<double, kBins> right_cost{};
            core::DoubleBounds box;
            std::size_t count = 0;
            for (std::size_t bin = kBins - 1; bin > 0; --bin) {
                if (counts[bin] > 0) box.include(bins[bin]);
                count += counts[bin];
                right_cost[bin] = count > 0 ? static_cast<double>(count) * half_area(box) : 0.0;
            }
            box = {};
            count = 0;
            for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
                if (counts[bin] > 0) box.include(bins[bin]);
                count += counts[bin];
                if (count == 0 || count == end - begin) continue;
                const double cost = static_cast<double>(count) * half_area(box) + right_cost[bin + 1];
                if (cost < best_cost) {
                    best_cost = cost;
                    best_axis = axis;
                    best_bin = static_cast<int>(bin);
                }
            }
        }
        if (best_axis < 0) return begin;
        const auto first = order_.begin() + static_cast<std::ptrdiff_t>(begin);
        const auto last = order_.begin() + static_cast<std::ptrdiff_t>(end);
        const auto middle = std::stable_partition(
            first, last, [&](std::uint32_t instance) { return bin_of(instance, best_axis) <= best_bin; });
        return static_cast<std::size_t>(middle - order_.begin());
    }

    std::span<const core::DoubleBounds> boxes_;
    std::vector<std::uint32_t> order_;
    bool balanced_;
    std::vector<BinaryNode> nodes_;
};

float round_down(double value) {
    const auto rounded = static_cast<float>(value);
    return std::nextafter(rounded, -std::numeric_limits<float>::infinity());
}

float round_up(double value) {
    const auto rounded = static_cast<float>(value);
    return std::nextafter(rounded, std::numeric_limits<float>::infinity());
}

/// Gathers up to eight descendants under each wide node, opening the largest first.
class WideTree {
public:
    explicit WideTree(const std::vector<BinaryNode>& binary) : binary_(binary) { build(0, 1); }

    std::vector<InstanceTree::Node> nodes;
    std::size_t stack_size = 0;  ///< Children that wait at most.

private:
    std::int32_t build(std::int32_t root, std::size_t waiting) {
        std::vector<std::int32_t> children{root};
        while (children.size() < InstanceTree::kWidth) {
            auto largest = children.end();
            for (auto child = children.begin(); child != children.end(); ++child) {
                if (at(*child).left < 0) continue;
                if (largest == children.end() || half_area(at(*child).box) > half_area(at(*largest).box)) {
                    largest = child;
                }
            }
            if (largest == children.end()) break;
            const BinaryNode& opened = at(*largest);
            *largest = opened.left;
            children.push_back(opened.right);
        }
        const auto number = static_cast<std::int32_t>(nodes.size());
        nodes.push_back(InstanceTree::Node{});
        const std::size_t waiting_here = waiting - 1 + children.size();
        stack_size = std::max(stack_size, waiting_here);
        for (std::size_t i = 0; i < children.size(); ++i) {
            const BinaryNode& child = at(children[i]);
            const std::int32_t link = child.left < 0 ? ~static_cast<std::int32_t>(child.instance)
                                                     : build(children[i], waiting_here);
            InstanceTree::Node& to = nodes[static_cast<std::size_t>(number)];
            to.child[i] = link;
            to.used |= 1u << i;
            for (int axis = 0; axis < 3; ++axis) {
                to.low[axis][i] = round_down(child.box.minimum[axis]);
                to.high[axis][i] = round_up(child.box.maximum[axis]);
            }
        }
        return number;
    }

    const BinaryNode& at(std::int32_t number) const { return binary_[static_cast<std::size_t>(number)]; }

    const std::vector<BinaryNode>& binary_;
};

}  // namespace

InstanceTree::InstanceTree(std::span<const core::DoubleBounds> boxes) {
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        if (!boxes[i].empty()) order.push_back(i);
    }
    if (order.empty()) return;
    if (order.size() == 1) only_instance_ = order[0];
    for (const bool balanced : {false, true}) {
        const BinaryTree binary(boxes, order, balanced);
        WideTree wide(binary.nodes());
        nodes_ = std::move(wide.nodes);
        // Halves of 2^31 instances are 31 deep, and wide nodes take three levels at once.
        if (wide.stack_size <= kStackSize) break;
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
