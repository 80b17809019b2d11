#include "sdf/sphere_trace.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sdf/instance_tree.h"

namespace sdf {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Kept back from every skip, in voxels: more than the rounding of positions within a grid.
constexpr double kSkipMargin = 1e-6;

/// The trilinear field of a cell along the segment from `a` to `b`, as a polynomial in s in [0, 1].
struct Cubic {
    double c0, c1, c2, c3;

    Cubic(const CellCorners& corners, const glm::dvec3& a, const glm::dvec3& b) {
        const auto& v = corners.value;
        // f = k0 + kx x + ky y + kz z + kxy xy + kxz xz + kyz yz + kxyz xyz.
        const double k0 = v[0], kx = v[4] - v[0], ky = v[2] - v[0], kz = v[1] - v[0];
        const double kxy = v[6] - v[4] - ky, kxz = v[5] - v[4] - kz, kyz = v[3] - v[2] - kz;
        const double kxyz = v[7] - v[6] - (v[5] - v[4]) - kyz;
        const glm::dvec3 d = b - a;
        const double xy0 = a.x * a.y, xy1 = a.x * d.y + a.y * d.x, xy2 = d.x * d.y;
        const double xz0 = a.x * a.z, xz1 = a.x * d.z + a.z * d.x, xz2 = d.x * d.z;
        const double yz0 = a.y * a.z, yz1 = a.y * d.z + a.z * d.y, yz2 = d.y * d.z;
        c0 = k0 + kx * a.x + ky * a.y + kz * a.z + kxy * xy0 + kxz * xz0 + kyz * yz0 + kxyz * xy0 * a.z;
        c1 = kx * d.x + ky * d.y + kz * d.z + kxy * xy1 + kxz * xz1 + kyz * yz1 +
             kxyz * (xy1 * a.z + xy0 * d.z);
        c2 = kxy * xy2 + kxz * xz2 + kyz * yz2 + kxyz * (xy2 * a.z + xy1 * d.z);
        c3 = kxyz * xy2 * d.z;
    }

    double at(double s) const { return c0 + s * (c1 + s * (c2 + s * c3)); }
    double slope(double s) const { return c1 + s * (2.0 * c2 + s * 3.0 * c3); }

    /// Extrema in ascending order; returns how many.
    int extrema(double (&roots)[2]) const {
        const double a = 3.0 * c3, b = 2.0 * c2, c = c1;
        const double discriminant = b * b - 4.0 * a * c;
        if (!(discriminant > 0.0)) return 0;
        // The form without cancellation (Press et al., "Numerical Recipes", section 5.6).
        const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
        int count = 0;
        if (a != 0.0) roots[count++] = q / a;
        if (q != 0.0) roots[count++] = c / q;
        if (count == 2 && roots[0] > roots[1]) std::swap(roots[0], roots[1]);
        return count;
    }

    /// The root between low and high, where the field is monotonic and has different signs.
    double root(double low, double high, bool low_is_negative) const {
        constexpr double kTolerance = 1e-12;
        constexpr int kMostIterations = 60;
        const double low_value = at(low), high_value = at(high);
        double s = low_value / (low_value - high_value);
        s = s >= 0.0 && s <= 1.0 ? low + s * (high - low) : 0.5 * (low + high);
        for (int i = 0; i < kMostIterations && high - low > kTolerance; ++i) {
            const double value = at(s);
            if (value == 0.0) return s;
            ((value < 0.0) == low_is_negative ? low : high) = s;
            const double step = value / slope(s);
            const double newton = s - step;
            if (newton > low && newton < high) {
                if (std::abs(step) < kTolerance) return newton;
                s = newton;
            } else {
                s = 0.5 * (low + high);
            }
        }
        return s;
    }
};

/// The cell that holds a position, or the nearest in [first, last]. Compared before it is converted: a ray
/// through a far-away instance may be at 1e24 voxels, or nowhere at all (NaN: the first).
glm::ivec3 cell_within(const glm::dvec3& position, const glm::ivec3& first, const glm::ivec3& last) {
    glm::ivec3 cell = first;
    for (int axis = 0; axis < 3; ++axis) {
        if (position[axis] >= last[axis]) {
            cell[axis] = last[axis];
        } else if (position[axis] > first[axis]) {
            cell[axis] = static_cast<int>(position[axis]);
        }
    }
    return cell;
}

}  // namespace

RayMarch::RayMarch(const BrickGrid& grid, const glm::dvec3& origin, const glm::dvec3& direction, double t_min,
                   double t_max)
    : grid_(grid),
      origin_(origin),
      direction_(direction),
      inverse_(finite_inverse(direction)),
      t_end_(t_max) {
    cell_limit_ = glm::ivec3(grid.traced_voxels().empty() ? glm::dvec3(0.0) : grid.traced_voxels().maximum);
    is_done_ = !(t_min <= t_max) || cell_limit_.x == 0;
    if (is_done_) return;
    speed_ = glm::length(direction);
    for (int axis = 0; axis < 3; ++axis) step_[axis] = (direction[axis] > 0.0) - (direction[axis] < 0.0);
    step_cap_ = static_cast<std::uint32_t>(2 * (cell_limit_.x + cell_limit_.y + cell_limit_.z) + 256);
    enter_cell(t_min);
}

void RayMarch::enter_cell(double t) {
    t_ = t;
    entry_axis_ = -1;
    cell_ = cell_within(origin_ + t * direction_, glm::ivec3(0), cell_limit_ - 1);
    update_next_planes();
}

void RayMarch::update_next_planes() {
    for (int axis = 0; axis < 3; ++axis) {
        next_plane_t_[axis] =
            step_[axis] == 0 ? kInfinity : (cell_[axis] + (step_[axis] > 0) - origin_[axis]) * inverse_[axis];
    }
}

int RayMarch::exit_axis() const {
    const int xy = next_plane_t_.x <= next_plane_t_.y ? 0 : 1;
    return next_plane_t_[xy] <= next_plane_t_.z ? xy : 2;
}

glm::dvec3 RayMarch::point_in_cell(double t, int snapped_axis, double snapped_value) const {
    glm::dvec3 u = glm::clamp(origin_ + t * direction_ - glm::dvec3(cell_), 0.0, 1.0);
    if (snapped_axis >= 0) u[snapped_axis] = snapped_value;
    return u;
}

bool RayMarch::leave_cell() {
    const int axis = exit_axis();
    const double t = next_plane_t_[axis];
    if (!(t < t_end_)) return false;
    if (t > t_) t_ = t;
    cell_[axis] += step_[axis];
    if (cell_[axis] < 0 || cell_[axis] >= cell_limit_[axis]) return false;
    entry_axis_ = axis;
    next_plane_t_[axis] = (cell_[axis] + (step_[axis] > 0) - origin_[axis]) * inverse_[axis];
    return true;
}

bool RayMarch::skip_empty(const glm::ivec3& block, double bound_voxels) {
    double exit_t = kInfinity;
    int axis = 0;
    for (int i = 0; i < 3; ++i) {
        if (step_[i] == 0) continue;
        const double t = ((block[i] + (step_[i] > 0)) * kBrickCells - origin_[i]) * inverse_[i];
        if (t < exit_t) {
            exit_t = t;
            axis = i;
        }
    }
    const double safe_t = t_ + (bound_voxels - kSkipMargin) / speed_;
    if (safe_t > exit_t) {
        if (!(safe_t < t_end_)) return false;
        enter_cell(safe_t);
        return true;
    }
    if (!(exit_t < t_end_)) return false;
    if (exit_t > t_) t_ = exit_t;
    const glm::ivec3 first = block * kBrickCells;
    cell_ = cell_within(origin_ + t_ * direction_, first, glm::min(first + kBrickCells, cell_limit_) - 1);
    cell_[axis] = step_[axis] > 0 ? first[axis] + kBrickCells : first[axis] - 1;
    if (cell_[axis] < 0 || cell_[axis] >= cell_limit_[axis]) return false;
    entry_axis_ = axis;
    update_next_planes();
    return true;
}

bool RayMarch::find_in_cell(const Brick& brick, const glm::ivec3& local, Crossing& crossing) {
    const CellCorners corners = CellCorners::load(brick, local);
    const int axis = exit_axis();
    // The whole of the cell's segment, even if the ray ends within: its end must not touch the last bits of
    // a root, or equal surfaces would be found at unequal distances.
    const double t_exit = std::max(next_plane_t_[axis], t_);
    const glm::dvec3 near =
        point_in_cell(t_, entry_axis_, entry_axis_ >= 0 && step_[entry_axis_] > 0 ? 0.0 : 1.0);
    const glm::dvec3 far = point_in_cell(t_exit, axis, step_[axis] > 0 ? 1.0 : 0.0);

    double low = 0.0;
    bool low_is_negative = corners.at(near) < 0.0;
    if (resume_from_ >= 0.0) {
        low = resume_from_;
        low_is_negative = resume_negative_;
    }
    const bool far_is_negative = corners.at(far) < 0.0;
    const Cubic cubic(corners, near, far);
    double extrema[2];
    const int extremum_count = cubic.extrema(extrema);
    for (int i = 0; i <= extremum_count; ++i) {
        const bool is_last = i == extremum_count;
        const double high = is_last ? 1.0 : extrema[i];
        if (!is_last && !(high > low && high < 1.0)) continue;
        const bool high_is_negative = is_last ? far_is_negative : cubic.at(high) < 0.0;
        if (high_is_negative != low_is_negative) {
            const double s = cubic.root(low, high, low_is_negative);
            crossing.t = std::min(t_ + s * (t_exit - t_), t_exit);
            crossing.cell = cell_;
            crossing.point = glm::clamp(near + s * (far - near), 0.0, 1.0);
            crossing.enters_negative = high_is_negative;
            resume_from_ = s;
            resume_negative_ = high_is_negative;
            return true;
        }
        low = high;
    }
    return false;
}

bool RayMarch::next(Crossing& crossing) {
    while (!is_done_) {
        const glm::ivec3 block = cell_ / kBrickCells;
        const std::int32_t entry = grid_.entry(block);
        if (entry < 0) {
            if (++steps_ >= step_cap_) return false;
            is_done_ = !skip_empty(block, BrickGrid::empty_distance(entry));
            continue;
        }
        const Brick& brick = grid_.brick_at(entry);
        const glm::ivec3 first = block * kBrickCells;
        for (;;) {
            const glm::ivec3 local = cell_ - first;
            if (static_cast<unsigned>(local.x) >= kBrickCells ||
                static_cast<unsigned>(local.y) >= kBrickCells ||
                static_cast<unsigned>(local.z) >= kBrickCells) {
                break;
            }
            if (brick.is_occupied(local.x, local.y, local.z) && find_in_cell(brick, local, crossing)) {
                crossing.brick = entry;
                is_done_ = crossing.t > t_end_;
                return !is_done_;
            }
            resume_from_ = -1.0;
            if (++steps_ >= step_cap_) return false;
            if (!leave_cell()) {
                is_done_ = true;
                break;
            }
        }
    }
    return false;
}

}  // namespace sdf
