// sdf/triangle_bvh.h: a bounding volume hierarchy over triangles, in double, for closest points and rays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "core/math/bounds.h"

namespace sdf {

/// A corner-by-corner triangle.
struct Triangle {
    glm::dvec3 a{0.0}, b{0.0}, c{0.0};

    /// Normal times twice the area.
    glm::dvec3 scaled_normal() const { return glm::cross(b - a, c - a); }
};

/// A point of a triangle.
struct TrianglePoint {
    glm::dvec3 position{0.0};
    glm::dvec2 barycentrics{0.0};  ///< Weights of the second and third vertex.
};

/// The point of a triangle closest to `point` (Ericson, "Real-Time Collision Detection", 2005, section
/// 5.1.5).
TrianglePoint closest_point(const Triangle& triangle, const glm::dvec3& point);

/// Ray parameter where the line origin + t direction meets the triangle, or NaN where it does not. Triangles
/// reach 1e-12 of their size beyond their edges, so that rounding opens no gap between neighbours.
double intersect(const Triangle& triangle, const glm::dvec3& origin, const glm::dvec3& direction);

inline constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();

/// A triangle of a mesh and how far it is.
struct ClosestTriangle {
    double distance_squared = std::numeric_limits<double>::infinity();
    std::uint32_t triangle = kNoTriangle;
};

/// The first triangle along a ray.
struct FirstHit {
    double t = std::numeric_limits<double>::infinity();
    std::uint32_t triangle = kNoTriangle;

    explicit operator bool() const { return triangle != kNoTriangle; }
};

/// The tree. Median splits, so its shape depends on the triangles alone.
class TriangleBvh {
public:
    /// @param mesh all triangles; @param selection those that the tree holds, as indices into `mesh`.
    TriangleBvh(std::span<const Triangle> mesh, std::span<const std::uint32_t> selection);

    /// The closest triangle, or `best` where nothing is nearer (at equal distance the lower index wins).
    ClosestTriangle closest(const glm::dvec3& point, ClosestTriangle best = {}) const;

    /// The first triangle that the ray meets in [t_min, t_max]; at equal t the lower index wins.
    FirstHit first_hit(const glm::dvec3& origin, const glm::dvec3& direction, double t_min,
                       double t_max) const;

    bool empty() const { return nodes_.empty(); }

    struct Node {
        core::DoubleBounds box;
        std::uint32_t first = 0;   ///< First entry of order().
        std::uint32_t count = 0;   ///< Entries under this node.
        std::uint32_t second = 0;  ///< Inner node: its second child (the first follows it). Leaf: 0.

        bool is_leaf() const { return second == 0; }
    };
    const std::vector<Node>& nodes() const { return nodes_; }
    std::size_t bytes() const;
    /// Triangles in leaf order.
    const std::vector<Triangle>& triangles() const { return triangles_; }

private:
    static constexpr std::uint32_t kLeafTriangles = 4;
    static constexpr int kMaxDepth = 64;

    void build(std::vector<core::DoubleBounds>& boxes, std::uint32_t begin, std::uint32_t end);

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> order_;
    std::vector<Triangle> triangles_;
};

}  // namespace sdf
