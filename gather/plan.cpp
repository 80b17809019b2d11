#include "gather/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <variant>
#include <vector>

#include "core/scene/brdf.h"
#include "core/support/error.h"
#include "core/trace/surface.h"
#include "gather/lighting/scene_lighting.h"

namespace gather {

namespace {

constexpr std::array<std::string_view, kEffectCount> kNames = {"punctual_lights",
                                                               "sun",
                                                               "sky",
                                                               "emissive_sampling",
                                                               "alpha_mask",
                                                               "alpha_blend",
                                                               "screen_probes",
                                                               "adaptive_probes",
                                                               "lighting_pdf",
                                                               "spatial_filter",
                                                               "rough_specular",
                                                               "reflections",
                                                               "bent_normal",
                                                               "temporal"};

/// What a plan asks of a scene, counted once.
struct SceneFacts {
    int punctual_lights = 0;
    int suns = 0;
    bool sky = false;
    int emissive_instances = 0;
    int mask_parts = 0;
    int blend_parts = 0;
    int reflecting_parts = 0;  ///< Not unlit: light that arrives may leave.
    int smooth_parts = 0;      ///< Parts with a specular lobe that may be smoother than the threshold.
    int mirror_parts = 0;      ///< Likewise, smooth enough for rays of their own.
    int specular_parts = 0;
};

/// Textures and vertex colours only multiply, so a factor is an upper bound of roughness, and 0 a lower one.
bool may_be_smoother(const core::Material& material, float roughness) {
    return material.metallic_roughness_texture.present() || material.roughness <= roughness;
}

SceneFacts find_facts(const core::Scene& scene, const Settings& settings) {
    SceneFacts facts;
    for (const core::Light& light : scene.lights) {
        if (!(core::estimated_power(light, 1.0f) > 0.0f)) continue;
        ++(std::holds_alternative<core::DirectionalLight>(light) ? facts.suns : facts.punctual_lights);
    }
    facts.sky = !scene.sky.black();
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const core::Instance& instance = scene.instances[i];
        bool emissive = false;
        for (std::uint32_t part = 0; part < instance.materials.size(); ++part) {
            const core::Material& material = scene.materials[instance.materials[part]];
            emissive = emissive || material.emissive();
            if (core::may_be_invisible(scene, i, part)) {
                ++(material.alpha_mode == core::AlphaMode::kMask ? facts.mask_parts : facts.blend_parts);
            }
            if (material.unlit) continue;
            ++facts.reflecting_parts;
            if (!core::has_specular(material)) continue;
            ++facts.specular_parts;
            if (may_be_smoother(material, settings.integrate.rough_specular_max)) ++facts.smooth_parts;
            if (may_be_smoother(material, settings.integrate.reflection_roughness_max)) ++facts.mirror_parts;
        }
        if (emissive) ++facts.emissive_instances;
    }
    return facts;
}

std::string counted(int count, const char* what) {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// A plan under way.
class Planner {
public:
    Planner(const core::Scene& scene, const SceneFacts& facts, int width, int height,
            const Settings& settings, const EffectRequest& request, const std::set<std::string>& layers)
        : scene_(scene),
          facts_(facts),
          width_(width),
          height_(height),
          settings_(settings),
          request_(request),
          layers_(layers) {}

    Plan make();

private:
    /// @param called_for what the scene says, with both reasons
    void decide(Effect effect, bool called_for, std::string reason_on, std::string reason_off,
                std::string cost);
    /// Off whatever was asked for. @return whether it is
    bool forbid(Effect effect, bool forbidden, std::string reason);
    /// A layer asked for that shows the probes or what is traced beside them; empty if there is none.
    std::string probe_layer() const;

    const core::Scene& scene_;
    const SceneFacts& facts_;
    const int width_;
    const int height_;
    const Settings& settings_;
    const EffectRequest& request_;
    const std::set<std::string>& layers_;
    Plan plan_;
};

std::string Planner::probe_layer() const {
    for (const std::string& layer : layers_) {
        if (layer == "Probes" || layer == "RaysPerTexel" || layer == "ProbeHitDistance" ||
            layer == "ProbeWeight" || (layer == "BentNormal" && settings_.integrate.bent_normal)) {
            return layer;
        }
    }
    return {};
}

bool Planner::forbid(Effect effect, bool forbidden, std::string reason) {
    if (forbidden) plan_.effects[static_cast<std::size_t>(effect)] = {false, std::move(reason), "none"};
    return forbidden;
}

void Planner::decide(Effect effect, bool called_for, std::string reason_on, std::string reason_off,
                     std::string cost) {
    PlannedEffect& planned = plan_.effects[static_cast<std::size_t>(effect)];
    switch (request_.kind) {
        case EffectRequest::Kind::kAuto:
            planned.on = called_for;
            planned.reason = called_for ? std::move(reason_on) : std::move(reason_off);
            break;
        case EffectRequest::Kind::kAll:
            planned.on = true;
            planned.reason = called_for ? std::move(reason_on)
                                        : fmt::format("asked for by --effects all, though {}", reason_off);
            break;
        case EffectRequest::Kind::kList:
            planned.on = request_.list.count(effect) != 0;
            planned.reason = planned.on ? "named in --effects" : "not named in --effects";
            break;
    }
    planned.cost = planned.on ? std::move(cost) : "none";
}

Plan Planner::make() {
    const ScreenProbeSettings& probes = settings_.screen_probes;
    decide(Effect::kPunctualLights, facts_.punctual_lights > 0,
           counted(facts_.punctual_lights, "point or spot light"), "no point or spot light shines",
           "shares the shadow ray of a pixel and of a probe ray");
    decide(Effect::kSun, facts_.suns > 0, counted(facts_.suns, "directional light"),
           "no directional light shines", "shares the shadow ray of a pixel and of a probe ray");
    decide(Effect::kSky, facts_.sky, "the sky is not black", "the sky is black",
           "a lookup for each ray that leaves the scene");
    if (!forbid(Effect::kEmissiveSampling, settings_.lighting.sampled_emitters == SampledEmitters::kNone,
                "lighting.sampled_emitters is none")) {
        decide(Effect::kEmissiveSampling, facts_.emissive_instances > 0,
               counted(facts_.emissive_instances, "emissive object"), "nothing emits",
               "shares the shadow ray of a pixel and of a probe ray");
    }
    decide(Effect::kAlphaMask, facts_.mask_parts > 0, counted(facts_.mask_parts, "part") + " with alpha MASK",
           "no alpha MASK cuts anything out", "a texture lookup for each hit of such a part");
    decide(Effect::kAlphaBlend, facts_.blend_parts > 0,
           counted(facts_.blend_parts, "part") + " with alpha BLEND", "no alpha BLEND lets light through",
           "a texture lookup for each hit of such a part");

    const bool light =
        facts_.punctual_lights > 0 || facts_.suns > 0 || facts_.sky || facts_.emissive_instances > 0;
    const bool gathers =
        facts_.reflecting_parts > 0 && light &&
        (settings_.bounces > 0 || gathers_anything(scene_, planned_lighting(settings_, plan_)));
    const std::size_t tiles = static_cast<std::size_t>((width_ + probes.spacing - 1) / probes.spacing) *
                              static_cast<std::size_t>((height_ + probes.spacing - 1) / probes.spacing);
    const std::string shown = probe_layer();
    decide(Effect::kScreenProbes, gathers || !shown.empty(),
           gathers ? "surfaces reflect light that comes from other surfaces or from the sky"
                   : fmt::format("the layer {} shows them, though they gather no light", shown),
           facts_.reflecting_parts == 0 ? "every material is unlit"
           : !light                     ? "nothing shines"
                                        : "no bounce is asked for and nothing is found by being hit",
           fmt::format("{} probes of {} rays a frame", tiles, probes.resolution * probes.resolution));
    const bool on = plan_.on(Effect::kScreenProbes);
    const auto depends = [&](Effect effect, bool setting, const char* name) {
        return forbid(effect, !on, "screen_probes is off") ||
               forbid(effect, !setting, fmt::format("{} is off", name));
    };
    if (!depends(Effect::kAdaptiveProbes, probes.adaptive, "screen_probes.adaptive")) {
        const bool room = probes.adaptive_budget > 0.0f && probes.spacing > 2;
        decide(Effect::kAdaptiveProbes, room, "edges may leave pixels without a probe in their plane",
               "the budget is 0, or every second pixel of a row has a probe already",
               fmt::format("at most {:.0f} further probes",
                           static_cast<double>(probes.adaptive_budget) * static_cast<double>(tiles)));
    }
    if (!depends(Effect::kSpatialFilter, probes.spatial_filter, "screen_probes.spatial_filter") &&
        !forbid(Effect::kSpatialFilter, tiles == 1, "a single tile of probes has no neighbour")) {
        decide(Effect::kSpatialFilter, true, fmt::format("{} passes over 3 x 3 probes", probes.filter_passes),
               "", "8 reads a texel and pass");
    }
    if (!depends(Effect::kLightingPdf, probes.lighting_pdf && probes.importance_sampling,
                 "screen_probes.lighting_pdf or importance_sampling") &&
        !forbid(Effect::kLightingPdf, !plan_.on(Effect::kSpatialFilter),
                "rays are not moved without the spatial filter")) {
        decide(Effect::kLightingPdf, settings_.frames > 1, "the last frame's probes guide the rays",
               "a single frame has no last one", "4 probes read a probe");
    }
    if (!depends(Effect::kRoughSpecular, settings_.integrate.rough_specular, "integrate.rough_specular")) {
        decide(Effect::kRoughSpecular, facts_.smooth_parts > 0,
               fmt::format("{} may be smoother than {}", counted(facts_.smooth_parts, "part"),
                           settings_.integrate.rough_specular_max),
               facts_.specular_parts == 0
                   ? std::string("every material is purely diffuse")
                   : fmt::format("every material is rougher than {}", settings_.integrate.rough_specular_max),
               fmt::format("{} directions a pixel", settings_.integrate.specular_directions));
    }
    if (!depends(Effect::kReflections, settings_.integrate.reflections, "integrate.reflections")) {
        decide(Effect::kReflections, facts_.mirror_parts > 0,
               fmt::format("{} may be smoother than {}", counted(facts_.mirror_parts, "part"),
                           settings_.integrate.reflection_roughness_max),
               facts_.specular_parts == 0 ? std::string("every material is purely diffuse")
                                          : fmt::format("every material is rougher than {}",
                                                        settings_.integrate.reflection_roughness_max),
               fmt::format("{} of such a pixel, with its shadow rays",
                           counted(settings_.integrate.reflection_rays, "ray")));
    }
    if (!depends(Effect::kBentNormal, settings_.integrate.bent_normal, "integrate.bent_normal")) {
        decide(Effect::kBentNormal, true, "probes stand too far apart for contact shadows", "",
               fmt::format("{} short rays a pixel", settings_.integrate.bent_normal_rays));
    }
    if (!forbid(Effect::kTemporal, !settings_.temporal.accumulate, "temporal.accumulate is off")) {
        decide(Effect::kTemporal, settings_.frames > 1,
               fmt::format("up to {} frames make the picture", settings_.frames), "there is a single frame",
               "a sum a pixel");
    }
    return plan_;
}

}  // namespace

std::string_view name_of(Effect effect) {
    return kNames[static_cast<std::size_t>(effect)];
}

EffectRequest parse_effects(std::string_view text) {
    EffectRequest request;
    if (text == "auto") return request;
    if (text == "all") {
        request.kind = EffectRequest::Kind::kAll;
        return request;
    }
    request.kind = EffectRequest::Kind::kList;
    for (bool more = true; more;) {
        const std::size_t comma = text.find(',');
        const std::string_view name = text.substr(0, comma);
        more = comma != std::string_view::npos;
        text = more ? text.substr(comma + 1) : std::string_view();
        const auto found = std::find(kNames.begin(), kNames.end(), name);
        if (found == kNames.end()) {
            std::string names;
            for (const std::string_view known : kNames)
                names += fmt::format("{}{}", names.empty() ? "" : ", ", known);
            throw core::InputError(
                core::ErrorKind::kUsage,
                fmt::format("--effects: no effect is called '{}'; auto, all, or of: {}", name, names));
        }
        request.list.insert(static_cast<Effect>(found - kNames.begin()));
    }
    return request;
}

Plan make_plan(const core::Scene& scene, int width, int height, const Settings& settings,
               const EffectRequest& request, const std::set<std::string>& layers) {
    const SceneFacts facts = find_facts(scene, settings);
    return Planner(scene, facts, width, height, settings, request, layers).make();
}

LightingSettings planned_lighting(const Settings& settings, const Plan& plan) {
    LightingSettings result = settings.lighting;
    if (plan.on(Effect::kEmissiveSampling)) return result;
    // No emitter has this share. What is sampled of the sky is not this effect's: `all` of it stays all.
    result.sampled_power_share = std::numeric_limits<float>::infinity();
    if (result.sampled_emitters == SampledEmitters::kAll) {
        result.sampled_emitters = SampledEmitters::kAuto;
        result.sky_peak_ratio = 0.0f;
    }
    return result;
}

void apply_plan(const Plan& plan, core::Scene& scene) {
    std::erase_if(scene.lights, [&](const core::Light& light) {
        const bool is_sun = std::holds_alternative<core::DirectionalLight>(light);
        return core::estimated_power(light, 1.0f) > 0.0f &&
               !plan.on(is_sun ? Effect::kSun : Effect::kPunctualLights);
    });
    if (!plan.on(Effect::kSky) && !scene.sky.black()) scene.sky = core::Sky();
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        for (std::uint32_t part = 0; part < scene.instances[i].materials.size(); ++part) {
            if (!core::may_be_invisible(scene, i, part)) continue;
            core::Material& material = scene.materials[scene.instances[i].materials[part]];
            const bool masks = material.alpha_mode == core::AlphaMode::kMask;
            if (!plan.on(masks ? Effect::kAlphaMask : Effect::kAlphaBlend)) {
                material.alpha_mode = core::AlphaMode::kOpaque;
            }
        }
    }
}

}  // namespace gather
