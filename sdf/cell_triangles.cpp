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
            best.index = indices_[static_cast<std::size_t>(i)];
            best.corners = corners_[static_cast<std::size_t>(i)];
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
        best.index = indices_[static_cast<std::size_t>(i)];
        best.corners = triangle;
        best.t = t;
        // On the triangle, so that the closest point is the point itself.
        best.point = closest_point(triangle, origin + t * direction);
    }
    if (best) best.distance = glm::distance(best.point.position, point);
    return best;
}

PlanePassage pass_plane(const Triangle& triangle, const glm::dvec3& origin, const glm::dvec3& direction) {
    PlanePassage passage;
    const glm::dvec3 normal = triangle.scaled_normal();
    const double slope = glm::dot(direction, normal);
    if (slope == 0.0) {
        passage.point = origin;
        passage.beyond = 7;
        return passage;
    }
    passage.t = glm::dot(triangle.a - origin, normal) / slope;
    passage.point = origin + passage.t * direction;
    const double inverse = 1.0 / glm::dot(normal, normal);
    const glm::dvec3 offset = passage.point - triangle.a;
    const double second = glm::dot(glm::cross(offset, triangle.c - triangle.a), normal) * inverse;
    const double third = glm::dot(glm::cross(triangle.b - triangle.a, offset), normal) * inverse;
    if (1.0 - second - third < 0.0) passage.beyond |= 1;
    if (second < 0.0) passage.beyond |= 2;
    if (third < 0.0) passage.beyond |= 4;
    return passage;
}

}  // namespace sdf
