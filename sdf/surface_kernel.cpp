#include "sdf/surface_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/surface_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {

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

/// The closest point of each pair's triangle.
HWY_INLINE HWY_ATTR void measure_pairs(const SurfaceTable& table, SurfacePoints& points, std::size_t count) {
    const auto* triangles = reinterpret_cast<const float*>(table.triangles);
    SurfacePoints::Pairs& pairs = points.pairs;
    for (std::size_t i = 0; i < count; i += hn::Lanes(kFloat)) {
        const Ints point = hn::Load(kInt, &pairs.point[i]);
        const Ints record = hn::Load(kInt, &pairs.triangle[i]) * hn::Set(kInt, kTriangleWords);
        const auto component = [&](int number)
                                   HWY_ATTR { return hn::GatherIndex(kFloat, triangles + number, record); };
        const Vector from{hn::GatherIndex(kFloat, points.x.data(), point) - component(0),
                          hn::GatherIndex(kFloat, points.y.data(), point) - component(1),
                          hn::GatherIndex(kFloat, points.z.data(), point) - component(2)};
        const ClosestLanes found = closest_on_triangles(from, {component(3), component(4), component(5)},
                                                        {component(6), component(7), component(8)});
        hn::Store(found.u, kFloat, &pairs.u[i]);
        hn::Store(found.v, kFloat, &pairs.v[i]);
        hn::Store(found.squared, kFloat, &pairs.distance_squared[i]);
    }
}

HWY_ATTR void find_surface(const SurfaceTable& table, SurfacePoints& points) {
    // Every triangle that a crossing's cell names makes a pair, so that no lane waits for another's cell. By
    // the time they are measured, the triangles are in the cache.
    SurfacePoints::Pairs& pairs = points.pairs;
    std::size_t count = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (const std::int32_t triangle : table.cells[points.cell[i]].triangle) {
            if (triangle < 0) break;
            pairs.point[count] = static_cast<std::int32_t>(i);
            pairs.triangle[count] = triangle;
            ++count;
            const VoxelTriangle* record = &table.triangles[triangle];
            __builtin_prefetch(record);
            __builtin_prefetch(reinterpret_cast<const char*>(record + 1) - 1);
        }
    }
    for (std::size_t i = count; i % hn::Lanes(kFloat) != 0; ++i) {
        pairs.point[i] = 0;
        pairs.triangle[i] = 0;
    }
    find_gradients(table, points);
    measure_pairs(table, points, count);
    for (std::size_t i = 0; i < points.size(); ++i) {
        points.triangle[i] = -1;
        points.distance_squared[i] = 1e30f;
    }
    for (std::size_t k = 0; k < count; ++k) {
        // Ascending: of equally close ones the first stays.
        const auto i = static_cast<std::size_t>(pairs.point[k]);
        if (!(pairs.distance_squared[k] < points.distance_squared[i])) continue;
        points.distance_squared[i] = pairs.distance_squared[k];
        points.triangle[i] = pairs.triangle[k];
        points.u[i] = pairs.u[k];
        points.v[i] = pairs.v[k];
    }
}

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

std::int32_t stored_gradient(const glm::dvec3& gradient) {
    const auto component = [](double value) {
        const double steps =
            std::clamp(std::round(value / static_cast<double>(kGradientStep)), -511.0, 511.0);
        return static_cast<std::uint32_t>(static_cast<std::int32_t>(steps)) & 0x3ffu;
    };
    return static_cast<std::int32_t>(component(gradient.x) << 22 | component(gradient.y) << 12 |
                                     component(gradient.z) << 2);
}

std::int32_t surface_cell(const SurfaceTable& table, const MarchHit& hit) {
    const BrickCells& cells = table.bricks[hit.brick];
    const int x = hit.cell[0] % kBrickCells, y = hit.cell[1] % kBrickCells, z = hit.cell[2] % kBrickCells;
    // A crossing in the very face of a cell may be seen from the empty one beyond it: all that lie below or
    // at it have been counted, and one of them is next to it.
    const int last =
        std::max(cells.before[kBrickCells - 1] + std::popcount(cells.occupied[kBrickCells - 1]) - 1, 0);
    return cells.first + std::min(cells.rank(x, y, z), last);
}

void SurfacePoints::set(const SurfaceTable& table, std::size_t index, const MarchRay& ray,
                        const MarchHit& hit) {
    x[index] = ray.origin[0] + hit.distance * ray.direction[0];
    y[index] = ray.origin[1] + hit.distance * ray.direction[1];
    z[index] = ray.origin[2] + hit.distance * ray.direction[2];
    cell_x[index] = hit.cell[0];
    cell_y[index] = hit.cell[1];
    cell_z[index] = hit.cell[2];
    cell[index] = surface_cell(table, hit);
    __builtin_prefetch(&table.cells[cell[index]]);
}

void SurfacePoints::resize(std::size_t count) {
    size_ = count;
    const std::size_t padded = core::padded_stream_size(count);
    const auto widen = [](std::size_t size, auto&... columns) {
        ((columns.size() < size ? columns.resize(size) : void()), ...);
    };
    widen(padded, x, y, z, cell_x, cell_y, cell_z, cell, gradient_x, gradient_y, gradient_z, triangle, u, v,
          distance_squared);
    const std::size_t most_pairs = core::padded_stream_size(8 * count);
    widen(most_pairs, pairs.point, pairs.triangle, pairs.u, pairs.v, pairs.distance_squared);
    for (std::size_t i = count; i < padded; ++i) {
        x[i] = y[i] = z[i] = cell_x[i] = cell_y[i] = cell_z[i] = 0.0f;
        cell[i] = 0;
    }
}

}  // namespace sdf

#endif  // HWY_ONCE
