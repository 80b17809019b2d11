// sdf/cell_triangles.h: the triangles that a cell's samples name: what a crossing in that cell may stand for.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "core/scene/scene.h"
#include "sdf/brick_grid.h"
#include "sdf/triangle_bvh.h"

namespace sdf {

/// A point of one of a cell's triangles.
struct TriangleHit {
    std::uint32_t index = kNoTriangle;  ///< Into the mesh's triangles.
    Triangle corners;                   ///< Local units.
    TrianglePoint point;
    double t = 0.0;         ///< Ray parameter, of a met triangle only.
    double distance = 0.0;  ///< From the crossing, local units.

    explicit operator bool() const { return index != kNoTriangle; }
};

/// The distinct closest triangles of a cell's eight corners, ascending, in local units.
class CellTriangles {
public:
    /// @param cell local coordinates within the brick
    CellTriangles(const core::Mesh& mesh, const Brick& brick, const glm::ivec3& cell);

    /// The triangle closest to a point; the lowest number of equally near ones.
    TriangleHit closest(const glm::dvec3& point) const;

    /// The first triangle that the ray truly meets within [t_min, t_max], of those whose plane passes within
    /// `reach` of `point`.
    TriangleHit first_met(const glm::dvec3& origin, const glm::dvec3& direction, double t_min, double t_max,
                          const glm::dvec3& point, double reach) const;

private:
    int count_ = 0;
    std::array<std::uint32_t, 8> indices_{};
    std::array<Triangle, 8> corners_;
};

/// Where a ray meets a triangle's plane, against the triangle's edges.
struct PlanePassage {
    glm::dvec3 point{0.0};
    double t = 0.0;
    /// Bit 0, 1, 2 where the point lies beyond the edge opposite the first, second, third corner. All three
    /// for a ray in parallel to the plane.
    std::uint8_t beyond = 0;
};
PlanePassage pass_plane(const Triangle& triangle, const glm::dvec3& origin, const glm::dvec3& direction);

}  // namespace sdf
