#include "sdf/field_kernel.h"

#include <cstdint>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sdf/field_kernel.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include "sdf/cell_search-inl.h"
#include "sdf/field_kernel-inl.h"
#include "sdf/field_walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sdf {
namespace HWY_NAMESPACE {
namespace {

/// What a ray is that met nothing.
HWY_INLINE HWY_ATTR void store_end(const Packet& p, std::size_t lane, MarchStatus status, MarchHit& hit) {
    hit.distance = 0.0f;
    hit.brick = hit.surface = 0;
    hit.cell[0] = hit.cell[1] = hit.cell[2] = 0;
    hit.status = status;
    hit.enters_negative = false;
    hit.steps = static_cast<std::uint32_t>(p.steps[lane]);
}

/// Walks from box to box with the rays in the lanes of two packets: while one waits for memory, the other
/// computes. Rays that come to a piece of surface leave their lanes, and are searched for crossings together;
/// those that have none go on in whatever lane is free.
template <HitMode kMode>
HWY_INLINE HWY_ATTR void march_all(const FieldTable& fields, const MarchRay* rays, MarchHit* hits,
                                   std::size_t count) {
    constexpr int kPackets = 2;
    Packet packets[kPackets];
    Candidates candidates;
    std::vector<Resumed> resumed;
    const std::size_t lanes = hn::Lanes(kFloat);
    std::size_t next = 0, busy = 0;
    // Whether there was a ray left for the lane.
    const auto refill = [&](Packet& p, std::size_t lane) HWY_ATTR {
        if (!resumed.empty()) {
            const Resumed& at = resumed.back();
            load_lane(p, lane, rays[at.ray], at.ray);
            resume_lane(p, lane, at);
            resumed.pop_back();
        } else if (next < count) {
            load_lane(p, lane, rays[next], static_cast<std::uint32_t>(next));
            ++next;
        } else {
            idle_lane(p, lane);
            return false;
        }
        return true;
    };
    for (;;) {
        for (Packet& p : packets) {
            for (std::size_t lane = 0; lane < lanes; ++lane) busy += refill(p, lane);
            fetch(fields, p);
        }
        while (busy > 0) {
            for (Packet& p : packets) {
                const Ended ended = advance(p);
                const Mask any = hn::Or(ended.at_surface, hn::Or(ended.gone, ended.exhausted));
                if (!hn::AllFalse(kFloat, any)) {
                    const std::uint64_t at_surface = bits_of(ended.at_surface),
                                        exhausted = bits_of(ended.exhausted);
                    for (std::uint64_t bits = bits_of(any); bits != 0; bits &= bits - 1) {
                        const auto lane = static_cast<std::size_t>(__builtin_ctzll(bits));
                        if (!p.is_busy[lane]) continue;
                        if (at_surface >> lane & 1) {
                            candidates.push(fields, p, lane);
                        } else {
                            const bool is_exhausted = exhausted >> lane & 1;
                            store_end(p, lane, is_exhausted ? MarchStatus::kExhausted : MarchStatus::kMiss,
                                      hits[p.ray[lane]]);
                        }
                        if (!refill(p, lane)) --busy;
                    }
                }
                fetch(fields, p);
            }
            if (candidates.size >= Candidates::kFull) search<kMode>(fields, rays, hits, candidates, resumed);
        }
        search<kMode>(fields, rays, hits, candidates, resumed);
        if (resumed.empty()) break;
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

}  // namespace
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
