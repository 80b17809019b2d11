// sdf/cell_search-inl.h: crossings of the trilinear surface in the cells that rays have come to, for the
// instruction set at hand. Included once for each by field_kernel.cpp alone.
#if defined(SDF_CELL_SEARCH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SDF_CELL_SEARCH_INL_H
#undef SDF_CELL_SEARCH_INL_H
#else
#define SDF_CELL_SEARCH_INL_H
#endif

#include <cstdint>
#include <vector>

#include "sdf/field_kernel-inl.h"
#include "sdf/field_kernel.h"
#include "sdf/field_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {
namespace {

/// Bytes from a sample to its neighbours along y and x, and from brick to brick.
constexpr int kSampleBytesY = 16, kSampleBytesX = 128, kLogBrickBytes = 10;

/// Rays that have come to a cell near the surface, one column a component.
struct Candidates {
    /// As many as are searched together, and what two packets may add to them.
    static constexpr std::size_t kFull = 256, kCapacity = kFull + 2 * kMostLanes;

    alignas(64) std::int32_t ray[kCapacity], brick[kCapacity], steps[kCapacity];
    alignas(64) float cx[kCapacity], cy[kCapacity], cz[kCapacity];
    alignas(64) float s[kCapacity], end[kCapacity];  ///< The part of the ray that may meet the surface.
    alignas(64) float sign[kCapacity];
    /// Where the ray goes on if it does not; kHuge: nowhere.
    alignas(64) float next_s[kCapacity], next_x[kCapacity], next_y[kCapacity], next_z[kCapacity];
    std::size_t size = 0;

    HWY_INLINE HWY_ATTR void push(const FieldTable& fields, const Packet& p, std::size_t lane) {
        ray[size] = static_cast<std::int32_t>(p.ray[lane]);
        brick[size] = p.brick[lane];
        steps[size] = p.steps[lane];
        cx[size] = p.slab_cx[lane];
        cy[size] = p.slab_cy[lane];
        cz[size] = p.slab_cz[lane];
        s[size] = p.slab_s[lane];
        end[size] = p.slab_end[lane];
        sign[size] = p.sign[lane];
        next_s[size] = p.s[lane];
        next_x[size] = p.cx[lane];
        next_y[size] = p.cy[lane];
        next_z[size] = p.cz[lane];
        ++size;
        const float sample = (p.slab_cx[lane] - p.block_x[lane]) * 64.0f +
                             (p.slab_cy[lane] - p.block_y[lane]) * 8.0f + (p.slab_cz[lane] - p.block_z[lane]);
        const std::int16_t* corner = fields.samples +
                                     static_cast<std::ptrdiff_t>(p.brick[lane]) * kBrickSize +
                                     static_cast<int>(sample);
        __builtin_prefetch(&fields.bricks[p.brick[lane]]);
        __builtin_prefetch(corner);
        __builtin_prefetch(corner + kSampleBytesX / 2);
    }
    /// Copies one to another place.
    HWY_INLINE HWY_ATTR void move(std::size_t from, std::size_t to) {
        for (std::int32_t* column : {ray, brick, steps}) column[to] = column[from];
        for (float* column : {cx, cy, cz, s, end, sign, next_s, next_x, next_y, next_z}) {
            column[to] = column[from];
        }
    }
    /// Fills the last vector up with copies of the first.
    HWY_INLINE HWY_ATTR void pad() {
        for (std::size_t i = size; i % hn::Lanes(kFloat) != 0; ++i) move(0, i);
    }
};

/// The samples at the corners of cells, by their bricks and the cells' place in them.
HWY_INLINE HWY_ATTR Corners load_corners(const FieldTable& fields, Ints brick, Floats in_brick) {
    const Ints offset =
        hn::ShiftLeft<kLogBrickBytes>(brick) + hn::ShiftLeft<1>(hn::ConvertTo(kInt, in_brick));
    const auto* base = reinterpret_cast<const std::int32_t*>(fields.samples);
    const auto words = [&](int bytes)
                           HWY_ATTR { return hn::GatherOffset(kInt, base, offset + hn::Set(kInt, bytes)); };
    if (fields.bits == SampleBits::k8) {
        // Two samples along y, and the same two one further along z.
        const Ints near = words(0), far = words(kSampleBytesX);
        const Floats unit = hn::Set(kFloat, kCoarseSteps);
        const auto shifted = [&](Ints word)
                                 HWY_ATTR { return hn::ConvertTo(kFloat, hn::ShiftRight<24>(word)) * unit; };
        return {shifted(hn::ShiftLeft<24>(near)), shifted(hn::ShiftLeft<8>(near)),
                shifted(hn::ShiftLeft<16>(near)), shifted(near),
                shifted(hn::ShiftLeft<24>(far)),  shifted(hn::ShiftLeft<8>(far)),
                shifted(hn::ShiftLeft<16>(far)),  shifted(far)};
    }
    // Two samples along z in a word.
    const Ints w00 = words(0), w01 = words(kSampleBytesY), w10 = words(kSampleBytesX),
               w11 = words(kSampleBytesX + kSampleBytesY);
    const auto low_half = [](Ints word) HWY_ATTR {
        return hn::ConvertTo(kFloat, hn::ShiftRight<16>(hn::ShiftLeft<16>(word)));
    };
    const auto high_half = [](Ints word) HWY_ATTR { return hn::ConvertTo(kFloat, hn::ShiftRight<16>(word)); };
    return {low_half(w00), high_half(w00), low_half(w01), high_half(w01),
            low_half(w10), high_half(w10), low_half(w11), high_half(w11)};
}

/// Finds the crossing along a part of the ray through a cell. @param negative the sign that the ray brings
/// @param root where, in parts of the way from `near` to `far`
template <HitMode kMode>
HWY_INLINE HWY_ATTR Mask find_crossing(const Corners& corners, const Point& near, const Point& far,
                                       Floats at_near, Mask negative, Floats& root) {
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f);
    const Point way{far.x - near.x, far.y - near.y, far.z - near.z};
    Mask found;
    if constexpr (kMode == HitMode::kCubic) {
        root = first_root(cubic_along(corners, near.x, near.y, near.z, way.x, way.y, way.z), negative, found);
        return found;
    }
    const Floats at_far = corners.at(far.x, far.y, far.z);
    const Mask at_once = differ(is_negative(at_near), negative);
    found = hn::Or(at_once, differ(is_negative(at_far), negative));
    Floats low = zero, high = one, at_low = at_near, at_high = at_far;
    root = at_low / (at_low - at_high);
    constexpr int kRefinements = 2;
    for (int i = 0; i < kRefinements; ++i) {
        const Point at = along(near, way, root);
        const Floats at_root = corners.at(at.x, at.y, at.z);
        const Mask before = hn::Not(differ(is_negative(at_root), negative));
        low = hn::IfThenElse(before, root, low);
        at_low = hn::IfThenElse(before, at_root, at_low);
        high = hn::IfThenElse(before, high, root);
        at_high = hn::IfThenElse(before, at_high, at_root);
        const Floats closer = low + (high - low) * (at_low / (at_low - at_high));
        if constexpr (kMode == HitMode::kEps) {
            const Mask near_enough =
                hn::Lt(hn::Abs(at_root), hn::Set(kFloat, kHitEpsVoxels / kSampleStepVoxels));
            root = hn::IfThenElse(near_enough, root, closer);
            if (hn::AllTrue(kFloat, hn::Or(near_enough, hn::Not(found)))) break;
        } else {
            root = closer;
        }
    }
    root = hn::IfThenZeroElse(at_once, root);
    return found;
}

/// Searches cells, all lanes at once, until each ray has its crossing or has left the slab that it came into.
/// @param resumed takes the rays that go on
template <HitMode kMode>
HWY_INLINE HWY_ATTR void search(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                                Candidates& candidates, std::vector<Resumed>& resumed) {
    const std::size_t lanes = hn::Lanes(kFloat);
    const Floats zero = hn::Zero(kFloat), one = hn::Set(kFloat, 1.0f), seven = hn::Set(kFloat, kBlockCells);
    constexpr int kLogRayFloats = 4;
    static_assert(sizeof(MarchRay) == sizeof(float) << kLogRayFloats);
    const auto* ray_floats = reinterpret_cast<const float*>(rays);
    while (candidates.size > 0) {
        candidates.pad();
        std::size_t kept = 0;
        for (std::size_t begin = 0; begin < candidates.size; begin += lanes) {
            const Ints ray_index = hn::ShiftLeft<kLogRayFloats>(hn::Load(kInt, &candidates.ray[begin]));
            const auto of_ray = [&](int number) HWY_ATTR {
                return hn::GatherIndex(kFloat, ray_floats + number, ray_index);
            };
            const Point origin{of_ray(0), of_ray(1), of_ray(2)};
            const Point direction{of_ray(3), of_ray(4), of_ray(5)};
            const Floats length = of_ray(6);
            const Floats s = hn::Load(kFloat, &candidates.s[begin]),
                         end = hn::Load(kFloat, &candidates.end[begin]);
            const Point cell{hn::Load(kFloat, &candidates.cx[begin]), hn::Load(kFloat, &candidates.cy[begin]),
                             hn::Load(kFloat, &candidates.cz[begin])};
            const auto block_of = [&](Floats c) HWY_ATTR {
                return hn::Floor((c + hn::Set(kFloat, 0.5f)) * hn::Set(kFloat, 1.0f / kBlockCells)) * seven;
            };
            const Point block{block_of(cell.x), block_of(cell.y), block_of(cell.z)};
            const Corners corners = load_corners(
                fields, hn::Load(kInt, &candidates.brick[begin]),
                ((cell.x - block.x) * hn::Set(kFloat, 64.0f) + (cell.y - block.y) * hn::Set(kFloat, 8.0f)) +
                    (cell.z - block.z));

            const auto exit_along = [&](Floats low, Floats o, Floats d) HWY_ATTR {
                const Floats inverse = hn::IfThenElse(hn::Eq(d, zero), hn::Set(kFloat, kHuge), one / d);
                return (low + hn::IfThenZeroElse(hn::Lt(d, zero), one) - o) * inverse;
            };
            const Point exits{exit_along(cell.x, origin.x, direction.x),
                              exit_along(cell.y, origin.y, direction.y),
                              exit_along(cell.z, origin.z, direction.z)};
            const Floats exit = hn::Max(s, hn::Min(exits.x, hn::Min(exits.y, exits.z)));
            const auto in_cell = [&](Floats at) HWY_ATTR {
                const Point there = along(origin, direction, at);
                return Point{unit_clamped(there.x - cell.x), unit_clamped(there.y - cell.y),
                             unit_clamped(there.z - cell.z)};
            };
            const Point near = in_cell(s), far = in_cell(exit);
            const Floats at_near = corners.at(near.x, near.y, near.z);
            const Floats brought = hn::Load(kFloat, &candidates.sign[begin]);
            const Floats sign = hn::IfThenElse(hn::Eq(brought, zero), hn::CopySign(one, at_near), brought);
            const Floats part = exit - s;
            Floats root;
            const Mask found = find_crossing<kMode>(corners, near, far, at_near, is_negative(sign), root);
            const Floats hit_s = s + root * part;

            // On to the next cell, as long as it is in the slab and in the brick.
            const Mask across_x = hn::And(hn::Le(exits.x, exits.y), hn::Le(exits.x, exits.z));
            const Mask across_y = hn::AndNot(across_x, hn::Le(exits.y, exits.z));
            const Mask across_z = hn::Not(hn::Or(across_x, across_y));
            const auto cell_after = [&](Floats c, Floats d, Mask across) HWY_ATTR {
                const Floats step = hn::IfThenElse(hn::Lt(d, zero), zero - one, one);
                return c + hn::IfThenElseZero(across, step);
            };
            const Point next{cell_after(cell.x, direction.x, across_x),
                             cell_after(cell.y, direction.y, across_y),
                             cell_after(cell.z, direction.z, across_z)};
            const auto within = [&](Floats c, Floats low)
                                    HWY_ATTR { return hn::And(hn::Ge(c, low), hn::Lt(c, low + seven)); };
            const Mask in_brick =
                hn::And(within(next.x, block.x), hn::And(within(next.y, block.y), within(next.z, block.z)));
            const Mask goes_on = hn::AndNot(found, hn::And(in_brick, hn::Lt(exit, end)));
            const Ints steps = hn::Load(kInt, &candidates.steps[begin]) + hn::Set(kInt, 1);
            hn::Store(steps, kInt, &candidates.steps[begin]);
            hn::Store(sign, kFloat, &candidates.sign[begin]);

            alignas(64) float hit_at[kMostLanes], cell_at[3][kMostLanes];
            hn::Store(hit_s, kFloat, hit_at);
            hn::Store(cell.x, kFloat, cell_at[0]);
            hn::Store(cell.y, kFloat, cell_at[1]);
            hn::Store(cell.z, kFloat, cell_at[2]);
            hn::Store(exit, kFloat, &candidates.s[begin]);
            hn::Store(next.x, kFloat, &candidates.cx[begin]);
            hn::Store(next.y, kFloat, &candidates.cy[begin]);
            hn::Store(next.z, kFloat, &candidates.cz[begin]);
            const std::size_t count = candidates.size - begin < lanes ? candidates.size - begin : lanes;
            const Mask is_there = hn::FirstN(kFloat, count), stays = hn::And(is_there, goes_on);
            const Mask leaves = hn::AndNot(goes_on, is_there);
            const Mask resumes = hn::AndNot(
                found,
                hn::And(leaves, hn::Lt(hn::Load(kFloat, &candidates.next_s[begin]), hn::Set(kFloat, kHuge))));
            const std::uint64_t hit_bits = bits_of(hn::And(found, hn::Le(hit_s, length)));
            for (std::uint64_t bits = bits_of(resumes); bits != 0; bits &= bits - 1) {
                const std::size_t i = begin + static_cast<std::size_t>(__builtin_ctzll(bits));
                resumed.push_back({static_cast<std::uint32_t>(candidates.ray[i]),
                                   candidates.next_s[i],
                                   {candidates.next_x[i], candidates.next_y[i], candidates.next_z[i]},
                                   candidates.sign[i],
                                   candidates.steps[i]});
            }
            for (std::uint64_t bits = bits_of(hn::AndNot(resumes, leaves)); bits != 0; bits &= bits - 1) {
                const auto lane = static_cast<std::size_t>(__builtin_ctzll(bits));
                const std::size_t i = begin + lane;
                const bool is_hit = hit_bits >> lane & 1;
                MarchHit& hit = hits[candidates.ray[i]];
                hit.distance = is_hit ? hit_at[lane] : 0.0f;
                hit.brick = candidates.brick[i];
                hit.surface = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    hit.cell[axis] = static_cast<std::int16_t>(cell_at[axis][lane]);
                }
                hit.status = is_hit ? MarchStatus::kHit : MarchStatus::kMiss;
                if (is_hit) {
                    hit.surface = fields.bricks[hit.brick].entry(
                        hit.cell[0] % kBrickCells,
                        hit.cell[1] % kBrickCells * kBrickCells + hit.cell[2] % kBrickCells);
                    __builtin_prefetch(&fields.cells[hit.surface]);
                }
                hit.enters_negative = candidates.sign[i] > 0.0f;
                hit.steps = static_cast<std::uint32_t>(candidates.steps[i]);
            }
            for (std::uint64_t bits = bits_of(stays); bits != 0; bits &= bits - 1) {
                candidates.move(begin + static_cast<std::size_t>(__builtin_ctzll(bits)), kept++);
            }
        }
        candidates.size = kept;
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#endif  // per target
