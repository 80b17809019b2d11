#include "sdf/triangle_bvh.h"

#include <algorithm>
#include <cmath>

namespace sdf {

namespace {

double squared_distance(const core::DoubleBounds& box, const glm::dvec3& point) {
    const glm::dvec3 outside = glm::max(glm::max(box.minimum - point, point - box.maximum), glm::dvec3(0.0));
    return glm::dot(outside, outside);
}

}  // namespace

TrianglePoint closest_point(const Triangle& triangle, const glm::dvec3& point) {
    const glm::dvec3 ab = triangle.b - triangle.a;
    const glm::dvec3 ac = triangle.c - triangle.a;
    const glm::dvec3 ap = point - triangle.a;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0.0 && d2 <= 0.0) return {triangle.a, {0.0, 0.0}};

    const glm::dvec3 bp = point - triangle.b;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0.0 && d4 <= d3) return {triangle.b, {1.0, 0.0}};

    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
        const double v = d1 / (d1 - d3);
        return {triangle.a + v * ab, {v, 0.0}};
    }

    const glm::dvec3 cp = point - triangle.c;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0.0 && d5 <= d6) return {triangle.c, {0.0, 1.0}};

    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
        const double w = d2 / (d2 - d6);
        return {triangle.a + w * ac, {0.0, w}};
    }

    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return {triangle.b + w * (triangle.c - triangle.b), {1.0 - w, w}};
    }

    const double scale = 1.0 / (va + vb + vc);
    const double v = vb * scale, w = vc * scale;
    return {triangle.a + v * ab + w * ac, {v, w}};
}

double intersect(const Triangle& triangle, const glm::dvec3& origin, const glm::dvec3& direction) {
    // Moller and Trumbore, "Fast, Minimum Storage Ray-Triangle Intersection", JGT 1997.
    constexpr double kMiss = std::numeric_limits<double>::quiet_NaN();
    constexpr double kEdgeSlack = 1e-12;
    const glm::dvec3 edge1 = triangle.b - triangle.a, edge2 = triangle.c - triangle.a;
    const glm::dvec3 p = glm::cross(direction, edge2);
    const double determinant = glm::dot(edge1, p);
    if (determinant == 0.0) return kMiss;
    const glm::dvec3 s = origin - triangle.a;
    const double u = glm::dot(s, p) / determinant;
    if (!(u >= -kEdgeSlack && u <= 1.0 + kEdgeSlack)) return kMiss;
    const glm::dvec3 q = glm::cross(s, edge1);
    const double v = glm::dot(direction, q) / determinant;
    if (!(v >= -kEdgeSlack && u + v <= 1.0 + kEdgeSlack)) return kMiss;
    return glm::dot(edge2, q) / determinant;
}

TriangleBvh::TriangleBvh(std::span<const Triangle> mesh, std::span<const std::uint32_t> selection)
    : order_(selection.begin(), selection.end()) {
    if (order_.empty()) return;
    std::vector<core::DoubleBounds> boxes(mesh.size());
    for (const std::uint32_t index : selection) {
        boxes[index].include(mesh[index].a);
        boxes[index].include(mesh[index].b);
        boxes[index].include(mesh[index].c);
    }
    nodes_.reserve(order_.size());
    build(boxes, 0, static_cast<std::uint32_t>(order_.size()));
    triangles_.reserve(order_.size());
    for (const std::uint32_t index : order_) triangles_.push_back(mesh[index]);
}

void TriangleBvh::build(std::vector<core::DoubleBounds>& boxes, std::uint32_t begin, std::uint32_t end) {
    const std::size_t index = nodes_.size();
    nodes_.emplace_back();
    core::DoubleBounds box, centers;
    for (std::uint32_t i = begin; i < end; ++i) {
        box.include(boxes[order_[i]]);
        centers.include(boxes[order_[i]].center());
    }
    nodes_[index].box = box;
    nodes_[index].first = begin;
    nodes_[index].count = end - begin;
    if (end - begin <= kLeafTriangles) return;

    const glm::dvec3 extent = centers.extent();
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : (extent.y >= extent.z ? 1 : 2);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t left, std::uint32_t right) {
                         const double l = boxes[left].minimum[axis] + boxes[left].maximum[axis];
                         const double r = boxes[right].minimum[axis] + boxes[right].maximum[axis];
                         return l != r ? l < r : left < right;
                     });
    build(boxes, begin, middle);
    nodes_[index].second = static_cast<std::uint32_t>(nodes_.size());
    build(boxes, middle, end);
}

ClosestTriangle TriangleBvh::closest(const glm::dvec3& point, ClosestTriangle best) const {
    if (nodes_.empty()) return best;
    struct Entry {
        std::uint32_t node;
        double distance_squared;
    };
    Entry stack[kMaxDepth];
    int depth = 0;
    stack[depth++] = {0, squared_distance(nodes_[0].box, point)};
    while (depth > 0) {
        const Entry entry = stack[--depth];
        // Not >=: an equally near triangle of a lower index still counts.
        if (entry.distance_squared > best.distance_squared) continue;
        const Node& node = nodes_[entry.node];
        if (node.is_leaf()) {
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                const glm::dvec3 offset = closest_point(triangles_[i], point).position - point;
                const double distance = glm::dot(offset, offset);
                if (distance < best.distance_squared ||
                    (distance == best.distance_squared && order_[i] < best.triangle)) {
                    best = {distance, order_[i]};
                }
            }
            continue;
        }
        const Entry first{entry.node + 1, squared_distance(nodes_[entry.node + 1].box, point)};
        const Entry second{node.second, squared_distance(nodes_[node.second].box, point)};
        const bool first_is_near = first.distance_squared <= second.distance_squared;
        stack[depth++] = first_is_near ? second : first;
        stack[depth++] = first_is_near ? first : second;
    }
    return best;
}

FirstHit TriangleBvh::first_hit(const glm::dvec3& origin, const glm::dvec3& direction, double t_min,
                                double t_max) const {
    FirstHit best;
    if (nodes_.empty()) return best;
    double nearest = t_max;
    std::uint32_t stack[kMaxDepth];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const std::uint32_t index = stack[--depth];
        const Node& node = nodes_[index];
        double near = t_min, far = nearest;
        bool missed = false;
        for (int axis = 0; axis < 3 && !missed; ++axis) {
            if (direction[axis] == 0.0) {
                missed = origin[axis] < node.box.minimum[axis] || origin[axis] > node.box.maximum[axis];
                continue;
            }
            const double a = (node.box.minimum[axis] - origin[axis]) / direction[axis];
            const double b = (node.box.maximum[axis] - origin[axis]) / direction[axis];
            near = std::max(near, std::min(a, b));
            far = std::min(far, std::max(a, b));
        }
        // Rounding of the slab test must not lose a triangle that lies in the box's face.
        if (missed || near > far + 1e-12 * (std::abs(far) + 1.0)) continue;
        if (!node.is_leaf()) {
            stack[depth++] = node.second;
            stack[depth++] = index + 1;
            continue;
        }
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const double t = intersect(triangles_[i], origin, direction);
            if (!(t >= t_min && t <= nearest)) continue;
            if (best && t == nearest && order_[i] > best.triangle) continue;
            nearest = t;
            best = {t, order_[i]};
        }
    }
    return best;
}

std::size_t TriangleBvh::bytes() const {
    return nodes_.capacity() * sizeof(Node) + order_.capacity() * sizeof(std::uint32_t) +
           triangles_.capacity() * sizeof(Triangle);
}

}  // namespace sdf
