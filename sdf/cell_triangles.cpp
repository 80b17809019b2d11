#include "sdf/cell_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sdf {

CellTriangles::CellTriangles(const core::Mesh& mesh, const Brick& brick, const glm::ivec3& cell) {
    for (int i = 0; i < 8; ++i) {
        const std::int32_t named = brick.triangle[static_cast<std::size_t>(
            Brick::index(cell.x + (i >> 2), cell.y + (i >> 1 & 1), cell.z + (i & 1)))];
        if (named < 0) continue;
        const auto index = static_cast<std::uint32_t>(named);
        const auto end = indices_.begin() + count_;
        if (std::find(indices_.begin(), end, index) == end) {
            indices_[static_cast<std::size_t>(count_++)] = index;
        }
    }
    std::sort(indices_.begin(), indices_.begin() + count_);
    for (int i = 0; i < count_; ++i) {
        const glm::uvec3& corner = mesh.triangles[indices_[static_cast<std::size_t>(i)]];
        corners_[static_cast<std::size_t>(i)] = {glm::dvec3(mesh.positions[corner.x]),
                                                 glm::dvec3(mesh.positions[corner.y]),
                                                 glm::dvec3(mesh.positions[corner.z])};
    }
}

TriangleHit CellTriangles::closest(const glm::dvec3& point) const {
    TriangleHit best;
    double best_squared = std::numeric_limits<double>::infinity();
    for (int i = 0; i < count_; ++i) {
        const TrianglePoint candidate = closest_point(corners_[static_cast<std::size_t>(i)], point);
        const glm::dvec3 offset = point - candidate.position;
        const double squared = glm::dot(offset, offset);
        if (squared < best_squared) {
            best_squared = squared;
            best.slot = i;
            best.point = candidate;
        }
    }
    best.distance = std::sqrt(best_squared);
    return best;
}

TriangleHit CellTriangles::first_met(const glm::dvec3& origin, const glm::dvec3& direction, double t_min,
                                     double t_max, const glm::dvec3& point, double reach) const {
    TriangleHit best;
    for (int i = 0; i < count_; ++i) {
        const Triangle& triangle = corners_[static_cast<std::size_t>(i)];
        const glm::dvec3 normal = glm::normalize(triangle.scaled_normal());
        if (!(std::abs(glm::dot(point - triangle.a, normal)) <= reach)) continue;
        const double t = intersect(triangle, origin, direction);
        if (!(t >= t_min && t <= t_max) || (best && t >= best.t)) continue;
        best.slot = i;
        best.t = t;
        // On the triangle, so that the closest point is the point itself.
        best.point = closest_point(triangle, origin + t * direction);
    }
    if (best) best.distance = glm::distance(best.point.position, point);
    return best;
}

bool passes_beyond_border(const Triangle& triangle, std::uint8_t borders, const TrianglePoint& closest,
                          const glm::dvec3& origin, const glm::dvec3& direction) {
    if (borders == 0) return false;
    const glm::dvec3 normal = triangle.scaled_normal();
    const double slope = glm::dot(direction, normal);
    const glm::dvec3 weights_of_closest(1.0 - closest.barycentrics.x - closest.barycentrics.y,
                                        closest.barycentrics.x, closest.barycentrics.y);
    unsigned touched = 0;
    for (int i = 0; i < 3; ++i) {
        if (weights_of_closest[i] <= 0.0) touched |= 1u << i;
    }
    // A ray in the sheet's own plane sees its edge, which has no extent.
    if (slope == 0.0) return (touched & borders) != 0;
    const glm::dvec3 point = origin + glm::dot(triangle.a - origin, normal) / slope * direction;
    const double inverse = 1.0 / glm::dot(normal, normal);
    const double second = glm::dot(glm::cross(point - triangle.a, triangle.c - triangle.a), normal) * inverse;
    const double third = glm::dot(glm::cross(triangle.b - triangle.a, point - triangle.a), normal) * inverse;
    const glm::dvec3 weights(1.0 - second - third, second, third);
    unsigned outside = 0;
    for (int i = 0; i < 3; ++i) {
        if (weights[i] < 0.0) outside |= 1u << i;
    }
    if (outside == 0) return false;
    return (outside & ~borders) == 0 || (outside & borders & touched) != 0;
}

}  // namespace sdf
