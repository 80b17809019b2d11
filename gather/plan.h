// gather/plan.h: which passes a scene calls for, each with its reason.
//
// `auto` leaves out only what would be an exact no-op: no pixel, light or texel would enter it. So a picture
// under `auto` equals the one under `all` in every bit.
#pragma once

#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>

#include "core/scene/scene.h"
#include "gather/settings.h"

namespace gather {

enum class Effect {
    kPunctualLights,
    kSun,
    kSky,
    kEmissiveSampling,
    kAlphaMask,
    kAlphaBlend,
    kScreenProbes,
    kAdaptiveProbes,
    kLightingPdf,
    kSpatialFilter,
    kRoughSpecular,
    kReflections,
    kBentNormal,
    kTemporal,
};
inline constexpr std::size_t kEffectCount = 14;

/// As `--effects` spells it: `punctual_lights`, `sky`, ...
std::string_view name_of(Effect effect);

/// What was asked for.
struct EffectRequest {
    enum class Kind { kAuto, kAll, kList } kind = Kind::kAuto;
    std::set<Effect> list;  ///< Of kList: these run and no others.
};

/// `auto`, `all`, or effects by name with commas between. @throws core::InputError (kUsage)
EffectRequest parse_effects(std::string_view text);

struct PlannedEffect {
    bool on = false;
    std::string reason;  ///< For a person: `every material is rougher than 0.8`.
    std::string cost;    ///< Expected, for a person: `1 shadow ray a pixel and a probe ray`.
};

struct Plan {
    std::array<PlannedEffect, kEffectCount> effects;

    const PlannedEffect& operator[](Effect effect) const { return effects[static_cast<std::size_t>(effect)]; }
    bool on(Effect effect) const { return (*this)[effect].on; }
};

/// Decides from scene and settings, without tracing a ray. @param width, height of the picture in pixels
/// @param layers wanted beside the beauty: those that show the probes call for them even in the dark
Plan make_plan(const core::Scene& scene, int width, int height, const Settings& settings,
               const EffectRequest& request, const std::set<std::string>& layers = {});

/// How the light is split under a plan: without emissive_sampling no emitter is sampled.
LightingSettings planned_lighting(const Settings& settings, const Plan& plan);

/// Takes out of the scene what the plan leaves out though the scene has it (an effect that a list does not
/// name): lights, sky, alpha. Under `auto` and `all` it changes nothing. Call it before building tracers.
void apply_plan(const Plan& plan, core::Scene& scene);

}  // namespace gather
