// gather/effect_costs.h: what each effect of a plan took: time, rays and memory.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/render/renderer.h"
#include "gather/integrate/bent_normal.h"
#include "gather/plan.h"
#include "gather/settings.h"
#include "gather/temporal/accumulation.h"

namespace gather {

/// Of an effect that is off, everything is 0 or empty.
struct EffectCost {
    /// It takes part in these. Several effects may share a pass, and then its cost stands at each of them.
    std::vector<std::string> passes;
    double seconds = 0.0;     ///< Of those passes: the effect itself costs no more.
    std::uint64_t rays = 0;   ///< Likewise.
    std::uint64_t bytes = 0;  ///< Memory that would not be needed without it, at most.
};

/// @param passes that ran, of a frame that this plan made
std::array<EffectCost, kEffectCount> effect_costs(const Plan& plan, const std::vector<core::PassCost>& passes,
                                                  int width, int height, const Settings& settings);

/// Bytes a pixel that comparing near light with the probes takes; while pixels share it, there are two.
constexpr std::uint64_t kNearLightBytes = 2 * sizeof(NearLight) + sizeof(float) + sizeof(ProbeAgreement) + 2 +
                                          2 * sizeof(glm::vec3) + Accumulation::kControlBytes + sizeof(float);

/// Most bytes of the probes' cache under this plan.
std::uint64_t probe_cache_bytes(const Plan& plan, int width, int height, const Settings& settings);

/// Most bytes of all effects that are on.
std::uint64_t effect_bytes(const Plan& plan, int width, int height, const Settings& settings);

}  // namespace gather
