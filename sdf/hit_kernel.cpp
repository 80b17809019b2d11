#include "sdf/hit_kernel.h"

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/hit_kernel.cpp"
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
using ByteTag = hn::Rebind<std::uint8_t, IntTag>;
using Floats = hn::Vec<FloatTag>;
using Ints = hn::Vec<IntTag>;

constexpr FloatTag kFloat;
constexpr IntTag kInt;
constexpr ByteTag kByte;

struct Vector {
    Floats x, y, z;
};

HWY_INLINE HWY_ATTR Floats dot(const Vector& a, const Vector& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
HWY_INLINE HWY_ATTR Vector scaled(const Vector& v, Floats s) {
    return {v.x * s, v.y * s, v.z * s};
}
HWY_INLINE HWY_ATTR Vector normalized(const Vector& v) {
    return scaled(v, hn::Set(kFloat, 1.0f) / hn::Sqrt(dot(v, v)));
}
HWY_INLINE HWY_ATTR Floats length(const Vector& v) {
    return hn::Sqrt(dot(v, v));
}

/// The placements' numbers for every lane: broadcast where all lanes are at one instance.
class Placements {
public:
    HWY_ATTR Placements(const HitPlacement* placements, Ints instances)
        : words_(reinterpret_cast<const float*>(placements)) {
        constexpr int kWords = sizeof(HitPlacement) / sizeof(float);
        const std::int32_t first = hn::GetLane(instances);
        is_one_ = hn::AllTrue(kInt, hn::Eq(instances, hn::Set(kInt, first)));
        first_ = words_ + static_cast<std::ptrdiff_t>(first) * kWords;
        offsets_ = instances * hn::Set(kInt, kWords);
    }
    HWY_ATTR Floats get(int number) const {
        if (is_one_) return hn::Set(kFloat, first_[number]);
        return hn::GatherIndex(kFloat, words_ + number, offsets_);
    }

private:
    const float* words_;
    const float* first_;
    bool is_one_;
    Ints offsets_;
};

/// Word number of a member.
#define FIELDLIGHT_WORD(member) (offsetof(NearestHit, member) / sizeof(float))

HWY_ATTR void finish_hits(const core::RayStream& rays, std::size_t begin, std::size_t count,
                          const NearestHit* nearest, std::size_t stride, const HitPlacement* placements,
                          core::HitStream& hits) {
    const Floats zero = hn::Zero(kFloat);
    const Ints none = hn::Set(kInt, -1);
    static_assert(core::kNoIndex == 0xffffffffu);
    const auto* words = reinterpret_cast<const std::int32_t*>(nearest);
    const auto stride_words = static_cast<std::int32_t>(stride / sizeof(float));
    for (std::size_t i = 0; i < count; i += hn::Lanes(kFloat)) {
        // Beyond the end the last one is read again.
        const Ints number = hn::Min(hn::Iota(kInt, static_cast<std::int32_t>(i)),
                                    hn::Set(kInt, static_cast<std::int32_t>(count) - 1));
        const Ints first = number * hn::Set(kInt, stride_words);
        const auto int_at = [&](std::size_t word)
                                HWY_ATTR { return hn::GatherIndex(kInt, words + word, first); };
        const auto float_at = [&](std::size_t word) HWY_ATTR { return hn::BitCast(kFloat, int_at(word)); };
        const std::size_t at = begin + i;
        const Ints instance = int_at(FIELDLIGHT_WORD(instance));
        const auto found = hn::Not(hn::Eq(instance, none));
        const auto found_float = hn::RebindMask(kFloat, found);
        auto* instance_to = reinterpret_cast<std::int32_t*>(&hits.instance[at]);
        auto* triangle_to = reinterpret_cast<std::int32_t*>(&hits.triangle[at]);
        hn::Store(instance, kInt, instance_to);
        if (hn::AllFalse(kInt, found)) {
            hn::Store(hn::Set(kFloat, std::numeric_limits<float>::infinity()), kFloat, &hits.t[at]);
            for (core::Column<float>* column : {&hits.normal_x, &hits.normal_y, &hits.normal_z,
                                                &hits.barycentric_u, &hits.barycentric_v, &hits.offset}) {
                hn::Store(zero, kFloat, column->data() + at);
            }
            hn::Store(none, kInt, triangle_to);
            hn::Store(hn::Set(kByte, 1), kByte, &hits.front[at]);
            hn::Store(hn::Zero(kByte), kByte, reinterpret_cast<std::uint8_t*>(&hits.status[at]));
            continue;
        }
        const Placements placed(placements, hn::Max(instance, hn::Zero(kInt)));
        const Vector gradient{float_at(FIELDLIGHT_WORD(gradient)), float_at(FIELDLIGHT_WORD(gradient) + 1),
                              float_at(FIELDLIGHT_WORD(gradient) + 2)};
        const auto row = [&](int axis) HWY_ATTR {
            return placed.get(axis) * gradient.x + placed.get(3 + axis) * gradient.y +
                   placed.get(6 + axis) * gradient.z;
        };
        const Vector outwards = normalized({row(0), row(1), row(2)});
        static_assert(offsetof(NearestHit, is_front) == offsetof(NearestHit, enters_negative) + 1);
        const Ints flags = int_at(FIELDLIGHT_WORD(enters_negative));
        const auto enters_negative = hn::RebindMask(kFloat, hn::TestBit(flags, hn::Set(kInt, 1)));
        const Floats side = hn::IfThenElse(enters_negative, hn::Set(kFloat, 1.0f), hn::Set(kFloat, -1.0f));
        Vector normal = scaled(outwards, side);
        const Vector direction{hn::Load(kFloat, &rays.direction_x[at]),
                               hn::Load(kFloat, &rays.direction_y[at]),
                               hn::Load(kFloat, &rays.direction_z[at])};
        // The smooth normal may turn away from a ray that only just meets the surface. Its side stays what
        // the crossing says; it is tilted until it faces the ray.
        const Floats cosine = dot(normal, direction), facing = hn::Set(kFloat, kFacing);
        const auto turned_away = hn::Gt(cosine, hn::Neg(facing));
        if (!hn::AllFalse(kFloat, turned_away)) {
            const Floats back = cosine + (facing + facing);
            const Vector tilted = normalized({normal.x - back * direction.x, normal.y - back * direction.y,
                                              normal.z - back * direction.z});
            normal = {hn::IfThenElse(turned_away, tilted.x, normal.x),
                      hn::IfThenElse(turned_away, tilted.y, normal.y),
                      hn::IfThenElse(turned_away, tilted.z, normal.z)};
        }
        const Floats t =
            hn::Min(hn::Max(float_at(FIELDLIGHT_WORD(rounded_t)), hn::Load(kFloat, &rays.t_min[at])),
                    hn::Load(kFloat, &rays.t_max[at]));
        const Vector origin{hn::Load(kFloat, &rays.origin_x[at]), hn::Load(kFloat, &rays.origin_y[at]),
                            hn::Load(kFloat, &rays.origin_z[at])};
        const Vector position{origin.x + t * direction.x, origin.y + t * direction.y,
                              origin.z + t * direction.z};
        // What a position rounds to: four units in the last place.
        constexpr float kFourUlp = 4.0f * std::numeric_limits<float>::epsilon();
        const Floats rounding =
            hn::Max(hn::Max(length(position), length(origin)), t) * hn::Set(kFloat, kFourUlp);
        const auto store = [&](Floats value, core::Column<float>& column) HWY_ATTR {
            hn::Store(hn::IfThenElseZero(found_float, value), kFloat, column.data() + at);
        };
        hn::Store(hn::IfThenElse(found_float, t, hn::Set(kFloat, std::numeric_limits<float>::infinity())),
                  kFloat, &hits.t[at]);
        store(normal.x, hits.normal_x);
        store(normal.y, hits.normal_y);
        store(normal.z, hits.normal_z);
        store(hn::Max(placed.get(9), rounding), hits.offset);
        store(float_at(FIELDLIGHT_WORD(barycentrics)), hits.barycentric_u);
        store(float_at(FIELDLIGHT_WORD(barycentrics) + 1), hits.barycentric_v);
        hn::Store(hn::IfThenElse(found, int_at(FIELDLIGHT_WORD(triangle)), none), kInt, triangle_to);
        const auto is_front = hn::Or(hn::TestBit(flags, hn::Set(kInt, 0x100)), hn::Not(found));
        const Ints one = hn::Set(kInt, 1);
        hn::Store(hn::DemoteTo(kByte, hn::IfThenElseZero(is_front, one)), kByte, &hits.front[at]);
        static_assert(static_cast<int>(core::HitStatus::kMiss) == 0 &&
                      static_cast<int>(core::HitStatus::kHit) == 1);
        hn::Store(hn::DemoteTo(kByte, hn::IfThenElseZero(found, one)), kByte,
                  reinterpret_cast<std::uint8_t*>(&hits.status[at]));
    }
}

#undef FIELDLIGHT_WORD

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace sdf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace sdf {

HWY_EXPORT(finish_hits);

void finish_hits(const core::RayStream& rays, std::size_t begin, std::size_t count, const NearestHit* nearest,
                 std::size_t stride, const HitPlacement* placements, core::HitStream& hits) {
    if (count == 0) return;
    HWY_DYNAMIC_DISPATCH(finish_hits)(rays, begin, count, nearest, stride, placements, hits);
}

}  // namespace sdf

#endif  // HWY_ONCE
