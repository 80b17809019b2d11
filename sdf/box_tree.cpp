#include "sdf/box_tree.h"

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
    std::uint32_t first = 0;  ///< Of a leaf: its first entry of the order.
};

double half_area(const core::DoubleBounds& box) {
    const glm::dvec3 e = box.extent();
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

/// Splits where the surface area heuristic is least, or in the middle of the order, and always so that leaves
/// are full.
class BinaryTree {
public:
    BinaryTree(std::span<const core::DoubleBounds> boxes, std::vector<std::uint32_t> order,
               std::size_t leaf_size, bool balanced)
        : boxes_(boxes), order_(std::move(order)), leaf_size_(leaf_size), balanced_(balanced) {
        nodes_.reserve(2 * (order_.size() / leaf_size + 1));
        build(0, order_.size());
    }

    const std::vector<BinaryNode>& nodes() const { return nodes_; }
    std::vector<std::uint32_t> take_order() { return std::move(order_); }

private:
    struct Split {
        int axis = -1;  ///< -1: no split separates the centres.
        std::size_t middle = 0;
        bool is_partitioned = false;  ///< The order is split there already.
    };

    std::int32_t build(std::size_t begin, std::size_t end) {
        const auto number = static_cast<std::int32_t>(nodes_.size());
        nodes_.emplace_back();
        core::DoubleBounds box, centers;
        for (std::size_t i = begin; i < end; ++i) {
            box.include(boxes_[order_[i]]);
            centers.include(boxes_[order_[i]].center());
        }
        nodes_[static_cast<std::size_t>(number)].box = box;
        if (end - begin <= leaf_size_) {
            nodes_[static_cast<std::size_t>(number)].first = static_cast<std::uint32_t>(begin);
            return number;
        }
        Split split;
        if (!balanced_) split = partition(begin, end, centers);
        if (split.axis < 0) split = {longest_axis(centers), begin + (end - begin) / 2, false};
        const std::size_t middle = fill_leaves(begin, end, split);
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

    auto at(std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); }

    /// Moves the split to the nearest place that leaves no leaf on its left unfilled.
    std::size_t fill_leaves(std::size_t begin, std::size_t end, const Split& split) {
        const std::size_t left_leaves = (split.middle - begin + leaf_size_ / 2) / leaf_size_;
        const std::size_t all_leaves = (end - begin + leaf_size_ - 1) / leaf_size_;
        const std::size_t middle =
            begin + std::clamp<std::size_t>(left_leaves, 1, all_leaves - 1) * leaf_size_;
        if (middle == split.middle && split.is_partitioned) return middle;
        const int axis = split.axis;
        std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t left, std::uint32_t right) {
            const double l = boxes_[left].center()[axis], r = boxes_[right].center()[axis];
            return l != r ? l < r : left < right;
        });
        return middle;
    }

    /// Leaves of so many boxes, the last perhaps unfilled.
    double leaves(std::size_t count) const {
        const std::size_t full = (count + leaf_size_ - 1) / leaf_size_;
        return static_cast<double>(full);
    }

    Split partition(std::size_t begin, std::size_t end, const core::DoubleBounds& centers) {
        constexpr int kBins = 16;
        double best_cost = std::numeric_limits<double>::infinity();
        int best_bin = 0;
        Split best;
        const auto bin_of = [&](std::uint32_t box, int axis) {
            const double width = centers.maximum[axis] - centers.minimum[axis];
            const double part = (boxes_[box].center()[axis] - centers.minimum[axis]) / width;
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
                right_cost[bin] = count > 0 ? leaves(count) * half_area(box) : 0.0;
            }
            box = {};
            count = 0;
            for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
                if (counts[bin] > 0) box.include(bins[bin]);
                count += counts[bin];
                if (count == 0 || count == end - begin) continue;
                const double cost = leaves(count) * half_area(box) + right_cost[bin + 1];
                if (cost < best_cost) {
                    best_cost = cost;
                    best.axis = axis;
                    best_bin = static_cast<int>(bin);
                }
            }
        }
        if (best.axis < 0) return best;
        const auto middle = std::stable_partition(
            at(begin), at(end), [&](std::uint32_t box) { return bin_of(box, best.axis) <= best_bin; });
        best.middle = static_cast<std::size_t>(middle - order_.begin());
        best.is_partitioned = true;
        return best;
    }

    std::span<const core::DoubleBounds> boxes_;
    std::vector<std::uint32_t> order_;
    std::size_t leaf_size_;
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
    WideTree(const std::vector<BinaryNode>& binary, std::uint32_t leaf_size)
        : binary_(binary), leaf_size_(leaf_size) {
        build(0, 1);
    }

    std::vector<BoxTree::Node> nodes;
    std::size_t stack_size = 0;  ///< Children that wait at most.

private:
    std::int32_t build(std::int32_t root, std::size_t waiting) {
        std::vector<std::int32_t> children{root};
        while (children.size() < BoxTree::kWidth) {
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
        nodes.push_back(empty_node());
        const std::size_t waiting_here = waiting - 1 + children.size();
        stack_size = std::max(stack_size, waiting_here);
        for (std::size_t i = 0; i < children.size(); ++i) {
            const BinaryNode& child = at(children[i]);
            const std::int32_t link = child.left < 0 ? ~static_cast<std::int32_t>(child.first / leaf_size_)
                                                     : build(children[i], waiting_here);
            BoxTree::Node& to = nodes[static_cast<std::size_t>(number)];
            to.child[i] = link;
            to.used |= 1u << i;
            for (int axis = 0; axis < 3; ++axis) {
                to.bound[0][axis][i] = round_down(child.box.minimum[axis]);
                to.bound[1][axis][i] = round_up(child.box.maximum[axis]);
            }
        }
        return number;
    }

    static BoxTree::Node empty_node() {
        BoxTree::Node node{};
        for (int side = 0; side < 2; ++side) {
            for (auto& bounds : node.bound[side]) {
                std::fill(std::begin(bounds), std::end(bounds),
                          (side == 0 ? 1.0f : -1.0f) * std::numeric_limits<float>::infinity());
            }
        }
        return node;
    }

    const BinaryNode& at(std::int32_t number) const { return binary_[static_cast<std::size_t>(number)]; }

    const std::vector<BinaryNode>& binary_;
    std::uint32_t leaf_size_;
};

}  // namespace

BoxTree::BoxTree(std::span<const core::DoubleBounds> boxes, const std::vector<std::uint32_t>& selection,
                 std::uint32_t leaf_size) {
    if (selection.empty()) return;
    for (const bool balanced : {false, true}) {
        BinaryTree binary(boxes, selection, leaf_size, balanced);
        WideTree wide(binary.nodes(), leaf_size);
        nodes = std::move(wide.nodes);
        order = binary.take_order();
        // Halves of 2^31 boxes are 31 deep, and wide nodes take three levels at once.
        if (wide.stack_size <= kStackSize) break;
    }
    nodes.shrink_to_fit();
}

}  // namespace sdf
