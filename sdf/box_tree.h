// sdf/box_tree.h: hierarchies of boxes, eight children a node, for rays.
//
// One test of a ray against all children of a node fills a vector. Boxes are single precision, rounded
// outwards; whoever walks them decides exactly at the leaves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/bounds.h"

namespace sdf {

/// Built where the surface area heuristic is least (Wald, "On fast Construction of SAH-based Bounding Volume
/// Hierarchies", RT 2007), then eight children gathered under each node. Its shape depends on the boxes
/// alone.
class BoxTree {
public:
    static constexpr std::size_t kWidth = 8;
    /// Children that wait at most in a walk, whatever the tree: the constructor sees to it.
    static constexpr std::size_t kStackSize = 96;

    struct alignas(64) Node {
        float bound[2][3][kWidth];   ///< Lowest and highest corner, by axis and child.
        std::int32_t child[kWidth];  ///< Node numbers, or ~leaf.
        std::uint32_t used;          ///< One bit a child that there is; the others' boxes are empty.
    };

    BoxTree() = default;
    /// @param selection the boxes that the tree holds, as indices; none of them empty
    /// @param leaf_size boxes a leaf; every leaf but one is full
    BoxTree(std::span<const core::DoubleBounds> boxes, const std::vector<std::uint32_t>& selection,
            std::uint32_t leaf_size);

    /// Root first; empty if nothing was selected.
    std::vector<Node> nodes;
    /// Boxes in leaf order: leaf i holds entries leaf_size i to leaf_size (i + 1) - 1.
    std::vector<std::uint32_t> order;
};

}  // namespace sdf
