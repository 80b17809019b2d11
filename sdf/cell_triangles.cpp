#include "sdf/cell_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sdf {

CellTriangles::CellTriangles(const core::Mesh& mesh, const BrickGrid& grid, const Brick& brick,
                             const glm::ivec3& cell) {
    for (int i = 0; i < 8; ++i) {
        const std::uint32_t index =
            grid.triangle(brick, Brick::index(cell.x + (i >> 2), cell.y + (i >> 1 & 1), cell.z + (i & 1)));
        if (index == kNoTriangle) continue;
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

}  // namespace sdf
