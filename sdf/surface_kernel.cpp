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

/// Samples from a cell's first to its corner 4 x + 2 y + z.
constexpr int kCornerSample[] = {0, 1, 8, 9, 64, 65, 72, 73};

HWY_ATTR void find_surface(const SurfaceTable& table, SurfacePoints& points) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f);
    const Ints none = hn::Set(kInt, -1), no_entry = hn::Set(kInt, 0xffff);
    const auto* entries = reinterpret_cast<const std::int32_t*>(table.palette_entries);
    const auto* triangles = reinterpret_cast<const float*>(table.triangles);
    for (std::size_t i = 0; i < points.size(); i += hn::Lanes(kFloat)) {
        const Vector p{hn::Load(kFloat, &points.x[i]), hn::Load(kFloat, &points.y[i]),
                       hn::Load(kFloat, &points.z[i])};
        const Ints brick = hn::Load(kInt, &points.brick[i]);
        const Ints first = hn::ShiftLeft<9>(brick) + hn::Load(kInt, &points.first_sample[i]);
        const Floats fx = unit_clamped(p.x - hn::Load(kFloat, &points.cell_x[i])),
                     fy = unit_clamped(p.y - hn::Load(kFloat, &points.cell_y[i])),
                     fz = unit_clamped(p.z - hn::Load(kFloat, &points.cell_z[i]));
        const Floats gx = one - fx, gy = one - fy, gz = one - fz;
        const Ints palette_first = hn::GatherIndex(kInt, table.palette_first, brick);

        Vector gradient{zero, zero, zero};
        Ints entries_of[8];  // Of the corners.
        for (int corner = 0; corner < 8; ++corner) {
            const Ints sample = first + hn::Set(kInt, kCornerSample[corner]);
            const Floats weight = (corner & 4 ? fx : gx) * (corner & 2 ? fy : gy) * (corner & 1 ? fz : gz);
            const Ints packed = hn::GatherIndex(kInt, table.gradients, sample);
            gradient.x = gradient.x + weight * hn::ConvertTo(kFloat, hn::ShiftRight<22>(packed));
            gradient.y =
                gradient.y + weight * hn::ConvertTo(kFloat, hn::ShiftRight<22>(hn::ShiftLeft<10>(packed)));
            gradient.z =
                gradient.z + weight * hn::ConvertTo(kFloat, hn::ShiftRight<22>(hn::ShiftLeft<20>(packed)));
            if (corner & 1) continue;
            // Two entries along z in a word.
            const Ints pair = hn::GatherOffset(kInt, entries, hn::ShiftLeft<1>(sample));
            entries_of[corner] = hn::And(pair, no_entry);
            entries_of[corner + 1] = hn::And(hn::ShiftRight<16>(pair), no_entry);
        }

        // Every distinct triangle once, in ascending order: of equally close ones the first stays.
        Floats best_u = zero, best_v = zero, best_squared = hn::Set(kFloat, 1e30f);
        Ints best_triangle = none, entry = none;
        for (;;) {
            Ints next = no_entry;
            for (const Ints other : entries_of) {
                next = hn::IfThenElse(hn::And(hn::Gt(other, entry), hn::Lt(other, next)), other, next);
            }
            entry = next;
            const auto named = hn::Lt(entry, no_entry);
            if (hn::AllFalse(kInt, named)) break;
            const Ints triangle =
                hn::GatherIndex(kInt, table.palettes, hn::IfThenElseZero(named, palette_first + entry));
            // Nine floats a triangle.
            const Ints record = hn::ShiftLeft<3>(triangle) + triangle;
            const auto component = [&](int number) HWY_ATTR {
                return hn::GatherIndex(kFloat, triangles, record + hn::Set(kInt, number));
            };
            const Vector from{p.x - component(0), p.y - component(1), p.z - component(2)};
            const ClosestLanes found = closest_on_triangles(from, {component(3), component(4), component(5)},
                                                            {component(6), component(7), component(8)});
            const auto nearer = hn::And(named, hn::RebindMask(kInt, hn::Lt(found.squared, best_squared)));
            const auto nearer_float = hn::RebindMask(kFloat, nearer);
            best_triangle = hn::IfThenElse(nearer, triangle, best_triangle);
            best_u = hn::IfThenElse(nearer_float, found.u, best_u);
            best_v = hn::IfThenElse(nearer_float, found.v, best_v);
            best_squared = hn::IfThenElse(nearer_float, found.squared, best_squared);
        }
        const Floats unit = hn::Set(kFloat, kGradientStep);
        hn::Store(gradient.x * unit, kFloat, &points.gradient_x[i]);
        hn::Store(gradient.y * unit, kFloat, &points.gradient_y[i]);
        hn::Store(gradient.z * unit, kFloat, &points.gradient_z[i]);
        hn::Store(best_triangle, kInt, &points.triangle[i]);
        hn::Store(best_u, kFloat, &points.u[i]);
        hn::Store(best_v, kFloat, &points.v[i]);
        hn::Store(best_squared, kFloat, &points.distance_squared[i]);
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

void SurfacePoints::set(std::size_t index, const MarchRay& ray, const MarchHit& hit) {
    x[index] = ray.origin[0] + hit.distance * ray.direction[0];
    y[index] = ray.origin[1] + hit.distance * ray.direction[1];
    z[index] = ray.origin[2] + hit.distance * ray.direction[2];
    cell_x[index] = hit.cell[0];
    cell_y[index] = hit.cell[1];
    cell_z[index] = hit.cell[2];
    brick[index] = hit.brick;
    first_sample[index] =
        Brick::index(hit.cell[0] % kBrickCells, hit.cell[1] % kBrickCells, hit.cell[2] % kBrickCells);
}

void SurfacePoints::resize(std::size_t count) {
    size_ = count;
    const std::size_t padded = core::padded_stream_size(count);
    for (auto* column : {&x, &y, &z, &cell_x, &cell_y, &cell_z, &gradient_x, &gradient_y, &gradient_z, &u, &v,
                         &distance_squared}) {
        if (column->size() < padded) column->resize(padded);
    }
    for (auto* column : {&brick, &first_sample, &triangle}) {
        if (column->size() < padded) column->resize(padded);
    }
    for (std::size_t i = count; i < padded; ++i) {
        x[i] = y[i] = z[i] = cell_x[i] = cell_y[i] = cell_z[i] = 0.0f;
        brick[i] = first_sample[i] = 0;
    }
}

}  // namespace sdf

#endif  // HWY_ONCE
