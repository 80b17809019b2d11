// sdf/sphere_trace.h: one ray through one grid, from surface crossing to surface crossing.
//
// Empty blocks are skipped by their rigorous bound; in bricks the ray walks cell by cell and solves the exact
// cubic of the trilinear field in occupied ones (Hansson-Soderlund, Evans, Akenine-Moller, "Ray Tracing of
// Signed Distance Function Grids", JCGT 2022; roots by splitting at the extrema instead of their closed
// forms). This is the scalar version, in double.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "sdf/brick_grid.h"
#include "sdf/distance.h"

namespace sdf {

/// A place where the field changes sign along a ray.
struct Crossing {
    double t = 0.0;         ///< Ray parameter.
    glm::ivec3 cell{0};     ///< Voxel coordinates of the cell's lowest corner.
    glm::dvec3 point{0.0};  ///< Position within the cell, each coordinate in [0, 1].
    std::int32_t brick = 0;
    bool enters_negative = true;  ///< From positive to negative values.
};

/// Walks a ray through a grid and stops at every crossing in turn. Cells meet without gaps: the value where a
/// ray leaves a cell is bitwise the value where it enters the next, so that no sign change goes unseen.
class RayMarch {
public:
    /// @param origin, direction in voxel coordinates; the direction has any length but 0
    /// @param t_min, t_max the part of the ray that counts, already clipped to the grid's traced box
    RayMarch(const BrickGrid& grid, const glm::dvec3& origin, const glm::dvec3& direction, double t_min,
             double t_max);

    /// Finds the next crossing in [t_min, t_max]; false once there is none left.
    bool next(Crossing& crossing);

    /// Cells and empty blocks visited so far.
    std::uint32_t steps() const { return steps_; }
    /// Whether the walk was given up at the step cap: twice the cells that a straight line can cross, and
    /// 256.
    bool is_exhausted() const { return steps_ >= step_cap_; }

private:
    void enter_cell(double t);
    void update_next_planes();
    /// Steps through the nearest face of the cell; false at the end of the ray or of the grid.
    bool leave_cell();
    /// Steps out of an empty block, or farther where its bound allows; false as above.
    bool skip_empty(const glm::ivec3& block, double bound_voxels);
    bool find_in_cell(const Brick& brick, const glm::ivec3& local, Crossing& crossing);
    int exit_axis() const;
    glm::dvec3 point_in_cell(double t, int snapped_axis, double snapped_value) const;

    const BrickGrid& grid_;
    glm::dvec3 origin_;
    glm::dvec3 direction_;
    glm::dvec3 inverse_;
    glm::ivec3 step_{0};
    glm::ivec3 cell_{0};
    glm::ivec3 cell_limit_{0};
    glm::dvec3 next_plane_t_{0.0};
    double speed_ = 1.0;  ///< Voxels a unit of t.
    double t_ = 0.0;      ///< Where the ray entered cell_.
    double t_end_ = 0.0;
    int entry_axis_ = -1;           ///< Axis of the face it came through; -1 if it starts within the cell.
    double resume_from_ = -1.0;     ///< Part of the cell's segment already searched; < 0: none.
    bool resume_negative_ = false;  ///< Sign just after the last crossing in this cell.
    bool is_done_ = false;
    std::uint32_t steps_ = 0;
    std::uint32_t step_cap_ = 0;
};

}  // namespace sdf
