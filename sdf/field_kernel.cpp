#include "sdf/field_kernel.h"

#include <cstdint>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/field_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include "sdf/field_kernel-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {

/// Where the lanes' cells lie, and the samples at their corners. Nothing waits for what is read here before
/// the next call of advance(): between them the other packet computes.
HWY_INLINE HWY_ATTR void fetch(const FieldTable& fields, Packet& p) {
    const Floats cx = hn::Load(kFloat, p.cx), cy = hn::Load(kFloat, p.cy), cz = hn::Load(kFloat, p.cz);
    const Floats seven = hn::Set(kFloat, kBlockCells), seventh = hn::Set(kFloat, 1.0f / kBlockCells),
                 half = hn::Set(kFloat, 0.5f);
    const Floats bx = hn::Floor((cx + half) * seventh), by = hn::Floor((cy + half) * seventh),
                 bz = hn::Floor((cz + half) * seventh);
    const Floats block_x = bx * seven, block_y = by * seven, block_z = bz * seven;
    const Ints top_index = hn::ConvertTo(kInt, bx) * hn::Load(kInt, p.stride_x) +
                           hn::ConvertTo(kInt, by) * hn::Load(kInt, p.stride_y) +
                           (hn::ConvertTo(kInt, bz) + hn::Load(kInt, p.top_base));
    const Ints entry = hn::GatherIndex(kInt, fields.top, top_index);
    const Floats in_brick =
        ((cx - block_x) * hn::Set(kFloat, 64.0f) + (cy - block_y) * hn::Set(kFloat, 8.0f)) + (cz - block_z);
    // Empty blocks read the first brick.
    const Ints offset =
        hn::IfThenZeroElse(hn::Lt(entry, hn::Zero(kInt)),
                           hn::ShiftLeft<kLogBrickBytes>(hn::And(entry, hn::Set(kInt, kBrickMask))) +
                               hn::ShiftLeft<1>(hn::ConvertTo(kInt, in_brick)));
    // Two samples along z in a word.
    const auto* base = reinterpret_cast<const std::int32_t*>(fields.samples);
    hn::Store(block_x, kFloat, p.block_x);
    hn::Store(block_y, kFloat, p.block_y);
    hn::Store(block_z, kFloat, p.block_z);
    hn::Store(entry, kInt, p.entry);
    hn::Store(hn::GatherOffset(kInt, base, offset), kInt, p.w00);
    hn::Store(hn::GatherOffset(kInt, base, offset + hn::Set(kInt, kSampleBytesY)), kInt, p.w01);
    hn::Store(hn::GatherOffset(kInt, base, offset + hn::Set(kInt, kSampleBytesX)), kInt, p.w10);
    hn::Store(hn::GatherOffset(kInt, base, offset + hn::Set(kInt, kSampleBytesX + kSampleBytesY)), kInt,
              p.w11);
}

HWY_INLINE HWY_ATTR Corners load_corners(const Packet& p) {
    const Ints w00 = hn::Load(kInt, p.w00), w01 = hn::Load(kInt, p.w01), w10 = hn::Load(kInt, p.w10),
               w11 = hn::Load(kInt, p.w11);
    const auto low_half = [](Ints word) HWY_ATTR {
        return hn::ConvertTo(kFloat, hn::ShiftRight<16>(hn::ShiftLeft<16>(word)));
    };
    const auto high_half = [](Ints word) HWY_ATTR { return hn::ConvertTo(kFloat, hn::ShiftRight<16>(word)); };
    return {low_half(w00), high_half(w00), low_half(w01), high_half(w01),
            low_half(w10), high_half(w10), low_half(w11), high_half(w11)};
}

/// A place within a cell, each coordinate in [0, 1].
struct Place {
    Floats x, y, z;
};

HWY_INLINE HWY_ATTR Floats unit_clamped(Floats x) {
    return hn::Min(hn::Max(x, hn::Zero(kFloat)), hn::Set(kFloat, 1.0f));
}

HWY_INLINE HWY_ATTR Place place_at(const Packet& p, Floats s) {
    return {unit_clamped(hn::Load(kFloat, p.ox) + s * hn::Load(kFloat, p.dx) - hn::Load(kFloat, p.cx)),
            unit_clamped(hn::Load(kFloat, p.oy) + s * hn::Load(kFloat, p.dy) - hn::Load(kFloat, p.cy)),
            unit_clamped(hn::Load(kFloat, p.oz) + s * hn::Load(kFloat, p.dz) - hn::Load(kFloat, p.cz))};
}

/// Where rays leave a box of cells: how far along the ray each axis's plane lies.
struct Exit {
    Floats x, y, z;

    HWY_ATTR Floats nearest() const { return hn::Min(x, hn::Min(y, z)); }
};

HWY_INLINE HWY_ATTR Exit exit_of(const Packet& p, Floats low_x, Floats low_y, Floats low_z, Floats size) {
    const auto plane = [&](Floats low, const float* up, const float* origin, const float* inverse) HWY_ATTR {
        return (low + size * hn::Load(kFloat, up) - hn::Load(kFloat, origin)) * hn::Load(kFloat, inverse);
    };
    return {plane(low_x, p.up_x, p.ox, p.ix), plane(low_y, p.up_y, p.oy, p.iy),
            plane(low_z, p.up_z, p.oz, p.iz)};
}

/// The lanes that a step ends: with a hit, with a cell to be searched for one, or with nothing.
struct Ended {
    Mask hit, candidate, gone, exhausted;
};

/// Takes one step with every lane, from what fetch() read.
template <HitMode kMode>
HWY_INLINE HWY_ATTR Ended advance(Packet& p) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f), seven = hn::Set(kFloat, kBlockCells);
    const Floats s = hn::Load(kFloat, p.s);
    const Ints entry = hn::Load(kInt, p.entry);
    const Mask is_empty = hn::RebindMask(kFloat, hn::Lt(entry, hn::Zero(kInt)));
    const Floats cx = hn::Load(kFloat, p.cx), cy = hn::Load(kFloat, p.cy), cz = hn::Load(kFloat, p.cz);
    const Floats block_x = hn::Load(kFloat, p.block_x), block_y = hn::Load(kFloat, p.block_y),
                 block_z = hn::Load(kFloat, p.block_z);
    const Exit of_block = exit_of(p, block_x, block_y, block_z, seven);
    const Exit of_cell = exit_of(p, cx, cy, cz, one);
    const Floats block_exit = of_block.nearest();
    Mask whole_block = is_empty;  // Nothing can be met in the rest of the block.
    const Mask no_lane = hn::Lt(zero, zero);
    Ended ended{no_lane, no_lane, no_lane, no_lane};

    Floats reach =
        hn::ConvertTo(kFloat, hn::Zero(kInt) - (entry + hn::Set(kInt, 1))) * hn::Set(kFloat, 1.0f / 64.0f);
    if (!hn::AllTrue(kFloat, is_empty)) {
        const Mask in_cell = hn::Not(is_empty);
        const Corners corners = load_corners(p);
        const Place near = place_at(p, s);
        const Floats value = corners.at(near.x, near.y, near.z);
        const Floats old_sign = hn::Load(kFloat, p.sign);
        const Mask begins = hn::AndNot(is_empty, hn::Eq(old_sign, zero));
        const Floats sign = hn::IfThenElse(begins, hn::CopySign(one, value), old_sign);
        hn::Store(sign, kFloat, p.sign);
        const Mask negative = is_negative(sign);

        // Bits 15 and 31 are the signs of a word's two samples.
        const Ints w00 = hn::Load(kInt, p.w00), w01 = hn::Load(kInt, p.w01), w10 = hn::Load(kInt, p.w10),
                   w11 = hn::Load(kInt, p.w11);
        const Ints signs = hn::Set(kInt, static_cast<std::int32_t>(0x80008000u));
        const Ints any_negative = hn::And(hn::Or(hn::Or(w00, w01), hn::Or(w10, w11)), signs);
        const Ints all_negative = hn::And(hn::And(hn::And(w00, w01), hn::And(w10, w11)), signs);
        const Mask all = hn::RebindMask(kFloat, hn::Eq(all_negative, signs));
        const Mask uniform = hn::Or(hn::RebindMask(kFloat, hn::Eq(any_negative, hn::Zero(kInt))), all);
        // A cell of one sign that is not the ray's: the change lay in the face, and rounding hid it.
        ended.hit = hn::And(in_cell, hn::And(uniform, differ(all, negative)));
        Floats hit_s = s;

        const Floats step_voxels = hn::Set(kFloat, kSampleStepVoxels);
        // Within the brick no more than its gradients allow.
        const Floats part = hn::ConvertTo(kFloat, hn::ShiftRight<kBrickBits>(entry) + hn::Set(kInt, 1)) *
                            hn::Set(kFloat, kSampleStepVoxels / 256.0f);
        Floats safe = hn::Abs(value) * part;
        if constexpr (kMode == HitMode::kEps) {
            // Distance to the surface ahead; the slope tells whether the ray comes nearer at all.
            const Floats ahead = value * sign;
            const Mask is_near =
                hn::And(in_cell, hn::Lt(ahead * step_voxels, hn::Set(kFloat, kHitEpsVoxels)));
            if (!hn::AllFalse(kFloat, is_near)) {
                const Floats look = hn::Set(kFloat, 0.25f);
                const Floats later =
                    corners.at(near.x + look * hn::Load(kFloat, p.dx), near.y + look * hn::Load(kFloat, p.dy),
                               near.z + look * hn::Load(kFloat, p.dz)) *
                    sign;
                const Mask closing = hn::Lt(later, ahead);
                const Floats further = look * ahead / (ahead - later);
                const Mask found =
                    hn::And(is_near, hn::And(hn::Ge(ahead, zero), hn::And(closing, hn::Lt(further, one))));
                hit_s = hn::IfThenElse(found, s + unit_clamped(further), hit_s);
                ended.hit = hn::Or(ended.hit, found);
            }
        } else {
            safe = hn::IfThenElseZero(uniform, safe);
        }
        const Mask mixed = hn::AndNot(hn::Or(uniform, is_empty), hn::Eq(hn::Load(kFloat, p.searched), zero));
        if (!hn::AllFalse(kFloat, mixed)) {
            const Place far = place_at(p, hn::Max(s, of_cell.nearest()));
            Mask may_cross;
            if constexpr (kMode == HitMode::kCubic) {
                // The cubic lies within the hull of its Bernstein coefficients.
                const CubicLanes cubic = cubic_along(corners, near.x, near.y, near.z, far.x - near.x,
                                                     far.y - near.y, far.z - near.z);
                const Floats third = hn::Set(kFloat, 1.0f / 3.0f);
                const Floats b1 = cubic.c0 + third * cubic.c1;
                const Floats b2 = b1 + third * (cubic.c1 + cubic.c2);
                const Floats b3 = cubic.at(one);
                may_cross =
                    hn::Or(hn::Or(differ(is_negative(value), negative), differ(is_negative(b1), negative)),
                           hn::Or(differ(is_negative(b2), negative), differ(is_negative(b3), negative)));
            } else {
                // A cell is wider than eps: the ray may come through the surface between two samples.
                const Floats far_value = corners.at(far.x, far.y, far.z);
                may_cross =
                    hn::Or(differ(is_negative(value), negative), differ(is_negative(far_value), negative));
            }
            ended.candidate = hn::And(mixed, may_cross);
        }
        ended.hit = hn::And(ended.hit, hn::Le(hit_s, hn::Load(kFloat, p.length)));
        hn::Store(hit_s, kFloat, p.hit_s);
        reach = hn::IfThenElse(is_empty, reach, safe);
        // Beyond the brick its gradients say nothing.
        whole_block = hn::Or(is_empty, hn::Gt(s + (safe - hn::Set(kFloat, kStepMargin)), block_exit));
    }

    // On, as far as nothing can be met: out of the block, out of the cell, or to a place between.
    const Floats region_exit = hn::Max(s, hn::IfThenElse(whole_block, block_exit, of_cell.nearest()));
    const Floats safe_s = s + (reach - hn::Set(kFloat, kStepMargin));
    const Mask jumps = hn::And(hn::Gt(safe_s, region_exit), hn::Or(is_empty, hn::Not(whole_block)));
    const Floats next = hn::IfThenElse(jumps, safe_s, region_exit);
    const Floats count_x = hn::Load(kFloat, p.count_x), count_y = hn::Load(kFloat, p.count_y),
                 count_z = hn::Load(kFloat, p.count_z);
    const Floats size = hn::IfThenElse(whole_block, seven, one);
    const Mask jumps_far = hn::And(jumps, is_empty);
    const Exit exit{hn::IfThenElse(whole_block, of_block.x, of_cell.x),
                    hn::IfThenElse(whole_block, of_block.y, of_cell.y),
                    hn::IfThenElse(whole_block, of_block.z, of_cell.z)};
    const Mask across_x = hn::AndNot(jumps, hn::And(hn::Le(exit.x, exit.y), hn::Le(exit.x, exit.z)));
    const Mask across_y = hn::AndNot(hn::Or(jumps, across_x), hn::Le(exit.y, exit.z));
    const Mask across_z = hn::Not(hn::Or(jumps, hn::Or(across_x, across_y)));
    // A jump lands within its block, or anywhere from an empty one; else the ray goes through a face, to the
    // neighbour across it by number and not by position.
    const auto cell_after = [&](const float* origin, const float* direction, const float* up, Floats cell,
                                Floats block, Floats count, Mask across) HWY_ATTR {
        const Floats at = hn::Floor(hn::Load(kFloat, origin) + next * hn::Load(kFloat, direction));
        const Floats region = hn::IfThenElse(hn::Or(whole_block, jumps), block, cell);
        const Floats low = hn::IfThenZeroElse(jumps_far, region);
        // The last block may reach beyond the field.
        const Floats last =
            hn::Min(count, hn::IfThenElse(jumps_far, count, region + hn::IfThenElse(jumps, seven, size))) -
            one;
        const Floats inside = hn::Min(hn::Max(at, low), last);
        return hn::IfThenElse(across, region + (hn::Load(kFloat, up) * (size + one) - one), inside);
    };
    const Floats next_x = cell_after(p.ox, p.dx, p.up_x, cx, block_x, count_x, across_x),
                 next_y = cell_after(p.oy, p.dy, p.up_y, cy, block_y, count_y, across_y),
                 next_z = cell_after(p.oz, p.dz, p.up_z, cz, block_z, count_z, across_z);

    const Ints steps = hn::Load(kInt, p.steps) + hn::Set(kInt, 1);
    hn::Store(steps, kInt, p.steps);
    const Mask stays = hn::Or(ended.hit, ended.candidate);
    const Mask inside = hn::And(hn::And(hn::Ge(next_x, zero), hn::Lt(next_x, count_x)),
                                hn::And(hn::And(hn::Ge(next_y, zero), hn::Lt(next_y, count_y)),
                                        hn::And(hn::Ge(next_z, zero), hn::Lt(next_z, count_z))));
    const Mask goes_on = hn::And(inside, hn::Lt(next, hn::Load(kFloat, p.length)));
    ended.gone = hn::Not(hn::Or(stays, goes_on));
    ended.exhausted = hn::AndNot(hn::Or(stays, ended.gone),
                                 hn::RebindMask(kFloat, hn::Gt(steps, hn::Load(kInt, p.step_cap))));
    hn::Store(hn::IfThenElse(stays, s, next), kFloat, p.s);
    hn::Store(hn::IfThenElse(stays, cx, next_x), kFloat, p.cx);
    hn::Store(hn::IfThenElse(stays, cy, next_y), kFloat, p.cy);
    hn::Store(hn::IfThenElse(stays, cz, next_z), kFloat, p.cz);
    hn::Store(zero, kFloat, p.searched);
    return ended;
}

/// Looks for the crossing in the lanes' cells. @returns the lanes that have one, at p.hit_s
template <HitMode kMode>
HWY_INLINE HWY_ATTR Mask search_cell(Packet& p) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f);
    const Floats s = hn::Load(kFloat, p.s);
    const Corners corners = load_corners(p);
    const Exit exit = exit_of(p, hn::Load(kFloat, p.cx), hn::Load(kFloat, p.cy), hn::Load(kFloat, p.cz), one);
    const Floats part = hn::Max(s, exit.nearest()) - s;
    const Place near = place_at(p, s), far = place_at(p, s + part);
    const Floats gx = far.x - near.x, gy = far.y - near.y, gz = far.z - near.z;
    const Mask negative = is_negative(hn::Load(kFloat, p.sign));
    Mask found;
    Floats root;
    if constexpr (kMode == HitMode::kCubic) {
        root = first_root(cubic_along(corners, near.x, near.y, near.z, gx, gy, gz), negative, found);
    } else {
        Floats low = zero, high = one, at_low = corners.at(near.x, near.y, near.z),
               at_high = corners.at(far.x, far.y, far.z);
        const Mask at_once = differ(is_negative(at_low), negative);
        found = hn::Or(at_once, differ(is_negative(at_high), negative));
        constexpr int kFalsePositions = 3;
        root = zero;
        for (int i = 0; i < kFalsePositions; ++i) {
            root = low + (high - low) * (at_low / (at_low - at_high));
            const Floats at_root = corners.at(near.x + root * gx, near.y + root * gy, near.z + root * gz);
            const Mask before = hn::Not(differ(is_negative(at_root), negative));
            low = hn::IfThenElse(before, root, low);
            at_low = hn::IfThenElse(before, at_root, at_low);
            high = hn::IfThenElse(before, high, root);
            at_high = hn::IfThenElse(before, at_high, at_root);
        }
        root = hn::IfThenZeroElse(at_once, root);
    }
    const Floats hit_s = s + root * part;
    hn::Store(hit_s, kFloat, p.hit_s);
    return found;
}

/// Gives a lane a ray, at its origin.
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
    p.up_x[lane] = ray.direction[0] >= 0.0f ? 1.0f : 0.0f;
    p.up_y[lane] = ray.direction[1] >= 0.0f ? 1.0f : 0.0f;
    p.up_z[lane] = ray.direction[2] >= 0.0f ? 1.0f : 0.0f;
    p.length[lane] = ray.length;
    p.count_x[lane] = ray.cell_count[0];
    p.count_y[lane] = ray.cell_count[1];
    p.count_z[lane] = ray.cell_count[2];
    p.top_base[lane] = ray.top_base;
    p.stride_x[lane] = ray.top_stride_x;
    p.stride_y[lane] = ray.top_stride_y;
    p.step_cap[lane] = static_cast<std::int32_t>(
        2.0f * (ray.cell_count[0] + ray.cell_count[1] + ray.cell_count[2]) + 256.0f);
    p.s[lane] = 0.0f;
    const auto cell = [](float position, float count) {
        const auto whole = static_cast<float>(static_cast<std::int32_t>(position));
        return whole < count ? whole : count - 1.0f;
    };
    p.cx[lane] = cell(ray.origin[0], ray.cell_count[0]);
    p.cy[lane] = cell(ray.origin[1], ray.cell_count[1]);
    p.cz[lane] = cell(ray.origin[2], ray.cell_count[2]);
    p.sign[lane] = 0.0f;
    p.searched[lane] = 0.0f;
    p.steps[lane] = 0;
    p.ray[lane] = number;
    p.is_busy[lane] = true;
}

/// Puts a lane where its ray was left, in a cell that may hold a crossing.
HWY_INLINE HWY_ATTR void resume_lane(Packet& p, std::size_t lane, const MarchHit& at, bool is_searched) {
    p.s[lane] = at.distance;
    p.cx[lane] = at.cell[0];
    p.cy[lane] = at.cell[1];
    p.cz[lane] = at.cell[2];
    p.sign[lane] = at.enters_negative ? 1.0f : -1.0f;
    p.steps[lane] = static_cast<std::int32_t>(at.steps);
    p.searched[lane] = is_searched ? 1.0f : 0.0f;
}

/// A lane without a ray: it stands still in the first block of all and never ends.
HWY_INLINE HWY_ATTR void idle_lane(Packet& p, std::size_t lane) {
    p.ox[lane] = p.oy[lane] = p.oz[lane] = 0.0f;
    p.dx[lane] = p.dy[lane] = p.dz[lane] = 0.0f;
    p.ix[lane] = p.iy[lane] = p.iz[lane] = kHuge;
    p.up_x[lane] = p.up_y[lane] = p.up_z[lane] = 1.0f;
    p.length[lane] = kHuge;
    p.count_x[lane] = p.count_y[lane] = p.count_z[lane] = kHuge;
    p.top_base[lane] = p.stride_x[lane] = p.stride_y[lane] = 0;
    p.step_cap[lane] = 0x7fffffff;
    p.s[lane] = p.cx[lane] = p.cy[lane] = p.cz[lane] = 0.0f;
    p.sign[lane] = 1.0f;
    p.searched[lane] = 0.0f;
    p.steps[lane] = 0;
    p.ray[lane] = 0;
    p.is_busy[lane] = false;
}

HWY_INLINE HWY_ATTR std::uint64_t bits_of(Mask mask) {
    std::uint64_t bits = 0;
    hn::StoreMaskBits(kFloat, mask, reinterpret_cast<std::uint8_t*>(&bits));
    return bits;
}

HWY_INLINE HWY_ATTR void store_lane(const Packet& p, std::size_t lane, MarchStatus status, float distance,
                                    MarchHit& hit) {
    hit.distance = distance;
    hit.brick = p.entry[lane] & kBrickMask;
    hit.cell[0] = static_cast<std::int16_t>(p.cx[lane]);
    hit.cell[1] = static_cast<std::int16_t>(p.cy[lane]);
    hit.cell[2] = static_cast<std::int16_t>(p.cz[lane]);
    hit.status = status;
    hit.enters_negative = p.sign[lane] > 0.0f;
    hit.steps = static_cast<std::uint32_t>(p.steps[lane]);
}

/// Walks rays until each has ended or has come to a cell that must be searched.
/// @param resumed those to go on with, from such a cell; null: all `count` from their origins
template <HitMode kMode>
HWY_INLINE HWY_ATTR void walk(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                              std::size_t count, const std::uint32_t* resumed,
                              std::vector<std::uint32_t>& candidates) {
    // Two packets: while one waits for memory, the other computes.
    constexpr int kPackets = 2;
    Packet packets[kPackets];
    const std::size_t lanes = hn::Lanes(kFloat);
    std::size_t next = 0, busy = 0;
    // Whether there was a ray left for the lane.
    const auto refill = [&](Packet& p, std::size_t lane) HWY_ATTR {
        if (next == count) {
            idle_lane(p, lane);
            return false;
        }
        const std::uint32_t number = resumed ? resumed[next] : static_cast<std::uint32_t>(next);
        load_lane(p, lane, rays[number], number);
        if (resumed) resume_lane(p, lane, hits[number], true);
        ++next;
        return true;
    };
    for (Packet& p : packets) {
        for (std::size_t lane = 0; lane < lanes; ++lane) busy += refill(p, lane);
        fetch(fields, p);
    }
    while (busy > 0) {
        for (Packet& p : packets) {
            const Ended ended = advance<kMode>(p);
            const Mask any = hn::Or(hn::Or(ended.hit, ended.candidate), hn::Or(ended.gone, ended.exhausted));
            if (!hn::AllFalse(kFloat, any)) {
                const std::uint64_t hit = bits_of(ended.hit), candidate = bits_of(ended.candidate),
                                    exhausted = bits_of(ended.exhausted);
                for (std::uint64_t bits = bits_of(any); bits != 0; bits &= bits - 1) {
                    const auto lane = static_cast<std::size_t>(__builtin_ctzll(bits));
                    if (!p.is_busy[lane]) continue;
                    const bool is_hit = hit >> lane & 1, is_candidate = !is_hit && (candidate >> lane & 1);
                    const MarchStatus status = is_hit                  ? MarchStatus::kHit
                                               : exhausted >> lane & 1 ? MarchStatus::kExhausted
                                                                       : MarchStatus::kMiss;
                    store_lane(p, lane, status, is_hit ? p.hit_s[lane] : p.s[lane], hits[p.ray[lane]]);
                    if (is_candidate) candidates.push_back(p.ray[lane]);
                    if (!refill(p, lane)) --busy;
                }
            }
            fetch(fields, p);
        }
    }
}

/// Searches the cells that rays have come to, all lanes at once. @returns rays without a crossing there
template <HitMode kMode>
HWY_INLINE HWY_ATTR void search(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                                std::vector<std::uint32_t>& candidates) {
    const std::size_t lanes = hn::Lanes(kFloat);
    std::size_t unresolved = 0;
    Packet p;
    for (std::size_t begin = 0; begin < candidates.size(); begin += lanes) {
        const std::size_t count = candidates.size() - begin < lanes ? candidates.size() - begin : lanes;
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            // What is left over repeats the first.
            const std::uint32_t number = candidates[begin + (lane < count ? lane : 0)];
            load_lane(p, lane, rays[number], number);
            resume_lane(p, lane, hits[number], false);
        }
        fetch(fields, p);
        const std::uint64_t found = bits_of(search_cell<kMode>(p));
        for (std::size_t lane = 0; lane < count; ++lane) {
            const std::uint32_t number = p.ray[lane];
            MarchHit& hit = hits[number];
            if (!(found >> lane & 1)) {
                candidates[unresolved++] = number;
            } else if (p.hit_s[lane] <= rays[number].length) {
                hit.status = MarchStatus::kHit;
                hit.distance = p.hit_s[lane];
            } else {
                hit.status = MarchStatus::kMiss;
            }
        }
    }
    candidates.resize(unresolved);
}

template <HitMode kMode>
HWY_INLINE HWY_ATTR void march_all(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                                   std::size_t count) {
    std::vector<std::uint32_t> candidates, resumed;
    candidates.reserve(count);
    walk<kMode>(fields, rays, hits, count, nullptr, candidates);
    while (!candidates.empty()) {
        search<kMode>(fields, rays, hits, candidates);
        resumed.swap(candidates);
        candidates.clear();
        walk<kMode>(fields, rays, hits, resumed.size(), resumed.data(), candidates);
    }
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
    if (rays.empty()) return;
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
