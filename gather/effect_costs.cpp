#include "gather/effect_costs.h"

#include <algorithm>
#include <string_view>

#include "gather/integrate/reflections.h"
#include "gather/screen_probes/placement.h"
#include "gather/screen_probes/probe_atlas.h"

namespace gather {

namespace {

/// The passes of final_gather.cpp that an effect takes part in.
std::vector<std::string_view> passes_of(Effect effect) {
    switch (effect) {
        case Effect::kPunctualLights:
        case Effect::kSun:
        case Effect::kEmissiveSampling:
            return {"outline_shadows", "direct", "probe_shadows", "bent_normal_shadows",
                    "reflection_shadows"};
        case Effect::kSky:
            return {"primary",      "outlines",          "outline_shadows", "direct",
                    "trace_probes", "probe_shadows",     "bent_normal",     "bent_normal_shadows",
                    "reflections",  "reflection_shadows"};
        case Effect::kAlphaMask:
        case Effect::kAlphaBlend:
            return {"primary",          "outlines",          "outline_shadows",
                    "direct",           "trace_probes",      "probe_shadows",
                    "probe_visibility", "bent_normal",       "bent_normal_shadows",
                    "reflections",      "reflection_shadows"};
        case Effect::kScreenProbes:
            return {"place_probes", "trace_probes", "probe_shadows", "integrate", "probe_visibility"};
        case Effect::kAdaptiveProbes:
            return {"place_probes", "trace_probes", "probe_shadows"};
        case Effect::kLightingPdf:
            return {"trace_probes"};
        case Effect::kSpatialFilter:
            return {"filter_probes"};
        case Effect::kRoughSpecular:
            return {"integrate"};
        case Effect::kReflections:
            return {"reflections", "reflection_shadows", "reflection_reuse"};
        case Effect::kBentNormal:
            return {"near_field", "bent_normal", "bent_normal_shadows", "integrate"};
        case Effect::kTemporal:
            return {"accumulate", "outlines", "outline_shadows"};
    }
    return {};
}

/// Of a texel, while near fields are taken out: the light and the distance written beside those read.
constexpr std::uint64_t kNearCopyBytes = sizeof(glm::vec3) + sizeof(float);

std::uint64_t bytes_of(Effect effect, const Plan& plan, int width, int height, const Settings& settings) {
    if (!plan.on(effect)) return 0;
    const glm::ivec2 tiles = tile_grid(width, height, settings.screen_probes.spacing);
    const std::uint64_t uniform = static_cast<std::uint64_t>(tiles.x) * static_cast<std::uint64_t>(tiles.y);
    const std::uint64_t adaptive = plan.on(Effect::kAdaptiveProbes)
                                       ? adaptive_limit(width, height, settings.screen_probes)
                                       : std::uint64_t{0};
    // Where each tile's adaptive probes begin.
    const std::uint64_t list =
        plan.on(Effect::kAdaptiveProbes) ? (uniform + 1) * sizeof(std::uint32_t) : std::uint64_t{0};
    const std::uint64_t one_probe = probe_bytes(settings.screen_probes.resolution);
    const auto edge = static_cast<std::uint64_t>(settings.screen_probes.resolution);
    switch (effect) {
        case Effect::kScreenProbes:
            return uniform * one_probe;
        case Effect::kAdaptiveProbes:
            return adaptive * one_probe + list;
        case Effect::kLightingPdf:  // The last frame's atlas.
            return (uniform + adaptive) * one_probe + list;
        case Effect::kSpatialFilter:  // A pass reads one copy of the light and writes the other.
            return (uniform + adaptive) * edge * edge * (sizeof(glm::vec3) + 2);
        case Effect::kBentNormal: {
            // The near field besides: a pixel's light and its history, and a copy of the probes' texels.
            const bool traced = settings.integrate.near_field == NearField::kTraced;
            const std::uint64_t pixel = sizeof(BentNormal) + (traced ? kNearLightBytes : 0);
            return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * pixel +
                   (traced ? (uniform + adaptive) * edge * edge * kNearCopyBytes : 0);
        }
        case Effect::kReflections:
            return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
                   static_cast<std::uint64_t>(settings.integrate.reflection_rays) * sizeof(ReflectionRay);
        default:  // They keep nothing of their own.
            return 0;
    }
}

}  // namespace

std::array<EffectCost, kEffectCount> effect_costs(const Plan& plan, const std::vector<core::PassCost>& passes,
                                                  int width, int height, const Settings& settings) {
    std::array<EffectCost, kEffectCount> costs;
    for (std::size_t i = 0; i < kEffectCount; ++i) {
        const auto effect = static_cast<Effect>(i);
        if (!plan.on(effect)) continue;
        const std::vector<std::string_view> names = passes_of(effect);
        for (const core::PassCost& pass : passes) {
            if (std::ranges::find(names, pass.name) == names.end()) continue;
            costs[i].passes.push_back(pass.name);
            costs[i].seconds += pass.seconds;
            costs[i].rays += pass.rays;
        }
        costs[i].bytes = bytes_of(effect, plan, width, height, settings);
    }
    return costs;
}

std::uint64_t probe_cache_bytes(const Plan& plan, int width, int height, const Settings& settings) {
    std::uint64_t sum = 0;
    for (const Effect effect :
         {Effect::kScreenProbes, Effect::kAdaptiveProbes, Effect::kLightingPdf, Effect::kSpatialFilter}) {
        sum += bytes_of(effect, plan, width, height, settings);
    }
    return sum;
}

std::uint64_t effect_bytes(const Plan& plan, int width, int height, const Settings& settings) {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < kEffectCount; ++i) {
        sum += bytes_of(static_cast<Effect>(i), plan, width, height, settings);
    }
    return sum;
}

}  // namespace gather
