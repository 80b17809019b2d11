// Effects in pictures: `auto` against `all` layer by layer, lists against settings, what each effect took.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "core/trace/triangle_tracer.h"
#include "gather/effect_costs.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/placement.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/gather_pictures.h"
#include "tests/support/render_scenes.h"

namespace {

using gather::Effect;

constexpr int kWidth = 64, kHeight = 48;

struct Picture : tests::GatherPicture {
    gather::EffectCost cost(Effect effect, const gather::Settings& settings) const {
        return gather::effect_costs(plan, frame.passes, kWidth, kHeight,
                                    settings)[static_cast<std::size_t>(effect)];
    }
};

Picture render(const core::Scene& scene, const gather::Settings& settings, const std::string& effects,
               const std::set<std::string>& layers = {}) {
    return {tests::gather_picture(scene, tests::camera_of(scene), settings, effects,
                                  {.width = kWidth, .height = kHeight, .seed = 5, .aovs = layers})};
}

core::Scene dark_room() {
    core::Scene scene = tests::area_lit_room();
    for (core::Material& material : scene.materials) material.emission = glm::vec3(0.0f);
    return scene;
}

TEST(Effects, AutoEqualsAllInEveryLayer) {
    const std::set<std::string> layers = {
        "Depth",       "Normal",     "Albedo", "Direct", "IndirectDiffuse", "IndirectSpecular",
        "HitDistance", "BentNormal", "Steps",  "Probes", "RaysPerTexel",    "ProbeHitDistance",
        "ProbeWeight"};
    core::Scene unlit = tests::area_lit_room();
    for (core::Material& material : unlit.materials) material.unlit = true;
    core::Scene lamp_alone = dark_room();
    lamp_alone.lights.emplace_back(core::PointLight{"lamp", {0, 0.5f, 0.3f}, glm::vec3(1.0f)});
    const std::pair<const char*, core::Scene> scenes[] = {{"dark", dark_room()},
                                                          {"unlit", unlit},
                                                          {"lamp", lamp_alone},
                                                          {"room", tests::area_lit_room()},
                                                          {"mixed", tests::mixed_room()},
                                                          {"glossy", tests::asset("glossy")},
                                                          {"walls", tests::asset("thin_walls")}};
    for (const auto& [name, scene] : scenes) {
        for (const int frames : {1, 3}) {
            for (const int bounces : {0, 1}) {
                for (const int spacing : {1, 16}) {
                    SCOPED_TRACE(testing::Message() << name << ", frames " << frames << ", bounces "
                                                    << bounces << ", spacing " << spacing);
                    gather::Settings settings;
                    settings.frames = frames;
                    settings.bounces = bounces;
                    settings.screen_probes.spacing = spacing;
                    settings.screen_probes.resolution = 4;
                    tests::expect_same_bits(render(scene, settings, "auto", layers).frame.image,
                                            render(scene, settings, "all", layers).frame.image);
                }
            }
        }
    }
}

TEST(Effects, AutoEqualsAllInTheDarkWithEachLayerAlone) {
    gather::Settings settings;
    settings.frames = 2;
    for (const char* layer : {"BentNormal", "Probes", "RaysPerTexel", "ProbeHitDistance", "ProbeWeight"}) {
        SCOPED_TRACE(layer);
        tests::expect_same_bits(render(dark_room(), settings, "auto", {layer}).frame.image,
                                render(dark_room(), settings, "all", {layer}).frame.image);
    }
}

/// Without emissive_sampling emitters are only found by being hit, whatever lighting.sampled_emitters is.
TEST(Effects, AListWithoutEmissiveSamplingHoldsUnderEverySetting) {
    const core::Scene scene = tests::area_lit_room();
    gather::Settings settings;
    settings.frames = 2;
    settings.lighting.sampled_emitters = gather::SampledEmitters::kNone;
    const Picture found = render(scene, settings, "auto");
    for (const auto emitters : {gather::SampledEmitters::kAuto, gather::SampledEmitters::kAll}) {
        settings.lighting.sampled_emitters = emitters;
        const Picture listed = render(scene, settings,
                                      "screen_probes,adaptive_probes,lighting_pdf,spatial_filter,bent_normal,"
                                      "temporal");
        tests::expect_same_bits(listed.frame.image, found.frame.image);
        for (const core::PassCost& pass : listed.frame.passes) EXPECT_NE(pass.name, "direct");
    }
}

/// The sky is another effect: that all of it is sampled stays so.
TEST(Effects, EmissiveSamplingLeavesTheSkyAlone) {
    core::Scene scene = dark_room();
    scene.sky = core::Sky::constant(glm::vec3(1.0f));
    gather::Settings settings;
    settings.frames = 2;
    settings.lighting.sampled_emitters = gather::SampledEmitters::kAll;
    tests::expect_same_bits(render(scene, settings, "sky,screen_probes,emissive_sampling").frame.image,
                            render(scene, settings, "sky,screen_probes").frame.image);
}

/// Those that nothing else would run.
std::vector<std::string> passes_of_its_own(Effect effect) {
    switch (effect) {
        case Effect::kScreenProbes:
            return {"place_probes", "trace_probes", "probe_shadows", "integrate", "probe_visibility"};
        case Effect::kSpatialFilter:
            return {"filter_probes"};
        case Effect::kReflections:
            return {"reflections", "reflection_shadows", "reflection_reuse"};
        case Effect::kBentNormal:
            return {"near_field", "bent_normal", "bent_normal_shadows"};
        case Effect::kTemporal:
            return {"outlines", "outline_shadows"};
        default:
            return {};
    }
}

TEST(Effects, WhatIsOffCostsNothingAndWhatIsOnSomething) {
    gather::Settings settings;
    settings.frames = 2;
    const core::Scene scene = tests::mixed_room();
    const Picture all = render(scene, settings, "all");
    std::uint64_t probe_bytes = 0;
    for (std::size_t i = 0; i < gather::kEffectCount; ++i) {
        const auto effect = static_cast<Effect>(i);
        SCOPED_TRACE(std::string(gather::name_of(effect)));
        const gather::EffectCost on = all.cost(effect, settings);
        EXPECT_FALSE(on.passes.empty());
        EXPECT_GT(on.seconds, 0.0);
        const bool keeps_pixels = effect == Effect::kBentNormal || effect == Effect::kReflections;
        if (!keeps_pixels) probe_bytes += on.bytes;

        std::string others;
        for (std::size_t j = 0; j < gather::kEffectCount; ++j) {
            if (j == i) continue;
            if (!others.empty()) others += ',';
            others += gather::name_of(static_cast<Effect>(j));
        }
        core::Scene without = scene;
        gather::apply_plan(gather::make_plan(scene, kWidth, kHeight, settings, gather::parse_effects(others)),
                           without);
        const Picture dropped = render(without, settings, others.c_str());
        for (const core::PassCost& pass : dropped.frame.passes) {
            EXPECT_EQ(std::ranges::count(passes_of_its_own(effect), pass.name), 0) << pass.name;
        }
        const gather::EffectCost off = dropped.cost(effect, settings);
        EXPECT_TRUE(off.passes.empty());
        EXPECT_EQ(off.seconds, 0.0);
        EXPECT_EQ(off.rays, 0u);
        EXPECT_EQ(off.bytes, 0u);
    }
    EXPECT_EQ(gather::probe_cache_bytes(all.plan, kWidth, kHeight, settings), probe_bytes);
    EXPECT_EQ(gather::probe_cache_bytes({}, kWidth, kHeight, settings), 0u);
    for (const Effect effect : {Effect::kSun, Effect::kScreenProbes, Effect::kBentNormal}) {
        EXPECT_GT(all.cost(effect, settings).rays, 0u) << gather::name_of(effect);
    }
    for (const Effect effect : {Effect::kScreenProbes, Effect::kAdaptiveProbes, Effect::kLightingPdf,
                                Effect::kSpatialFilter, Effect::kBentNormal}) {
        EXPECT_GT(all.cost(effect, settings).bytes, 0u) << gather::name_of(effect);
    }
}

/// What an atlas of a picture holds, against the formula that `--stats` states.
TEST(Effects, TheCacheTakesNoMoreThanItsFormulaSays) {
    const core::Scene scene = tests::mixed_room();
    const core::TriangleTracer tracer(scene);
    const core::Camera camera = tests::room_camera();
    core::RenderInputs inputs = tests::pass_inputs(scene, tracer, camera);
    inputs.width = kWidth;
    inputs.height = kHeight;
    const gather::SceneLighting lighting(scene, tracer, {});
    gather::VisibleSurfaces visible;
    gather::find_visible_surfaces(inputs, lighting, std::vector<std::uint32_t>(kWidth * kHeight, 0), visible);
    gather::Settings settings;
    settings.screen_probes.spacing = 8;
    for (const float budget : {0.0f, 0.1f, 4.0f}) {
        SCOPED_TRACE(budget);
        settings.screen_probes.adaptive_budget = budget;
        gather::Plan plan;
        plan.effects[static_cast<std::size_t>(Effect::kScreenProbes)].on = true;
        plan.effects[static_cast<std::size_t>(Effect::kAdaptiveProbes)].on = budget > 0.0f;
        gather::ProbeAtlas atlas;
        gather::place_probes(visible, settings.screen_probes, budget > 0.0f, 0, 1, atlas);
        atlas.allocate_texels();
        atlas.sh.resize(atlas.probes.size());
        const std::uint64_t bytes =
            atlas.probes.size() * sizeof(gather::Probe) + atlas.radiance.size() * sizeof(glm::vec3) +
            atlas.hit_distance.size() * sizeof(float) + atlas.ray_count.size() +
            atlas.sh.size() * sizeof(core::ShColor) + atlas.adaptive_begin.size() * sizeof(std::uint32_t);
        const std::uint64_t stated = gather::probe_cache_bytes(plan, kWidth, kHeight, settings);
        EXPECT_LE(bytes, stated);
        // A small budget is used up.
        if (budget < 1.0f) {
            EXPECT_EQ(bytes, stated);
        }
    }
}

}  // namespace
