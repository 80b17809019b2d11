// sdf/triangle_ray_kernel.cpp: a ray against the eight boxes of a node and the four triangles of a leaf at
// once.
#include "sdf/triangle_ray_tree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/triangle_ray_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using BoxTag = hn::CappedTag<float, BoxTree::kWidth>;
using Boxes = hn::Vec<BoxTag>;
using DoubleTag = hn::CappedTag<double, TriangleRayTree::kBlockTriangles>;
using CornerTag = hn::Rebind<float, DoubleTag>;
using Doubles = hn::Vec<DoubleTag>;

constexpr BoxTag kBox;
constexpr DoubleTag kDouble;
constexpr CornerTag kCorner;

/// Distances to boxes round: whatever limits them is taken to be so much farther (Ize, "Robust BVH Ray
/// Traversal", JCGT 2013, whose bound is 4e-7).
constexpr float kFarther = 1.0f + 1e-6f;
/// Positions round as well: boxes are taken to reach out so much farther, as a part of all coordinates.
constexpr float kSlack = 4e-7f;
constexpr double kDoubleSlack = 1e-14;
/// Directions with a smaller part along an axis run parallel to it; a ray in the face of a box is inside that
/// slab, and no NaN arises.
constexpr float kParallel = 1e-20f;
constexpr float kHuge = 1e30f;
/// As in intersect().
constexpr double kEdgeSlack = 1e-12;

/// The ray as boxes see it: from its first point that counts, with a direction of unit length.
struct BoxRay {
    float origin[2][3];  ///< With the slack: for the lower and for the upper faces of boxes.
    float inverse[3];
    int near_side[3];  ///< Through which of the two it comes in.
    double t_min, speed;

    BoxRay() = default;
    BoxRay(const RaySegment& ray, float reach) {
        const glm::dvec3& d = ray.direction;
        t_min = ray.t_min;
        speed = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
        const double per_unit = 1.0 / speed;
        float start[3], slack = reach;
        double farthest = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            start[axis] = static_cast<float>(ray.origin[axis] + t_min * d[axis]);
            slack = std::max(slack, std::abs(start[axis]));
            farthest = std::max(farthest, std::abs(ray.origin[axis]));
            const auto part = static_cast<float>(d[axis] * per_unit);
            inverse[axis] = std::abs(part) < kParallel ? kHuge : 1.0f / part;
            near_side[axis] = inverse[axis] < 0.0f;
        }
        slack = kSlack * slack + static_cast<float>(kDoubleSlack * farthest);
        for (int axis = 0; axis < 3; ++axis) {
            origin[0][axis] = start[axis] + slack;
            origin[1][axis] = start[axis] - slack;
        }
    }

    float distance(double t) const { return static_cast<float>((t - t_min) * speed) * kFarther; }
};

/// What waits for a walk.
struct Entry {
    float distance;  ///< Where the ray comes into the box.
    std::int32_t child;
};

/// Pushes the children of a node that the ray meets before `limit`, the nearest last.
HWY_INLINE HWY_ATTR void push_children(const BoxRay& ray, const BoxTree::Node& node, float limit,
                                       Entry* stack, int& depth) {
    alignas(64) float distance[BoxTree::kWidth];
    std::uint32_t met = 0;
    for (std::size_t first = 0; first < BoxTree::kWidth; first += hn::Lanes(kBox)) {
        Boxes near = hn::Zero(kBox), far = hn::Set(kBox, limit);
        for (int axis = 0; axis < 3; ++axis) {
            const int side = ray.near_side[axis];
            const Boxes inverse = hn::Set(kBox, ray.inverse[axis]);
            const auto plane = [&](int of) HWY_ATTR {
                return (hn::Load(kBox, node.bound[of][axis] + first) - hn::Set(kBox, ray.origin[of][axis])) *
                       inverse;
            };
            near = hn::Max(near, plane(side));
            far = hn::Min(far, plane(1 - side) * hn::Set(kBox, kFarther));
        }
        hn::Store(near, kBox, distance + first);
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(kBox, hn::Le(near, far), bits);
        met |= static_cast<std::uint32_t>(bits[0]) << first;
    }
    const int bottom = depth;
    for (met &= node.used; met != 0; met &= met - 1) {
        const auto child = static_cast<std::size_t>(__builtin_ctz(met));
        const Entry inserted{distance[child], node.child[child]};
        int at = depth++;
        // Far ones first; of equally far ones, which are popped in turn, the order does not matter.
        for (; at > bottom && stack[at - 1].distance < inserted.distance; --at) stack[at] = stack[at - 1];
        stack[at] = inserted;
    }
}

struct Vector {
    Doubles x, y, z;
};

HWY_INLINE HWY_ATTR Vector operator-(const Vector& a, const Vector& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

HWY_INLINE HWY_ATTR Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y};
}

HWY_INLINE HWY_ATTR Doubles dot(const Vector& a, const Vector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

HWY_INLINE HWY_ATTR Vector corner_of(const TriangleRayTree::Block& block, int corner, std::size_t first) {
    const auto component = [&](int axis) HWY_ATTR {
        return hn::PromoteTo(kDouble, hn::Load(kCorner, block.corner[corner][axis] + first));
    };
    return {component(0), component(1), component(2)};
}

/// intersect() for four triangles: takes those that are met in [t_min, best.t] and come before `best`.
HWY_INLINE HWY_ATTR void meet_block(const TriangleRayTree::Block& block, const RaySegment& ray,
                                    FirstHit& best) {
    const Doubles zero = hn::Zero(kDouble);
    const Doubles below = hn::Set(kDouble, -kEdgeSlack), beyond = hn::Set(kDouble, 1.0 + kEdgeSlack);
    const Vector origin{hn::Set(kDouble, ray.origin.x), hn::Set(kDouble, ray.origin.y),
                        hn::Set(kDouble, ray.origin.z)};
    const Vector direction{hn::Set(kDouble, ray.direction.x), hn::Set(kDouble, ray.direction.y),
                           hn::Set(kDouble, ray.direction.z)};
    for (std::size_t first = 0; first < TriangleRayTree::kBlockTriangles; first += hn::Lanes(kDouble)) {
        const Vector a = corner_of(block, 0, first);
        const Vector edge1 = corner_of(block, 1, first) - a, edge2 = corner_of(block, 2, first) - a;
        const Vector p = cross(direction, edge2);
        const Doubles determinant = dot(edge1, p);
        const Vector s = origin - a;
        const Doubles u = dot(s, p) / determinant;
        const Vector q = cross(s, edge1);
        const Doubles v = dot(direction, q) / determinant;
        const auto inside = hn::And(hn::And(hn::Ge(u, below), hn::Le(u, beyond)),
                                    hn::And(hn::Ge(v, below), hn::Le(u + v, beyond)));
        const auto meets = hn::AndNot(hn::Eq(determinant, zero), inside);
        if (hn::AllFalse(kDouble, meets)) continue;
        alignas(64) double t[TriangleRayTree::kBlockTriangles];
        hn::Store(dot(edge2, q) / determinant, kDouble, t);
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(kDouble, meets, bits);
        for (std::uint32_t left = bits[0]; left != 0; left &= left - 1) {
            const auto lane = static_cast<std::size_t>(__builtin_ctz(left));
            const std::uint32_t index = block.index[first + lane];
            if (!(t[lane] >= ray.t_min && t[lane] <= best.t)) continue;
            if (t[lane] == best.t && best && index > best.triangle) continue;
            best = {t[lane], index};
        }
    }
}

/// A query under way.
struct Walk {
    TriangleQuery* query = nullptr;
    const TriangleRayTree* tree = nullptr;
    BoxRay ray;
    FirstHit best;
    float limit = 0.0f;
    int depth = 0;
    Entry stack[BoxTree::kStackSize];
};

HWY_INLINE HWY_ATTR void start(Walk& walk, TriangleQuery& query) {
    walk.query = &query;
    walk.tree = query.tree;
    walk.ray = BoxRay(query.ray, query.tree->reach());
    walk.best = {query.ray.t_max, kNoTriangle};
    walk.limit = walk.ray.distance(query.ray.t_max);
    walk.depth = 0;
    const bool is_empty = query.tree->empty() || !(query.ray.t_min <= query.ray.t_max);
    if (!is_empty) walk.stack[walk.depth++] = {0.0f, 0};
}

HWY_INLINE HWY_ATTR void prefetch(const void* memory, std::size_t size) {
    for (std::size_t at = 0; at < size; at += 64) hwy::Prefetch(static_cast<const char*>(memory) + at);
}

/// Tests the nearest box that waits. @returns whether any is left
HWY_INLINE HWY_ATTR bool advance(Walk& walk) {
    if (walk.depth == 0) return false;
    const Entry top = walk.stack[--walk.depth];
    if (top.child >= 0) {
        push_children(walk.ray, walk.tree->nodes()[top.child], walk.limit, walk.stack, walk.depth);
    } else {
        meet_block(walk.tree->blocks()[~top.child], walk.query->ray, walk.best);
        if (walk.best && walk.query->which == FirstOrAny::kAny) return false;
        walk.limit = walk.ray.distance(walk.best.t);
    }
    while (walk.depth > 0 && walk.stack[walk.depth - 1].distance > walk.limit) --walk.depth;
    if (walk.depth == 0) return false;
    const std::int32_t next = walk.stack[walk.depth - 1].child;
    if (next >= 0) {
        prefetch(walk.tree->nodes() + next, sizeof(BoxTree::Node));
    } else {
        prefetch(walk.tree->blocks() + ~next, sizeof(TriangleRayTree::Block));
    }
    return true;
}

HWY_ATTR void hit_triangles(TriangleQuery* queries, std::size_t count) {
    // Walks in turn: while one waits for memory, the others compute.
    constexpr std::size_t kWalks = 8;
    Walk walks[kWalks];
    std::size_t next = 0, busy = 0;
    for (; busy < kWalks && next < count; ++busy, ++next) start(walks[busy], queries[next]);
    while (busy > 0) {
        for (std::size_t i = 0; i < busy; ++i) {
            if (advance(walks[i])) continue;
            walks[i].query->hit = walks[i].best ? walks[i].best : FirstHit{};
            if (next < count) {
                start(walks[i], queries[next++]);
            } else {
                walks[i] = walks[--busy];
                --i;
            }
        }
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sdf {

HWY_EXPORT(hit_triangles);

void hit_triangles(std::span<TriangleQuery> queries) {
    HWY_DYNAMIC_DISPATCH(hit_triangles)(queries.data(), queries.size());
}

}  // namespace sdf

#endif  // HWY_ONCE
