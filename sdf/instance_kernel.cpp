// sdf/instance_kernel.cpp: a ray against the eight boxes of a node at once.
#include "sdf/instance_tree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/instance_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::CappedTag<float, InstanceTree::kWidth>;
using Floats = hn::Vec<FloatTag>;

constexpr FloatTag kFloat;

/// Distances round: boxes are taken to reach so much farther (Ize, "Robust BVH Ray Traversal", JCGT 2013,
/// whose bound is 4e-7).
constexpr float kFarther = 1.0f + 1e-6f;

/// Pushes the children of a node that the ray meets before `limit`, the nearest last.
HWY_INLINE HWY_ATTR void push_children(InstanceTree::Walk& walk, const InstanceTree::Node& node,
                                       float limit) {
    alignas(64) float entry[InstanceTree::kWidth];
    std::uint32_t met = 0;
    for (std::size_t first = 0; first < InstanceTree::kWidth; first += hn::Lanes(kFloat)) {
        Floats near = hn::Set(kFloat, walk.t_min), far = hn::Set(kFloat, limit);
        for (int axis = 0; axis < 3; ++axis) {
            const Floats origin = hn::Set(kFloat, walk.origin[axis]),
                         inverse = hn::Set(kFloat, walk.inverse[axis]);
            const Floats a = (hn::Load(kFloat, node.bound[0][axis] + first) - origin) * inverse;
            const Floats b = (hn::Load(kFloat, node.bound[1][axis] + first) - origin) * inverse;
            near = hn::Max(near, hn::Min(a, b));
            far = hn::Min(far, hn::Max(a, b) * hn::Set(kFloat, kFarther));
        }
        hn::Store(near, kFloat, entry + first);
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(kFloat, hn::Le(near, far), bits);
        met |= static_cast<std::uint32_t>(bits[0]) << first;
    }
    const std::int32_t bottom = walk.depth;
    for (met &= node.used; met != 0; met &= met - 1) {
        const auto child = static_cast<std::size_t>(__builtin_ctz(met));
        InstanceTree::Walk::Entry inserted{entry[child], node.child[child]};
        std::int32_t at = walk.depth++;
        // Far ones first; of equally far ones, which are popped in turn, the order does not matter.
        for (; at > bottom && walk.stack[at - 1].t < inserted.t; --at) walk.stack[at] = walk.stack[at - 1];
        walk.stack[at] = inserted;
    }
}

HWY_ATTR void find_next(InstanceTree::Walk* walks, const std::uint32_t* slots, std::size_t count,
                        const double* limits, std::uint32_t* instances) {
    for (std::size_t i = 0; i < count; ++i) {
        InstanceTree::Walk& walk = walks[slots[i]];
        const auto limit = static_cast<float>(limits[i]) * kFarther;
        instances[i] = core::kNoIndex;
        while (walk.depth > 0) {
            const InstanceTree::Walk::Entry top = walk.stack[--walk.depth];
            if (top.t > limit) continue;
            if (top.child < 0) {
                instances[i] = static_cast<std::uint32_t>(~top.child);
                break;
            }
            push_children(walk, walk.nodes[top.child], limit);
        }
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sdf {

HWY_EXPORT(find_next);

void InstanceTree::find_next(std::span<Walk> walks, std::span<const std::uint32_t> slots,
                             const double* limits, std::uint32_t* instances) {
    HWY_DYNAMIC_DISPATCH(find_next)(walks.data(), slots.data(), slots.size(), limits, instances);
}

}  // namespace sdf

#endif  // HWY_ONCE
