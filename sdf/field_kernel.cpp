#include "sdf/field_kernel.h"

#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/field_kernel.cpp"
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
using Mask = hn::Mask<FloatTag>;

constexpr FloatTag kFloat;
constexpr IntTag kInt;
constexpr std::size_t kMostLanes = HWY_MAX_BYTES / sizeof(float);

constexpr float kBlockCells = 7.0f;
/// Bytes from a sample to its neighbours along y and x, and from brick to brick.
constexpr int kSampleBytesY = 16, kSampleBytesX = 128, kLogBrickBytes = 10;
/// Distances on the lattice change by at most 1 a voxel, but those between samples by up to sqrt(3).
constexpr float kSafePart = 0.57735f;
/// Kept back from every step, in voxels: more than positions round within 4096 of them.
constexpr float kStepMargin = 1e-3f;
constexpr float kHuge = 1e30f;

/// The rays that the lanes of one vector work on. In memory: refilling a lane is a few stores.
struct alignas(64) Packet {
    float ox[kMostLanes], oy[kMostLanes], oz[kMostLanes];
    float dx[kMostLanes], dy[kMostLanes], dz[kMostLanes];
    float ix[kMostLanes], iy[kMostLanes], iz[kMostLanes];
    float length[kMostLanes];
    float count_x[kMostLanes], count_y[kMostLanes], count_z[kMostLanes];
    std::int32_t top_base[kMostLanes], stride_x[kMostLanes], stride_y[kMostLanes];
    // What changes as the ray goes on.
    float s[kMostLanes];
    float cx[kMostLanes], cy[kMostLanes], cz[kMostLanes];
    float sign[kMostLanes];  ///< +1 or -1 once the ray has come to a brick; 0 before.
    std::int32_t steps[kMostLanes];
    std::int32_t cap[kMostLanes];
    std::uint32_t ray[kMostLanes];
    bool busy[kMostLanes];
    // What the last step found.
    float hit_s[kMostLanes];
    std::int32_t brick[kMostLanes];
};

/// The eight corners of a cell, in steps of the samples.
struct Corners {
    Floats v000, v001, v010, v011, v100, v101, v110, v111;

    HWY_ATTR Floats at(Floats x, Floats y, Floats z) const {
        const Floats one = hn::Set(kFloat, 1.0f);
        const Floats rx = one - x, ry = one - y, rz = one - z;
        const Floats c00 = rx * v000 + x * v100, c01 = rx * v001 + x * v101;
        const Floats c10 = rx * v010 + x * v110, c11 = rx * v011 + x * v111;
        const Floats c0 = ry * c00 + y * c10, c1 = ry * c01 + y * c11;
        return rz * c0 + z * c1;
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
    constexpr int kIterations = 4;
    for (int i = 0; i < kIterations; ++i) {
        const Floats value = cubic.at(s);
        const Mask before = hn::Not(differ(is_negative(value), negative));
        low = hn::IfThenElse(before, s, low);
        high = hn::IfThenElse(before, high, s);
        const Floats newton = s - value / cubic.slope(s);
        const Mask inside = hn::And(hn::Ge(newton, low), hn::Le(newton, high));
        s = hn::IfThenElse(inside, newton, hn::Set(kFloat, 0.5f) * (low + high));
    }
    return s;
}

/// Takes one step with every lane. Lanes that end are marked in the result: hit, or gone.
struct StepResult {
    Mask hit, gone, exhausted;
};

template <HitMode kMode>
HWY_INLINE HWY_ATTR StepResult step(const FieldTable& fields, Packet& p) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f), seven = hn::Set(kFloat, kBlockCells);
    const Floats cx = hn::Load(kFloat, p.cx), cy = hn::Load(kFloat, p.cy), cz = hn::Load(kFloat, p.cz);
    const Floats ox = hn::Load(kFloat, p.ox), oy = hn::Load(kFloat, p.oy), oz = hn::Load(kFloat, p.oz);
    const Floats dx = hn::Load(kFloat, p.dx), dy = hn::Load(kFloat, p.dy), dz = hn::Load(kFloat, p.dz);
    const Floats s = hn::Load(kFloat, p.s);

    const Floats seventh = hn::Set(kFloat, 1.0f / kBlockCells), half = hn::Set(kFloat, 0.5f);
    const Floats bx = hn::Floor((cx + half) * seventh), by = hn::Floor((cy + half) * seventh),
                 bz = hn::Floor((cz + half) * seventh);
    const Floats block_x = bx * seven, block_y = by * seven, block_z = bz * seven;
    const Ints top_index = hn::ConvertTo(kInt, bx) * hn::Load(kInt, p.stride_x) +
                           hn::ConvertTo(kInt, by) * hn::Load(kInt, p.stride_y) +
                           (hn::ConvertTo(kInt, bz) + hn::Load(kInt, p.top_base));
    const Ints entry = hn::GatherIndex(kInt, fields.top, top_index);
    const auto is_empty_int = hn::Lt(entry, hn::Zero(kInt));
    const Mask is_empty = hn::RebindMask(kFloat, is_empty_int);

    // The region that has one answer: the whole block where it is empty, else the cell.
    const Floats low_x = hn::IfThenElse(is_empty, block_x, cx), low_y = hn::IfThenElse(is_empty, block_y, cy),
                 low_z = hn::IfThenElse(is_empty, block_z, cz);
    const Floats size = hn::IfThenElse(is_empty, seven, one);
    const Mask up_x = hn::Ge(dx, zero), up_y = hn::Ge(dy, zero), up_z = hn::Ge(dz, zero);
    const Floats plane_x = low_x + hn::IfThenElseZero(up_x, size),
                 plane_y = low_y + hn::IfThenElseZero(up_y, size),
                 plane_z = low_z + hn::IfThenElseZero(up_z, size);
    const Floats exit_x = (plane_x - ox) * hn::Load(kFloat, p.ix),
                 exit_y = (plane_y - oy) * hn::Load(kFloat, p.iy),
                 exit_z = (plane_z - oz) * hn::Load(kFloat, p.iz);
    const Floats exit = hn::Max(s, hn::Min(exit_x, hn::Min(exit_y, exit_z)));

    Floats reach =
        hn::ConvertTo(kFloat, hn::Zero(kInt) - (entry + hn::Set(kInt, 1))) * hn::Set(kFloat, 1.0f / 64.0f);
    const Mask no_lane = hn::Lt(zero, zero);
    StepResult result{no_lane, no_lane, no_lane};
    if (!hn::AllTrue(kFloat, is_empty)) {
        const Floats in_brick =
            ((cx - block_x) * hn::Set(kFloat, 64.0f) + (cy - block_y) * hn::Set(kFloat, 8.0f)) +
            (cz - block_z);
        const Ints offset =
            hn::IfThenZeroElse(is_empty_int, hn::ShiftLeft<kLogBrickBytes>(entry) +
                                                 hn::ShiftLeft<1>(hn::ConvertTo(kInt, in_brick)));
        // Two samples along z in a word.
        const auto* base = reinterpret_cast<const std::int32_t*>(fields.samples);
        const Ints w00 = hn::GatherOffset(kInt, base, offset);
        const Ints w01 = hn::GatherOffset(kInt, base, offset + hn::Set(kInt, kSampleBytesY));
        const Ints w10 = hn::GatherOffset(kInt, base, offset + hn::Set(kInt, kSampleBytesX));
        const Ints w11 = hn::GatherOffset(kInt, base, offset + hn::Set(kInt, kSampleBytesX + kSampleBytesY));
        const auto low_half = [](Ints word) HWY_ATTR {
            return hn::ConvertTo(kFloat, hn::ShiftRight<16>(hn::ShiftLeft<16>(word)));
        };
        const auto high_half = [](Ints word)
                                   HWY_ATTR { return hn::ConvertTo(kFloat, hn::ShiftRight<16>(word)); };
        const Corners corners{low_half(w00), high_half(w00), low_half(w01), high_half(w01),
                              low_half(w10), high_half(w10), low_half(w11), high_half(w11)};
        const Floats ux = hn::Min(hn::Max(ox + s * dx - cx, zero), one),
                     uy = hn::Min(hn::Max(oy + s * dy - cy, zero), one),
                     uz = hn::Min(hn::Max(oz + s * dz - cz, zero), one);
        const Floats value = corners.at(ux, uy, uz);
        const Floats old_sign = hn::Load(kFloat, p.sign);
        const Floats sign_here = hn::CopySign(one, value);
        const Mask sign_unknown = hn::Eq(old_sign, zero);
        const Floats sign =
            hn::IfThenElse(is_empty, old_sign, hn::IfThenElse(sign_unknown, sign_here, old_sign));
        hn::Store(sign, kFloat, p.sign);
        const Mask negative = is_negative(sign);

        // Bits 15 and 31 are the signs of a word's two samples.
        const Ints signs = hn::Set(kInt, static_cast<std::int32_t>(0x80008000u));
        const Ints any_negative = hn::And(hn::Or(hn::Or(w00, w01), hn::Or(w10, w11)), signs);
        const Ints all_negative = hn::And(hn::And(hn::And(w00, w01), hn::And(w10, w11)), signs);
        const auto none = hn::Eq(any_negative, hn::Zero(kInt));
        const auto all = hn::Eq(all_negative, signs);
        const Mask uniform = hn::RebindMask(kFloat, hn::Or(none, all));
        const Mask in_cell = hn::Not(is_empty);
        // A cell of one sign that is not the ray's: the change lay in the face, and rounding hid it.
        const Mask past = hn::And(in_cell, hn::And(uniform, differ(hn::RebindMask(kFloat, all), negative)));
        const Mask mixed = hn::AndNot(uniform, in_cell);

        const Floats step_voxels = hn::Set(kFloat, kSampleStepVoxels);
        const Floats part = (exit - s);
        Floats hit_s = s;
        Mask hit = past;
        if constexpr (kMode == HitMode::kCubic) {
            if (!hn::AllFalse(kFloat, mixed)) {
                const Floats fx = hn::Min(hn::Max(ux + part * dx, zero), one),
                             fy = hn::Min(hn::Max(uy + part * dy, zero), one),
                             fz = hn::Min(hn::Max(uz + part * dz, zero), one);
                Mask found;
                const CubicLanes cubic = cubic_along(corners, ux, uy, uz, fx - ux, fy - uy, fz - uz);
                const Floats root = first_root(cubic, negative, found);
                found = hn::And(found, mixed);
                hit_s = hn::IfThenElse(found, s + root * part, hit_s);
                hit = hn::Or(hit, found);
            }
        } else if constexpr (kMode == HitMode::kSecant) {
            if (!hn::AllFalse(kFloat, mixed)) {
                const Floats fx = hn::Min(hn::Max(ux + part * dx, zero), one),
                             fy = hn::Min(hn::Max(uy + part * dy, zero), one),
                             fz = hn::Min(hn::Max(uz + part * dz, zero), one);
                const Floats gx = fx - ux, gy = fy - uy, gz = fz - uz;
                const Floats far_value = corners.at(fx, fy, fz);
                const Mask near_found = differ(is_negative(value), negative);
                const Mask found =
                    hn::And(mixed, hn::Or(near_found, differ(is_negative(far_value), negative)));
                Floats low = zero, high = one, at_low = value, at_high = far_value, root = zero;
                constexpr int kFalsePositions = 3;
                for (int i = 0; i < kFalsePositions; ++i) {
                    root = low + (high - low) * (at_low / (at_low - at_high));
                    if (i + 1 == kFalsePositions) break;
                    const Floats at_root = corners.at(ux + root * gx, uy + root * gy, uz + root * gz);
                    const Mask before = hn::Not(differ(is_negative(at_root), negative));
                    low = hn::IfThenElse(before, root, low);
                    at_low = hn::IfThenElse(before, at_root, at_low);
                    high = hn::IfThenElse(before, high, root);
                    at_high = hn::IfThenElse(before, at_high, at_root);
                }
                root = hn::IfThenElse(near_found, zero, root);
                hit_s = hn::IfThenElse(found, s + root * part, hit_s);
                hit = hn::Or(hit, found);
            }
        } else {
            // Distance to the surface ahead; the slope tells whether the ray comes nearer at all.
            const Floats ahead = value * sign;
            const Mask near = hn::And(in_cell, hn::Lt(ahead * step_voxels, hn::Set(kFloat, kHitEpsVoxels)));
            if (!hn::AllFalse(kFloat, near)) {
                const Floats look = hn::Set(kFloat, 0.25f);
                const Floats later = corners.at(ux + look * dx, uy + look * dy, uz + look * dz) * sign;
                const Mask closing = hn::Lt(later, ahead);
                const Floats further = look * ahead / (ahead - later);
                const Mask found = hn::Or(hn::And(hn::And(near, closing), hn::Lt(further, one)),
                                          hn::And(near, hn::Lt(ahead, zero)));
                hit_s = hn::IfThenElse(found, s + hn::Max(zero, hn::Min(further, one)), hit_s);
                hit = hn::Or(hit, found);
            }
        }
        hit = hn::And(hit, hn::Le(hit_s, hn::Load(kFloat, p.length)));
        result.hit = hit;
        hn::Store(hit_s, kFloat, p.hit_s);
        hn::Store(entry, kInt, p.brick);
        Floats safe = hn::Abs(value) * (step_voxels * hn::Set(kFloat, kSafePart));
        if constexpr (kMode != HitMode::kEps) safe = hn::IfThenElseZero(uniform, safe);
        reach = hn::IfThenElse(is_empty, reach, safe);
    }

    // On, as far as nothing can be met.
    const Floats safe_s = s + (reach - hn::Set(kFloat, kStepMargin));
    const Mask jumps = hn::Gt(safe_s, exit);
    const Floats next = hn::IfThenElse(jumps, safe_s, exit);
    const Floats px = hn::Floor(ox + next * dx), py = hn::Floor(oy + next * dy),
                 pz = hn::Floor(oz + next * dz);
    const Floats count_x = hn::Load(kFloat, p.count_x), count_y = hn::Load(kFloat, p.count_y),
                 count_z = hn::Load(kFloat, p.count_z);
    const Floats from_x = hn::IfThenZeroElse(jumps, low_x), from_y = hn::IfThenZeroElse(jumps, low_y),
                 from_z = hn::IfThenZeroElse(jumps, low_z);
    const Floats to_x = hn::IfThenElse(jumps, count_x, low_x + size) - one,
                 to_y = hn::IfThenElse(jumps, count_y, low_y + size) - one,
                 to_z = hn::IfThenElse(jumps, count_z, low_z + size) - one;
    Floats next_x = hn::Min(hn::Max(px, from_x), to_x), next_y = hn::Min(hn::Max(py, from_y), to_y),
           next_z = hn::Min(hn::Max(pz, from_z), to_z);
    // Through a face: the neighbour across it, by number and not by position.
    const Mask across_x = hn::AndNot(jumps, hn::And(hn::Le(exit_x, exit_y), hn::Le(exit_x, exit_z)));
    const Mask across_y = hn::AndNot(hn::Or(jumps, across_x), hn::Le(exit_y, exit_z));
    const Mask across_z = hn::AndNot(hn::Or(jumps, hn::Or(across_x, across_y)), hn::Eq(zero, zero));
    next_x = hn::IfThenElse(across_x, hn::IfThenElse(up_x, low_x + size, low_x - one), next_x);
    next_y = hn::IfThenElse(across_y, hn::IfThenElse(up_y, low_y + size, low_y - one), next_y);
    next_z = hn::IfThenElse(across_z, hn::IfThenElse(up_z, low_z + size, low_z - one), next_z);

    const Ints steps = hn::Load(kInt, p.steps) + hn::Set(kInt, 1);
    hn::Store(steps, kInt, p.steps);
    const Mask inside = hn::And(hn::And(hn::Ge(next_x, zero), hn::Lt(next_x, count_x)),
                                hn::And(hn::And(hn::Ge(next_y, zero), hn::Lt(next_y, count_y)),
                                        hn::And(hn::Ge(next_z, zero), hn::Lt(next_z, count_z))));
    const Mask on = hn::And(inside, hn::Lt(next, hn::Load(kFloat, p.length)));
    result.gone = hn::AndNot(result.hit, hn::Not(on));
    result.exhausted = hn::AndNot(hn::Or(result.hit, result.gone),
                                  hn::RebindMask(kFloat, hn::Gt(steps, hn::Load(kInt, p.cap))));
    // A hit keeps its cell.
    const Mask moves = hn::Not(result.hit);
    hn::Store(hn::IfThenElse(moves, next, s), kFloat, p.s);
    hn::Store(hn::IfThenElse(moves, next_x, cx), kFloat, p.cx);
    hn::Store(hn::IfThenElse(moves, next_y, cy), kFloat, p.cy);
    hn::Store(hn::IfThenElse(moves, next_z, cz), kFloat, p.cz);
    return result;
}

/// Gives a lane its next ray.
HWY_INLINE HWY_ATTR void load_lane(Packet& p, std::size_t lane, const MarchRay& ray, std::uint32_t number) {
    const auto inverse = [](float d) { return d == 0.0f ? kHuge : 1.0f / d; };
    p.ox[lane] = ray.origin[0];
    p.oy[lane] = ray.origin[1];
    p.oz[lane] = ray.origin[2];
    p.dx[lane] = ray.direction[0];
    p.dy[lane] = ray.direction[1];
    p.dz[lane] = ray.direction[2];
    p.ix[lane] = inverse(ray.direction[0]);
    p.iy[lane] = inverse(ray.direction[1]);
    p.iz[lane] = inverse(ray.direction[2]);
    p.length[lane] = ray.length;
    p.count_x[lane] = ray.cell_count[0];
    p.count_y[lane] = ray.cell_count[1];
    p.count_z[lane] = ray.cell_count[2];
    p.top_base[lane] = ray.top_base;
    p.stride_x[lane] = ray.top_stride_x;
    p.stride_y[lane] = ray.top_stride_y;
    p.s[lane] = 0.0f;
    const auto cell = [](float position, float count) {
        const auto whole = static_cast<float>(static_cast<std::int32_t>(position));
        return whole < count ? whole : count - 1.0f;
    };
    p.cx[lane] = cell(ray.origin[0], ray.cell_count[0]);
    p.cy[lane] = cell(ray.origin[1], ray.cell_count[1]);
    p.cz[lane] = cell(ray.origin[2], ray.cell_count[2]);
    p.sign[lane] = 0.0f;
    p.steps[lane] = 0;
    p.cap[lane] = static_cast<std::int32_t>(
        2.0f * (ray.cell_count[0] + ray.cell_count[1] + ray.cell_count[2]) + 256.0f);
    p.ray[lane] = number;
    p.busy[lane] = true;
}

/// A lane without a ray: it stands in the first block of whatever its last ray was in and never ends.
HWY_INLINE HWY_ATTR void idle_lane(Packet& p, std::size_t lane) {
    p.ox[lane] = p.oy[lane] = p.oz[lane] = 0.0f;
    p.dx[lane] = p.dy[lane] = p.dz[lane] = 0.0f;
    p.ix[lane] = p.iy[lane] = p.iz[lane] = kHuge;
    p.length[lane] = kHuge;
    p.count_x[lane] = p.count_y[lane] = p.count_z[lane] = kHuge;
    p.top_base[lane] = p.stride_x[lane] = p.stride_y[lane] = 0;
    p.s[lane] = p.cx[lane] = p.cy[lane] = p.cz[lane] = 0.0f;
    p.sign[lane] = 1.0f;
    p.steps[lane] = 0;
    p.cap[lane] = 0x7fffffff;
    p.busy[lane] = false;
}

template <HitMode kMode>
HWY_INLINE HWY_ATTR void march_all(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                                   std::size_t count) {
    // Two packets, so that one computes while the other waits for memory.
    constexpr int kPackets = 2;
    Packet packets[kPackets];
    std::uint64_t ended[kPackets];
    const std::size_t lanes = hn::Lanes(kFloat);
    const std::size_t most_ended = lanes / 4 > 0 ? lanes / 4 : 1;
    std::size_t next = 0;
    std::size_t busy = 0;
    for (int k = 0; k < kPackets; ++k) {
        ended[k] = 0;
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            if (next < count) {
                load_lane(packets[k], lane, rays[next], static_cast<std::uint32_t>(next));
                ++next;
                ++busy;
            } else {
                idle_lane(packets[k], lane);
            }
        }
    }
    while (busy > 0) {
        for (int k = 0; k < kPackets; ++k) {
            Packet& p = packets[k];
            const StepResult result = step<kMode>(fields, p);
            const Mask any = hn::Or(result.hit, hn::Or(result.gone, result.exhausted));
            if (hn::AllFalse(kFloat, any)) continue;
            std::uint64_t hit_bits = 0, gone_bits = 0, exhausted_bits = 0;
            hn::StoreMaskBits(kFloat, result.hit, reinterpret_cast<std::uint8_t*>(&hit_bits));
            hn::StoreMaskBits(kFloat, result.gone, reinterpret_cast<std::uint8_t*>(&gone_bits));
            hn::StoreMaskBits(kFloat, result.exhausted, reinterpret_cast<std::uint8_t*>(&exhausted_bits));
            for (std::uint64_t bits = hit_bits | gone_bits | exhausted_bits; bits != 0; bits &= bits - 1) {
                const auto lane = static_cast<std::size_t>(__builtin_ctzll(bits));
                if (!p.busy[lane]) continue;
                const bool is_hit = hit_bits >> lane & 1;
                MarchHit& hit = hits[p.ray[lane]];
                hit.distance = p.hit_s[lane];
                hit.brick = p.brick[lane];
                hit.cell[0] = static_cast<std::int16_t>(p.cx[lane]);
                hit.cell[1] = static_cast<std::int16_t>(p.cy[lane]);
                hit.cell[2] = static_cast<std::int16_t>(p.cz[lane]);
                hit.status =
                    is_hit ? MarchStatus::kHit
                           : (exhausted_bits >> lane & 1 ? MarchStatus::kExhausted : MarchStatus::kMiss);
                hit.enters_negative = p.sign[lane] > 0.0f;
                hit.steps = static_cast<std::uint32_t>(p.steps[lane]);
                if (next < count) {
                    load_lane(p, lane, rays[next], static_cast<std::uint32_t>(next));
                    ++next;
                } else {
                    idle_lane(p, lane);
                    --busy;
                }
            }
        }
    }
    (void)most_ended;
    (void)ended;
}

HWY_ATTR void march_rays_eps(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                             std::size_t count) {
    march_all<HitMode::kEps>(fields, rays, hits, count);
}
HWY_ATTR void march_rays_secant(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                                std::size_t count) {
    march_all<HitMode::kSecant>(fields, rays, hits, count);
}
HWY_ATTR void march_rays_cubic(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                               std::size_t count) {
    march_all<HitMode::kCubic>(fields, rays, hits, count);
}

}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sdf {

HWY_EXPORT(march_rays_eps);
HWY_EXPORT(march_rays_secant);
HWY_EXPORT(march_rays_cubic);

void march_rays(const FieldTable& fields, HitMode mode, std::span<const MarchRay> rays,
                std::span<MarchHit> hits) {
    switch (mode) {
        case HitMode::kEps:
            HWY_DYNAMIC_DISPATCH(march_rays_eps)(fields, rays.data(), hits.data(), rays.size());
            break;
        case HitMode::kSecant:
            HWY_DYNAMIC_DISPATCH(march_rays_secant)(fields, rays.data(), hits.data(), rays.size());
            break;
        case HitMode::kCubic:
            HWY_DYNAMIC_DISPATCH(march_rays_cubic)(fields, rays.data(), hits.data(), rays.size());
            break;
    }
}

std::vector<std::string> kernel_targets() {
    std::vector<std::string> names;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        names.emplace_back(hwy::TargetName(target));
    }
    return names;
}

bool select_kernel_target(const std::string& name) {
    hwy::SetSupportedTargetsForTest(0);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        if (name != hwy::TargetName(target)) continue;
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(target);
        return true;
    }
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    return name.empty();
}

}  // namespace sdf

#endif  // HWY_ONCE
