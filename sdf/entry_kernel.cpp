#include "sdf/entry_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/entry_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DoubleTag = hn::ScalableTag<double>;
using FloatTag = hn::Rebind<float, DoubleTag>;
using IndexTag = hn::Rebind<std::int32_t, DoubleTag>;
using LongTag = hn::RebindToSigned<DoubleTag>;
using Doubles = hn::Vec<DoubleTag>;

constexpr DoubleTag kDouble;
constexpr FloatTag kFloat;
constexpr IndexTag kIndex;
constexpr LongTag kLong;
constexpr std::size_t kMostLanes = HWY_MAX_BYTES / sizeof(double);

/// In place of the inverse of 0: a ray in the face of a box is inside that slab, and no NaN arises.
constexpr double kHuge = 1e200;
/// Directions with a smaller part along an axis run parallel to it.
constexpr double kParallel = 1e-20;
/// A hit close to the ray's end is for the kernel to find and for its caller to judge in double.
constexpr double kBeyondEnd = 1e-3;

struct Vector {
    Doubles x, y, z;
};

/// The placement's numbers for every lane: broadcast where all lanes are at one instance, as they mostly are.
class Placements {
public:
    HWY_ATTR Placements(const FieldPlacement* placements, const std::int32_t* instances, std::size_t lanes)
        : base_(reinterpret_cast<const double*>(placements)) {
        for (std::size_t i = 1; i < lanes; ++i) is_one_ = is_one_ && instances[i] == instances[0];
        const auto stride = static_cast<std::int32_t>(sizeof(FieldPlacement) / sizeof(double));
        first_ = base_ + static_cast<std::ptrdiff_t>(instances[0]) * stride;
        offset_ = hn::PromoteTo(kLong, hn::Load(kIndex, instances) * hn::Set(kIndex, stride));
    }

    HWY_ATTR Doubles get(int number) const {
        if (is_one_) return hn::Set(kDouble, first_[number]);
        return hn::GatherIndex(kDouble, base_, offset_ + hn::Set(kLong, number));
    }

private:
    const double* base_;
    const double* first_ = nullptr;
    bool is_one_ = true;
    hn::Vec<LongTag> offset_;
};
static_assert(sizeof(FieldPlacement) % sizeof(double) == 0);

HWY_INLINE HWY_ATTR Vector transformed(const Placements& placements, const Vector& v) {
    return {placements.get(0) * v.x + placements.get(3) * v.y + placements.get(6) * v.z,
            placements.get(1) * v.x + placements.get(4) * v.y + placements.get(7) * v.z,
            placements.get(2) * v.x + placements.get(5) * v.y + placements.get(8) * v.z};
}

HWY_ATTR void enter_fields(const core::RayStream& rays, const FieldPlacement* placements, Entries& entries,
                           std::size_t count, MarchRay* passing) {
    const std::size_t lanes = hn::Lanes(kDouble);
    const Doubles zero = hn::Zero(kDouble), one = hn::Set(kDouble, 1.0);
    for (std::size_t begin = 0; begin < count; begin += lanes) {
        const std::int32_t* ray = &entries.ray[begin];
        const auto ray_index = hn::Load(kIndex, ray);
        const auto column = [&](const core::Column<float>& values) HWY_ATTR {
            return hn::PromoteTo(kDouble, hn::GatherIndex(kFloat, values.data(), ray_index));
        };
        const Placements placed(placements, &entries.instance[begin], lanes);
        const Vector world_origin{column(rays.origin_x), column(rays.origin_y), column(rays.origin_z)};
        const Vector world_direction{column(rays.direction_x), column(rays.direction_y),
                                     column(rays.direction_z)};
        const Vector rotated = transformed(placed, world_origin);
        const Vector origin{rotated.x + placed.get(9), rotated.y + placed.get(10),
                            rotated.z + placed.get(11)};
        const Vector direction = transformed(placed, world_direction);

        Doubles t_min = column(rays.t_min), t_max = hn::Load(kDouble, &entries.limit[begin]);
        const auto clip = [&](Doubles o, Doubles d, Doubles size) HWY_ATTR {
            const Doubles inverse = hn::IfThenElse(hn::Eq(d, zero), hn::Set(kDouble, kHuge), one / d);
            const Doubles a = (zero - o) * inverse, b = (size - o) * inverse;
            const auto swapped = hn::Gt(a, b);
            const Doubles near = hn::IfThenElse(swapped, b, a), far = hn::IfThenElse(swapped, a, b);
            t_min = hn::IfThenElse(hn::Gt(near, t_min), near, t_min);
            t_max = hn::IfThenElse(hn::Lt(far, t_max), far, t_max);
        };
        const Vector size{placed.get(12), placed.get(13), placed.get(14)};
        clip(origin.x, direction.x, size.x);
        clip(origin.y, direction.y, size.y);
        clip(origin.z, direction.z, size.z);

        const Doubles speed =
            hn::Sqrt(direction.x * direction.x + direction.y * direction.y + direction.z * direction.z);
        const Doubles t_per_voxel = one / speed;
        hn::Store(t_min, kDouble, &entries.t_min[begin]);
        hn::Store(t_max, kDouble, &entries.t_max[begin]);
        hn::Store(t_per_voxel, kDouble, &entries.t_per_voxel[begin]);

        alignas(64) float start[3][kMostLanes], unit[3][kMostLanes], length[kMostLanes];
        const auto store_axis = [&](int axis, Doubles o, Doubles d, Doubles end) HWY_ATTR {
            const Doubles at = o + t_min * d, u = d * t_per_voxel;
            hn::Store(hn::DemoteTo(kFloat, hn::Min(hn::Max(at, zero), end)), kFloat, start[axis]);
            const Doubles straight = hn::IfThenZeroElse(hn::Lt(hn::Abs(u), hn::Set(kDouble, kParallel)), u);
            hn::Store(hn::DemoteTo(kFloat, straight), kFloat, unit[axis]);
        };
        store_axis(0, origin.x, direction.x, size.x);
        store_axis(1, origin.y, direction.y, size.y);
        store_axis(2, origin.z, direction.z, size.z);
        hn::Store(hn::DemoteTo(kFloat, (t_max - t_min) * speed + hn::Set(kDouble, kBeyondEnd)), kFloat,
                  length);
        for (std::size_t lane = 0; lane < lanes && begin + lane < count; ++lane) {
            if (!(entries.t_min[begin + lane] <= entries.t_max[begin + lane])) continue;
            const FieldPlacement& placement = placements[entries.instance[begin + lane]];
            MarchRay& to = *passing++;
            for (int axis = 0; axis < 3; ++axis) {
                to.origin[axis] = start[axis][lane];
                to.direction[axis] = unit[axis][lane];
                to.cell_count[axis] = static_cast<float>(placement.box[axis]);
            }
            to.length = length[lane];
            to.top_base = placement.top_base;
            to.top_octant = placement.top_octant;
            to.top_stride_x = placement.top_stride_x;
            to.top_stride_y = placement.top_stride_y;
        }
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sdf {

HWY_EXPORT(enter_fields);

void enter_fields(const core::RayStream& rays, const FieldPlacement* placements, Entries& entries,
                  std::size_t count, MarchRay* passing) {
    // The last vector is filled up with the first entry.
    for (std::size_t i = count; i < core::padded_stream_size(count); ++i) {
        entries.ray[i] = entries.ray[0];
        entries.instance[i] = entries.instance[0];
        entries.limit[i] = entries.limit[0];
    }
    HWY_DYNAMIC_DISPATCH(enter_fields)(rays, placements, entries, count, passing);
}

Entries::Entries(std::size_t capacity) {
    const std::size_t padded = core::padded_stream_size(capacity);
    for (auto* column : {&ray, &instance}) column->resize(padded);
    for (auto* column : {&limit, &t_min, &t_max, &t_per_voxel}) column->resize(padded);
}

}  // namespace sdf

#endif  // HWY_ONCE
