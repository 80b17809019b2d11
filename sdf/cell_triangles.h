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
    double distance = 0.0;  ///< From the crossing, local units.

    explicit operator bool() const { return index != kNoTriangle; }
};

/// The distinct closest triangles of a cell's eight corners, ascending, in local units.
class CellTriangles {
public:
    /// @param cell local coordinates within the brick
    CellTriangles(const core::Mesh& mesh, const BrickGrid& grid, const Brick& brick, const glm::ivec3& cell);

    /// The triangle closest to a point; the lowest number of equally near ones.
    TriangleHit closest(const glm::dvec3& point) const;

private:
    int count_ = 0;
    std::array<std::uint32_t, 8> indices_{};
    std::array<Triangle, 8> corners_;
};

}  // namespace sdf
