// sdf/cell_triangles.h: the triangles that a cell's samples name: what a crossing in that cell may stand for.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "core/scene/scene.h"
#include "sdf/brick_grid.h"
#include "sdf/triangle_bvh.h"

namespace sdf {

/// A point of one of a cell's triangles.
struct TriangleHit {
    int slot = -1;   ///< Into CellTriangles; < 0: none.
    double t = 0.0;  ///< Ray parameter, of a met triangle only.
    TrianglePoint point;
    double distance = 0.0;  ///< From the crossing, local units.

    explicit operator bool() const { return slot >= 0; }
};

/// The distinct closest triangles of a cell's eight corners, ascending, in local units.
class CellTriangles {
public:
    /// @param cell local coordinates within the brick
    CellTriangles(const core::Mesh& mesh, const Brick& brick, const glm::ivec3& cell);

    std::uint32_t index(const TriangleHit& hit) const { return indices_[static_cast<std::size_t>(hit.slot)]; }
    const Triangle& corners(const TriangleHit& hit) const {
        return corners_[static_cast<std::size_t>(hit.slot)];
    }

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

/// Whether the ray passes a triangle beyond the border of its sheet, where only the sheet's thickened rim
/// lies: it leaves the triangle's plane outside border edges alone, or outside the one that `closest` lies
/// on.
/// @param borders bits of find_border_edges for this triangle
bool passes_beyond_border(const Triangle& triangle, std::uint8_t borders, const TrianglePoint& closest,
                          const glm::dvec3& origin, const glm::dvec3& direction);

}  // namespace sdf
