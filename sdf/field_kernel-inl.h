// sdf/field_kernel-inl.h: trilinear cells in the lanes of vectors, for the instruction set at hand. Included
// once for each by field_kernel.cpp alone.
#if defined(SDF_FIELD_KERNEL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SDF_FIELD_KERNEL_INL_H
#undef SDF_FIELD_KERNEL_INL_H
#else
#define SDF_FIELD_KERNEL_INL_H
#endif

#include <hwy/highway.h>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<FloatTag>;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;
using Mask = hn::Mask<FloatTag>;

constexpr FloatTag kFloat;
constexpr IntTag kInt;
constexpr std::size_t kMostLanes = HWY_MAX_BYTES / sizeof(float);

constexpr float kBlockCells = 7.0f;
/// Stands for the inverse of 0: a ray in a plane never comes to the next one.
constexpr float kHuge = 1e30f;

/// The eight corners of a cell, in steps of the samples.
struct Corners {
    Floats v000, v001, v010, v011, v100, v101, v110, v111;

    HWY_ATTR Floats at(Floats x, Floats y, Floats z) const {
        const Floats c00 = v000 + x * (v100 - v000), c01 = v001 + x * (v101 - v001);
        const Floats c10 = v010 + x * (v110 - v010), c11 = v011 + x * (v111 - v011);
        const Floats c0 = c00 + y * (c10 - c00), c1 = c01 + y * (c11 - c01);
        return c0 + z * (c1 - c0);
    }
};

/// The trilinear field along a segment of a cell, as a polynomial in [0, 1].
struct CubicLanes {
    Floats c0, c1, c2, c3;

    HWY_ATTR Floats at(Floats s) const { return c0 + s * (c1 + s * (c2 + s * c3)); }
    HWY_ATTR Floats slope(Floats s) const {
        return c1 + s * (hn::Set(kFloat, 2.0f) * c2 + s * (hn::Set(kFloat, 3.0f) * c3));
    }
};

HWY_INLINE HWY_ATTR CubicLanes cubic_along(const Corners& v, Floats ax, Floats ay, Floats az, Floats dx,
                                           Floats dy, Floats dz) {
    const Floats k0 = v.v000, kx = v.v100 - v.v000, ky = v.v010 - v.v000, kz = v.v001 - v.v000;
    const Floats kxy = v.v110 - v.v100 - ky, kxz = v.v101 - v.v100 - kz, kyz = v.v011 - v.v010 - kz;
    const Floats kxyz = v.v111 - v.v110 - (v.v101 - v.v100) - kyz;
    const Floats xy0 = ax * ay, xy1 = ax * dy + ay * dx, xy2 = dx * dy;
    const Floats xz0 = ax * az, xz1 = ax * dz + az * dx, xz2 = dx * dz;
    const Floats yz0 = ay * az, yz1 = ay * dz + az * dy, yz2 = dy * dz;
    return {k0 + kx * ax + ky * ay + kz * az + kxy * xy0 + kxz * xz0 + kyz * yz0 + kxyz * (xy0 * az),
            kx * dx + ky * dy + kz * dz + kxy * xy1 + kxz * xz1 + kyz * yz1 + kxyz * (xy1 * az + xy0 * dz),
            kxy * xy2 + kxz * xz2 + kyz * yz2 + kxyz * (xy2 * az + xy1 * dz), kxyz * (xy2 * dz)};
}

HWY_INLINE HWY_ATTR Mask is_negative(Floats value) {
    return hn::Lt(value, hn::Zero(kFloat));
}
HWY_INLINE HWY_ATTR Mask differ(Mask a, Mask b) {
    return hn::Xor(a, b);
}
HWY_INLINE HWY_ATTR Floats unit_clamped(Floats x) {
    return hn::Min(hn::Max(x, hn::Zero(kFloat)), hn::Set(kFloat, 1.0f));
}

HWY_INLINE HWY_ATTR std::uint64_t bits_of(Mask mask) {
    std::uint64_t bits = 0;
    hn::StoreMaskBits(kFloat, mask, reinterpret_cast<std::uint8_t*>(&bits));
    return bits;
}

/// A vector of three components.
struct Point {
    Floats x, y, z;
};

HWY_INLINE HWY_ATTR Point along(const Point& origin, const Point& direction, Floats s) {
    return {origin.x + s * direction.x, origin.y + s * direction.y, origin.z + s * direction.z};
}

/// The first place in [0, 1] where the cubic has another sign than the ray brings along.
/// @param found the lanes that have one
HWY_INLINE HWY_ATTR Floats first_root(const CubicLanes& cubic, Mask negative, Mask& found) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f);
    // Where the slope is zero the cubic turns; between those places it is monotonic. The form of the
    // quadratic's roots without cancellation (Press et al., "Numerical Recipes", section 5.6).
    const Floats a = hn::Set(kFloat, 3.0f) * cubic.c3, b = hn::Set(kFloat, 2.0f) * cubic.c2, c = cubic.c1;
    const Floats discriminant = b * b - hn::Set(kFloat, 4.0f) * a * c;
    const Floats root = hn::Sqrt(hn::IfThenElseZero(hn::Gt(discriminant, zero), discriminant));
    const Floats q = hn::Set(kFloat, -0.5f) * (b + hn::CopySign(root, b));
    const Floats r1 = q / a, r2 = c / q;
    const Mask turns = hn::Gt(discriminant, zero);
    const Floats e1 = hn::IfThenElseZero(hn::And(turns, hn::And(hn::Gt(r1, zero), hn::Lt(r1, one))), r1);
    const Floats e2 = hn::IfThenElseZero(hn::And(turns, hn::And(hn::Gt(r2, zero), hn::Lt(r2, one))), r2);
    const Floats first = hn::Min(e1, e2), second = hn::Max(e1, e2);
    const Floats at_first = cubic.at(first), at_second = cubic.at(second), at_end = cubic.at(one);
    const Mask in_first = differ(is_negative(at_first), negative);
    const Mask in_second = differ(is_negative(at_second), negative);
    const Mask in_third = differ(is_negative(at_end), negative);
    found = hn::Or(in_first, hn::Or(in_second, in_third));

    Floats low = hn::IfThenElse(in_first, zero, hn::IfThenElse(in_second, first, second));
    Floats high = hn::IfThenElse(in_first, first, hn::IfThenElse(in_second, second, one));
    const Floats at_low = hn::IfThenElse(in_first, cubic.c0, hn::IfThenElse(in_second, at_first, at_second));
    const Floats at_high = hn::IfThenElse(in_first, at_first, hn::IfThenElse(in_second, at_second, at_end));
    const Floats share = at_low / (at_low - at_high);
    const Mask usable = hn::And(hn::Ge(share, zero), hn::Le(share, one));
    Floats s = hn::IfThenElse(usable, low + share * (high - low), hn::Set(kFloat, 0.5f) * (low + high));
    constexpr int kIterations = 6;
    constexpr float kRootSteps = 0.01f;
    for (int i = 0; i < kIterations; ++i) {
        const Floats value = cubic.at(s);
        const Mask is_root = hn::Lt(hn::Abs(value), hn::Set(kFloat, kRootSteps));
        // Lanes without a crossing may never come to one.
        if (hn::AllTrue(kFloat, hn::Or(is_root, hn::Not(found)))) break;
        const Mask before = hn::Not(differ(is_negative(value), negative));
        low = hn::IfThenElse(before, s, low);
        high = hn::IfThenElse(before, high, s);
        const Floats newton = s - value / cubic.slope(s);
        const Mask inside = hn::And(hn::Ge(newton, low), hn::Le(newton, high));
        const Floats closer = hn::IfThenElse(inside, newton, hn::Set(kFloat, 0.5f) * (low + high));
        // At a double root the slope says nothing.
        s = hn::IfThenElse(is_root, s, closer);
    }
    return s;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#endif  // per target
