#include "sdf/surface_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/surface_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;

constexpr FloatTag kFloat;
constexpr IntTag kInt;

struct Vector {
    Floats x, y, z;
};

HWY_INLINE HWY_ATTR Floats dot(const Vector& a, const Vector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

HWY_INLINE HWY_ATTR Vector cross(const Vector& a, const Vector& b) {
    return {a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y};
}

/// a + s b
HWY_INLINE HWY_ATTR Vector along(const Vector& a, Floats s, const Vector& b) {
    return {a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

HWY_INLINE HWY_ATTR Floats unit_clamped(Floats x) {
    return hn::Min(hn::Max(x, hn::Zero(kFloat)), hn::Set(kFloat, 1.0f));
}

HWY_INLINE HWY_ATTR Floats ratio_or_zero(Floats a, Floats b) {
    return hn::IfThenElseZero(hn::Gt(b, hn::Zero(kFloat)), a / b);
}

struct ClosestLanes {
    Floats u, v, squared;
};

/// The closest points of triangles to points; p is the way from the first corner to the point. The nearest of
/// the three edges, unless the foot of the perpendicular lies inside.
HWY_INLINE HWY_ATTR ClosestLanes closest_on_triangles(const Vector& p, const Vector& ab, const Vector& ac) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f);
    const Floats d1 = dot(ab, p), d2 = dot(ac, p), a = dot(ab, ab), b = dot(ab, ac), c = dot(ac, ac);
    const auto squared_at = [&](Floats u, Floats v) HWY_ATTR {
        const Vector rest = along(along(p, zero - u, ab), zero - v, ac);
        return dot(rest, rest);
    };
    ClosestLanes best{unit_clamped(ratio_or_zero(d1, a)), zero, zero};
    best.squared = squared_at(best.u, best.v);
    const auto take = [&](auto mask, Floats u, Floats v, Floats squared) HWY_ATTR {
        best.u = hn::IfThenElse(mask, u, best.u);
        best.v = hn::IfThenElse(mask, v, best.v);
        best.squared = hn::IfThenElse(mask, squared, best.squared);
    };
    const Floats on_ac = unit_clamped(ratio_or_zero(d2, c)), squared_ac = squared_at(zero, on_ac);
    take(hn::Lt(squared_ac, best.squared), zero, on_ac, squared_ac);
    const Floats on_bc = unit_clamped(ratio_or_zero((d2 - b) - (d1 - a), (a - b) + (c - b)));
    const Floats squared_bc = squared_at(one - on_bc, on_bc);
    take(hn::Lt(squared_bc, best.squared), one - on_bc, on_bc, squared_bc);
    const Floats determinant = a * c - b * b;
    const Floats u = ratio_or_zero(c * d1 - b * d2, determinant),
                 v = ratio_or_zero(a * d2 - b * d1, determinant);
    const Floats squared_inside = squared_at(u, v);
    const auto inside = hn::And(hn::And(hn::Gt(u, zero), hn::Gt(v, zero)), hn::Lt(u + v, one));
    take(hn::And(inside, hn::Lt(squared_inside, best.squared)), u, v, squared_inside);
    return best;
}

constexpr int kCellWords = sizeof(CellSurface) / sizeof(std::int32_t);
constexpr int kTriangleWords = sizeof(VoxelTriangle) / sizeof(float);

HWY_INLINE HWY_ATTR void find_gradients(const SurfaceTable& table, SurfacePoints& points) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f), unit = hn::Set(kFloat, kGradientStep);
    const auto* words = reinterpret_cast<const std::int32_t*>(table.cells);
    for (std::size_t i = 0; i < points.size(); i += hn::Lanes(kFloat)) {
        const Ints first = hn::Load(kInt, &points.cell[i]) * hn::Set(kInt, kCellWords);
        const auto in_cell = [i](const core::Column<float>& at, const core::Column<float>& low) HWY_ATTR {
            return unit_clamped(hn::Load(kFloat, &at[i]) - hn::Load(kFloat, &low[i]));
        };
        const Floats fx = in_cell(points.x, points.cell_x), fy = in_cell(points.y, points.cell_y),
                     fz = in_cell(points.z, points.cell_z);
        const Floats gx = one - fx, gy = one - fy, gz = one - fz;
        Vector gradient{zero, zero, zero};
        for (int corner = 0; corner < 8; ++corner) {
            const Floats weight = (corner & 4 ? fx : gx) * (corner & 2 ? fy : gy) * (corner & 1 ? fz : gz);
            const Ints packed = hn::GatherIndex(kInt, words + corner, first);
            gradient.x = gradient.x + weight * hn::ConvertTo(kFloat, hn::ShiftRight<22>(packed));
            gradient.y =
                gradient.y + weight * hn::ConvertTo(kFloat, hn::ShiftRight<22>(hn::ShiftLeft<10>(packed)));
            gradient.z =
                gradient.z + weight * hn::ConvertTo(kFloat, hn::ShiftRight<22>(hn::ShiftLeft<20>(packed)));
        }
        hn::Store(gradient.x * unit, kFloat, &points.gradient_x[i]);
        hn::Store(gradient.y * unit, kFloat, &points.gradient_y[i]);
        hn::Store(gradient.z * unit, kFloat, &points.gradient_z[i]);
    }
}

/// Corners and sides of triangles, voxels.
struct TriangleLanes {
    Vector a, ab, ac;

    HWY_ATTR TriangleLanes(const SurfaceTable& table, Ints numbers) {
        const auto* words = reinterpret_cast<const float*>(table.triangles);
        const Ints first = numbers * hn::Set(kInt, kTriangleWords);
        const auto vector = [&](int number) HWY_ATTR {
            return Vector{hn::GatherIndex(kFloat, words + number, first),
                          hn::GatherIndex(kFloat, words + number + 1, first),
                          hn::GatherIndex(kFloat, words + number + 2, first)};
        };
        a = vector(0);
        ab = vector(3);
        ac = vector(6);
    }
};

/// Less than the squared distance of any triangle with a gap of the given number; rounding kept back.
HWY_INLINE HWY_ATTR Floats least_squared(Ints gap) {
    constexpr float kPart = 0.999f;
    const auto squared = [](float voxels) { return kPart * voxels * voxels; };
    const auto at_least = [&](int number) HWY_ATTR {
        return hn::RebindMask(kFloat, hn::Gt(gap, hn::Set(kInt, number - 1)));
    };
    Floats least = hn::Set(kFloat, -1.0f);
    for (int number = 1; number < 4; ++number) {
        least = hn::IfThenElse(at_least(number),
                               hn::Set(kFloat, squared(kGaps[static_cast<std::size_t>(number)])), least);
    }
    return least;
}

/// Measures the triangles of the given place in the cells' lists, and keeps those that are nearer than the
/// ones before; of equally close ones the lowest number. @param open crossings that look at that place, then
/// those that must look at the next
template <bool kFirst>
HWY_INLINE HWY_ATTR std::size_t measure_triangles(const SurfaceTable& table, SurfacePoints& points, int place,
                                                  std::int32_t* open, std::size_t count) {
    const Ints zero = hn::Zero(kInt);
    const auto* gradients = reinterpret_cast<const std::int32_t*>(table.cells) + place;
    const auto* lists = gradients + 8;
    std::size_t going_on = 0;
    for (std::size_t i = 0; i < count; i += hn::Lanes(kFloat)) {
        Ints point;
        if constexpr (kFirst) {
            point = hn::Iota(kInt, static_cast<std::int32_t>(i));
        } else {
            point = hn::Load(kInt, &open[i]);
        }
        const auto of_point = [&](auto tag, const auto& column) HWY_ATTR {
            if constexpr (kFirst)
                return hn::Load(tag, &column[i]);
            else
                return hn::GatherIndex(tag, column.data(), point);
        };
        const Ints first = of_point(kInt, points.cell) * hn::Set(kInt, kCellWords);
        const Ints number = hn::GatherIndex(kInt, lists, first);
        const auto is_named = hn::Not(hn::Lt(number, zero));
        const TriangleLanes triangle(table, hn::Max(number, zero));
        const Vector from{of_point(kFloat, points.x) - triangle.a.x,
                          of_point(kFloat, points.y) - triangle.a.y,
                          of_point(kFloat, points.z) - triangle.a.z};
        const ClosestLanes found = closest_on_triangles(from, triangle.ab, triangle.ac);
        Floats best;
        if constexpr (kFirst) {
            best = hn::IfThenElse(hn::RebindMask(kFloat, is_named), found.squared, hn::Set(kFloat, 1e30f));
            hn::Store(number, kInt, &points.triangle[i]);
            hn::Store(best, kFloat, &points.distance_squared[i]);
            hn::Store(found.u, kFloat, &points.u[i]);
            hn::Store(found.v, kFloat, &points.v[i]);
        } else {
            best = of_point(kFloat, points.distance_squared);
            const Ints best_number = of_point(kInt, points.triangle);
            const auto is_lower = hn::RebindMask(kFloat, hn::Lt(number, best_number));
            const auto nearer =
                hn::And(hn::RebindMask(kFloat, is_named),
                        hn::Or(hn::Lt(found.squared, best), hn::And(hn::Eq(found.squared, best), is_lower)));
            if (!hn::AllFalse(kFloat, nearer)) {
                best = hn::IfThenElse(nearer, found.squared, best);
                hn::ScatterIndex(best, kFloat, points.distance_squared.data(), point);
                const auto keep = [&](Floats value, core::Column<float>& column) HWY_ATTR {
                    hn::ScatterIndex(hn::IfThenElse(nearer, value, of_point(kFloat, column)), kFloat,
                                     column.data(), point);
                };
                keep(found.u, points.u);
                keep(found.v, points.v);
                hn::ScatterIndex(hn::IfThenElse(hn::RebindMask(kInt, nearer), number, best_number), kInt,
                                 points.triangle.data(), point);
            }
        }
        if (place == 7) continue;
        // Where the last vector is not full, its lanes beyond the end name nothing.
        const Ints next = hn::GatherIndex(kInt, lists + 1, first);
        const Ints gap = hn::And(hn::GatherIndex(kInt, gradients + 1, first), hn::Set(kInt, 3));
        const auto goes_on =
            hn::And(hn::Not(hn::Lt(next, zero)), hn::RebindMask(kInt, hn::Gt(best, least_squared(gap))));
        hn::StoreU(hn::Compress(point, goes_on), kInt, open + going_on);
        going_on += hn::CountTrue(kInt, goes_on);
    }
    return going_on;
}

HWY_INLINE HWY_ATTR void find_sides(const SurfaceTable& table, SurfacePoints& points) {
    for (std::size_t i = 0; i < points.size(); i += hn::Lanes(kFloat)) {
        const TriangleLanes triangle(table, hn::Max(hn::Load(kInt, &points.triangle[i]), hn::Zero(kInt)));
        const Vector direction{hn::Load(kFloat, &points.direction_x[i]),
                               hn::Load(kFloat, &points.direction_y[i]),
                               hn::Load(kFloat, &points.direction_z[i])};
        hn::Store(dot(direction, cross(triangle.ab, triangle.ac)), kFloat, &points.side[i]);
    }
}

HWY_ATTR void find_surface(const SurfaceTable& table, SurfacePoints& points) {
    find_gradients(table, points);
    // No lane waits for another whose cell names more triangles: the first triangles of all, the second ones
    // of those that have two, and so on.
    std::int32_t* open = points.work.data();
    std::size_t count = measure_triangles<true>(table, points, 0, open, points.size());
    for (int place = 1; count > 0; ++place) {
        // A crossing that is no one's fills the last vector up.
        for (std::size_t i = count; i % hn::Lanes(kFloat) != 0; ++i) {
            open[i] = static_cast<std::int32_t>(points.spare());
        }
        count = measure_triangles<false>(table, points, place, open, count);
    }
    find_sides(table, points);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <algorithm>
#include <cmath>

namespace sdf {

HWY_EXPORT(find_surface);

void find_surface(const SurfaceTable& table, SurfacePoints& points) {
    HWY_DYNAMIC_DISPATCH(find_surface)(table, points);
}

int stored_gap(double voxels) {
    int number = 0;
    while (number < 3 && voxels >= static_cast<double>(kGaps[static_cast<std::size_t>(number) + 1])) ++number;
    return number;
}

std::int32_t stored_gradient(const glm::dvec3& gradient) {
    const auto component = [](double value) {
        const double steps =
            std::clamp(std::round(value / static_cast<double>(kGradientStep)), -511.0, 511.0);
        return static_cast<std::uint32_t>(static_cast<std::int32_t>(steps)) & 0x3ffu;
    };
    return static_cast<std::int32_t>(component(gradient.x) << 22 | component(gradient.y) << 12 |
                                     component(gradient.z) << 2);
}

void SurfacePoints::set(std::size_t index, const MarchRay& ray, const MarchHit& hit) {
    x[index] = ray.origin[0] + hit.distance * ray.direction[0];
    y[index] = ray.origin[1] + hit.distance * ray.direction[1];
    z[index] = ray.origin[2] + hit.distance * ray.direction[2];
    direction_x[index] = ray.direction[0];
    direction_y[index] = ray.direction[1];
    direction_z[index] = ray.direction[2];
    cell_x[index] = hit.cell[0];
    cell_y[index] = hit.cell[1];
    cell_z[index] = hit.cell[2];
    cell[index] = hit.surface;
}

void SurfacePoints::resize(std::size_t count) {
    size_ = count;
    // One vector more than is filled: the spare crossing.
    const std::size_t padded = core::padded_stream_size(count), room = padded + core::kStreamLanes;
    const auto widen = [room](auto&... columns) {
        ((columns.size() < room ? columns.resize(room) : void()), ...);
    };
    widen(x, y, z, direction_x, direction_y, direction_z, cell_x, cell_y, cell_z, cell, gradient_x,
          gradient_y, gradient_z, triangle, u, v, distance_squared, side, work);
    for (std::size_t i = count; i < room; ++i) {
        x[i] = y[i] = z[i] = direction_x[i] = direction_y[i] = direction_z[i] = 0.0f;
        cell_x[i] = cell_y[i] = cell_z[i] = 0.0f;
        cell[i] = 0;
    }
}

}  // namespace sdf

#endif  // HWY_ONCE
