// sdf/field_walk-inl.h: rays in the lanes of vectors on their way from box to box of a field, for the
// instruction set at hand. Included once for each by field_kernel.cpp alone.
#if defined(SDF_FIELD_WALK_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SDF_FIELD_WALK_INL_H
#undef SDF_FIELD_WALK_INL_H
#else
#define SDF_FIELD_WALK_INL_H
#endif

#include "sdf/field_kernel-inl.h"
#include "sdf/field_kernel.h"
#include "sdf/skip_boxes.h"

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {
namespace {

/// Where a ray goes on that was held up by a piece of surface it does not meet.
struct Resumed {
    std::uint32_t ray;
    float s;
    float cell[3];
    float sign;
    std::int32_t steps;
};

/// The rays that the lanes of one vector work on. In memory: refilling a lane is a few stores.
struct alignas(64) Packet {
    float ox[kMostLanes], oy[kMostLanes], oz[kMostLanes];
    float dx[kMostLanes], dy[kMostLanes], dz[kMostLanes];
    float ix[kMostLanes], iy[kMostLanes], iz[kMostLanes];        ///< 1 / direction.
    float up_x[kMostLanes], up_y[kMostLanes], up_z[kMostLanes];  ///< 1 where the direction is positive, or 0.
    float length[kMostLanes];
    float count_x[kMostLanes], count_y[kMostLanes], count_z[kMostLanes];
    std::int32_t top_base[kMostLanes], stride_x[kMostLanes], stride_y[kMostLanes];  ///< In the ray's octant.
    std::int32_t octant_boxes[kMostLanes];  ///< From a brick's first box to its octant's.
    // Where the ray has come to.
    float s[kMostLanes];
    float cx[kMostLanes], cy[kMostLanes], cz[kMostLanes];
    float sign[kMostLanes];  ///< Of the field, +1 or -1, once the ray has come to a surface; 0 before.
    std::int32_t steps[kMostLanes];
    // What fetch() found there.
    float block_x[kMostLanes], block_y[kMostLanes], block_z[kMostLanes];  ///< Lowest corner.
    std::int32_t brick[kMostLanes];                                       ///< Negative: the block is empty.
    std::int32_t box[kMostLanes];
    float region_x[kMostLanes], region_y[kMostLanes], region_z[kMostLanes];  ///< Of the brick.
    // What advance() found: the part of the ray that lies in a slab, and where it begins.
    float slab_s[kMostLanes], slab_end[kMostLanes];
    float slab_cx[kMostLanes], slab_cy[kMostLanes], slab_cz[kMostLanes];

    std::uint32_t ray[kMostLanes];
    bool is_busy[kMostLanes];
};

/// What the lanes' boxes are. Nothing waits for what is read here before the next call of advance(): between
/// them the other packet computes.
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
    const Ints brick = hn::GatherIndex(kInt, fields.top, top_index);
    hn::Store(block_x, kFloat, p.block_x);
    hn::Store(block_y, kFloat, p.block_y);
    hn::Store(block_z, kFloat, p.block_z);
    hn::Store(brick, kInt, p.brick);

    const auto is_brick = hn::Not(hn::Lt(brick, hn::Zero(kInt)));
    if (hn::AllFalse(kInt, is_brick)) {
        hn::Store(brick, kInt, p.box);
        return;
    }
    const auto region = [&](Floats cell, Floats block) HWY_ATTR {
        return hn::Min(hn::Floor((cell - block) * half), hn::Set(kFloat, kBrickRegions - 1));
    };
    const Floats region_x = region(cx, block_x), region_y = region(cy, block_y),
                 region_z = region(cz, block_z);
    hn::Store(region_x, kFloat, p.region_x);
    hn::Store(region_y, kFloat, p.region_y);
    hn::Store(region_z, kFloat, p.region_z);
    const Floats number = (region_x * hn::Set(kFloat, kBrickRegions * kBrickRegions) +
                           region_y * hn::Set(kFloat, kBrickRegions)) +
                          region_z;
    // Empty blocks read the first brick.
    const Ints index = hn::Max(brick, hn::Zero(kInt)) * hn::Set(kInt, kBrickBoxes) +
                       (hn::Load(kInt, p.octant_boxes) + hn::ConvertTo(kInt, number));
    const auto* boxes = reinterpret_cast<const std::int32_t*>(fields.boxes);
    hn::Store(hn::IfThenElse(is_brick, hn::GatherIndex(kInt, boxes, index), brick), kInt, p.box);
}

/// One axis of the way to a box's far side.
struct AxisExit {
    Floats last;  ///< The box's last cell on the ray's way.
    Floats s;     ///< Where the ray comes to the far side.
};

/// @param in_box cells from the block's near side to the far side of an empty box; @param is_occupied lanes
/// with a slab instead, that reaches through the whole brick where is_wide
HWY_INLINE HWY_ATTR AxisExit exit_along(Ints in_box, Mask is_occupied, Mask is_wide, const float* block,
                                        const float* region, const float* origin, const float* inverse,
                                        const float* up) {
    const Floats goes_up = hn::Load(kFloat, up), seven = hn::Set(kFloat, kBlockCells),
                 two = hn::Set(kFloat, 2.0f);
    const Mask is_up = hn::Gt(goes_up, hn::Zero(kFloat));
    const Floats number = hn::Load(kFloat, region), begin = two * number;
    // The last region has three cells.
    const Floats end = hn::IfThenElse(hn::Lt(number, two), begin + two, seven);
    const Floats of_region = hn::IfThenElse(is_up, end, seven - begin);
    const Floats extent =
        hn::IfThenElse(is_occupied, hn::IfThenElse(is_wide, seven, of_region), hn::ConvertTo(kFloat, in_box));
    const Floats plane = hn::Load(kFloat, block) + hn::IfThenElse(is_up, extent, seven - extent);
    return {plane - goes_up, (plane - hn::Load(kFloat, origin)) * hn::Load(kFloat, inverse)};
}

/// The lanes that a step ends: at a piece of surface, or with nothing.
struct Ended {
    Mask at_surface, gone, exhausted;
};

/// Takes every lane to the far side of its box, from what fetch() read. Lanes that come into a slab before
/// have their slab_ columns filled.
HWY_INLINE HWY_ATTR Ended advance(Packet& p) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f), two = hn::Set(kFloat, 2.0f);
    const Ints box = hn::Load(kInt, p.box), extent_mask = hn::Set(kInt, kMostBoxCells);
    const Floats s = hn::Load(kFloat, p.s);
    const Floats cx = hn::Load(kFloat, p.cx), cy = hn::Load(kFloat, p.cy), cz = hn::Load(kFloat, p.cz);
    const Mask is_occupied = hn::Not(hn::RebindMask(kFloat, hn::Lt(box, hn::Zero(kInt))));
    const Mask is_wide = hn::RebindMask(kFloat, hn::TestBit(box, hn::Set(kInt, kWideSlab)));
    const AxisExit x = exit_along(hn::And(hn::ShiftRight<2 * kBoxBits>(box), extent_mask), is_occupied,
                                  is_wide, p.block_x, p.region_x, p.ox, p.ix, p.up_x),
                   y = exit_along(hn::And(hn::ShiftRight<kBoxBits>(box), extent_mask), is_occupied, is_wide,
                                  p.block_y, p.region_y, p.oy, p.iy, p.up_y),
                   z = exit_along(hn::And(box, extent_mask), is_occupied, is_wide, p.block_z, p.region_z,
                                  p.oz, p.iz, p.up_z);
    const Floats next = hn::Max(s, hn::Min(x.s, hn::Min(y.s, z.s)));
    const Mask across_x = hn::And(hn::Le(x.s, y.s), hn::Le(x.s, z.s));
    const Mask across_y = hn::AndNot(across_x, hn::Le(y.s, z.s));
    const Mask across_z = hn::Not(hn::Or(across_x, across_y));
    const Point origin{hn::Load(kFloat, p.ox), hn::Load(kFloat, p.oy), hn::Load(kFloat, p.oz)};
    const Point direction{hn::Load(kFloat, p.dx), hn::Load(kFloat, p.dy), hn::Load(kFloat, p.dz)};
    const Point there = along(origin, direction, next);
    // Through a face the ray goes to the neighbour across it by number and not by position.
    const auto within_box = [](Floats position, Floats cell, Floats last) HWY_ATTR {
        return hn::Min(hn::Max(hn::Floor(position), hn::Min(cell, last)), hn::Max(cell, last));
    };
    const auto cell_after = [&](Floats position, Floats cell, Floats last, const float* up, Mask across)
                                HWY_ATTR {
                                    return hn::IfThenElse(across, last + (two * hn::Load(kFloat, up) - one),
                                                          within_box(position, cell, last));
                                };
    const Floats next_x = cell_after(there.x, cx, x.last, p.up_x, across_x),
                 next_y = cell_after(there.y, cy, y.last, p.up_y, across_y),
                 next_z = cell_after(there.z, cz, z.last, p.up_z, across_z);
    const Floats length = hn::Load(kFloat, p.length);

    Ended ended;
    ended.at_surface = hn::Lt(zero, zero);
    if (!hn::AllFalse(kFloat, is_occupied)) {
        const auto field_of = [](Ints word) HWY_ATTR { return hn::ConvertTo(kFloat, word); };
        const Ints byte_x = hn::ShiftRight<24>(hn::ShiftLeft<24>(box)),
                   byte_y = hn::ShiftRight<24>(hn::ShiftLeft<16>(box));
        const Floats per_step = hn::Set(kFloat, 1.0f / kSlabStep);
        const Floats nx = field_of(byte_x), ny = field_of(byte_y);
        const Floats nz = hn::Set(kFloat, kSlabNormal) - hn::Abs(nx) - hn::Abs(ny);
        const Ints thickness = hn::And(hn::ShiftRight<24>(box), hn::Set(kInt, kMostSlabSteps));
        const Mask has_bound = hn::RebindMask(kFloat, hn::Lt(thickness, hn::Set(kInt, kMostSlabSteps)));
        const Floats begins =
            field_of(hn::And(hn::ShiftRight<16>(box), hn::Set(kInt, 255)) - hn::Set(kInt, kSlabMiddle));
        const Floats low = hn::IfThenElse(has_bound, begins, hn::Set(kFloat, -kHuge)),
                     high = hn::IfThenElse(has_bound, begins + field_of(thickness), hn::Set(kFloat, kHuge));
        const Floats middle = hn::Set(kFloat, 0.5f * kBlockCells);
        const Floats middle_x = hn::Load(kFloat, p.block_x) + middle,
                     middle_y = hn::Load(kFloat, p.block_y) + middle,
                     middle_z = hn::Load(kFloat, p.block_z) + middle;
        const auto height = [&](const Point& at) HWY_ATTR {
            return (nx * (at.x - middle_x) + ny * (at.y - middle_y) + nz * (at.z - middle_z)) * per_step;
        };
        const Floats from = height(along(origin, direction, s)), to = height(there);
        const Mask below = hn::And(hn::Lt(from, low), hn::Lt(to, low)),
                   above = hn::And(hn::Gt(from, high), hn::Gt(to, high));
        ended.at_surface = hn::AndNot(hn::Or(below, above), is_occupied);
        if (!hn::AllFalse(kFloat, ended.at_surface)) {
            const Floats per_height = (next - s) / (to - from);
            const Mask from_below = hn::Lt(from, low), from_above = hn::Gt(from, high),
                       to_below = hn::Lt(to, low), to_above = hn::Gt(to, high);
            const Floats to_low = s + (low - from) * per_height, to_high = s + (high - from) * per_height;
            const Floats begin = hn::Min(
                hn::Max(s, hn::IfThenElse(from_below, to_low, hn::IfThenElse(from_above, to_high, s))), next);
            const Floats end = hn::Max(
                begin,
                hn::Min(next, hn::IfThenElse(to_below, to_low, hn::IfThenElse(to_above, to_high, next))));
            const Point first = along(origin, direction, begin);
            hn::Store(begin, kFloat, p.slab_s);
            hn::Store(end, kFloat, p.slab_end);
            // A ray that is in the slab already stays in its cell, whatever its position rounds to.
            const Mask stays = hn::Eq(begin, s);
            hn::Store(hn::IfThenElse(stays, cx, within_box(first.x, cx, x.last)), kFloat, p.slab_cx);
            hn::Store(hn::IfThenElse(stays, cy, within_box(first.y, cy, y.last)), kFloat, p.slab_cy);
            hn::Store(hn::IfThenElse(stays, cz, within_box(first.z, cz, z.last)), kFloat, p.slab_cz);
            // Nothing counts beyond the ray's end.
            ended.at_surface = hn::And(ended.at_surface, hn::Le(begin, length));
        }
    }

    const Floats count_x = hn::Load(kFloat, p.count_x), count_y = hn::Load(kFloat, p.count_y),
                 count_z = hn::Load(kFloat, p.count_z);
    const Mask inside = hn::And(hn::And(hn::And(hn::Ge(next_x, zero), hn::Lt(next_x, count_x)),
                                        hn::And(hn::Ge(next_y, zero), hn::Lt(next_y, count_y))),
                                hn::And(hn::Ge(next_z, zero), hn::Lt(next_z, count_z)));
    const Mask goes_on = hn::And(inside, hn::Lt(next, length));
    const Ints steps = hn::Load(kInt, p.steps) + hn::Set(kInt, 1);
    ended.gone = hn::Not(hn::Or(ended.at_surface, goes_on));
    // More steps than this no ray needs, even from cell to cell.
    const Floats most_steps = two * (count_x + count_y + count_z) + hn::Set(kFloat, 256.0f);
    ended.exhausted =
        hn::AndNot(hn::Or(ended.at_surface, ended.gone), hn::Gt(hn::ConvertTo(kFloat, steps), most_steps));
    hn::Store(steps, kInt, p.steps);
    // Where the ray does not go on, the place tells so.
    hn::Store(hn::IfThenElse(goes_on, next, hn::Set(kFloat, kHuge)), kFloat, p.s);
    hn::Store(next_x, kFloat, p.cx);
    hn::Store(next_y, kFloat, p.cy);
    hn::Store(next_z, kFloat, p.cz);
    return ended;
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
    const int down_x = ray.direction[0] < 0.0f, down_y = ray.direction[1] < 0.0f,
              down_z = ray.direction[2] < 0.0f;
    const int octant = 4 * down_x + 2 * down_y + down_z;
    p.up_x[lane] = static_cast<float>(1 - down_x);
    p.up_y[lane] = static_cast<float>(1 - down_y);
    p.up_z[lane] = static_cast<float>(1 - down_z);
    p.length[lane] = ray.length;
    p.count_x[lane] = ray.cell_count[0];
    p.count_y[lane] = ray.cell_count[1];
    p.count_z[lane] = ray.cell_count[2];
    p.top_base[lane] = ray.top_base + octant * ray.top_octant;
    p.stride_x[lane] = ray.top_stride_x;
    p.stride_y[lane] = ray.top_stride_y;
    p.octant_boxes[lane] = octant * kRegions;
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
    p.ray[lane] = number;
    p.is_busy[lane] = true;
}

/// Puts a lane where its ray was held up.
HWY_INLINE HWY_ATTR void resume_lane(Packet& p, std::size_t lane, const Resumed& at) {
    p.s[lane] = at.s;
    p.cx[lane] = at.cell[0];
    p.cy[lane] = at.cell[1];
    p.cz[lane] = at.cell[2];
    p.sign[lane] = at.sign;
    p.steps[lane] = at.steps;
}

/// A lane without a ray: it stands still in the first block of all and never ends.
HWY_INLINE HWY_ATTR void idle_lane(Packet& p, std::size_t lane) {
    p.ox[lane] = p.oy[lane] = p.oz[lane] = 0.0f;
    p.dx[lane] = p.dy[lane] = p.dz[lane] = 0.0f;
    p.ix[lane] = p.iy[lane] = p.iz[lane] = kHuge;
    p.up_x[lane] = p.up_y[lane] = p.up_z[lane] = 1.0f;
    p.length[lane] = kHuge;
    p.count_x[lane] = p.count_y[lane] = p.count_z[lane] = kHuge;
    p.top_base[lane] = p.stride_x[lane] = p.stride_y[lane] = p.octant_boxes[lane] = 0;
    p.s[lane] = p.cx[lane] = p.cy[lane] = p.cz[lane] = 0.0f;
    p.sign[lane] = 1.0f;
    p.steps[lane] = 0;
    p.ray[lane] = 0;
    p.is_busy[lane] = false;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#endif  // per target
