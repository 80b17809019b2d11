// Effects in pictures: `auto` against `all` layer by layer, lists against settings, what each effect took.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "core/scene/scene_loader.h"
#include "core/trace/triangle_tracer.h"
#include "gather/effect_costs.h"
#include "gather/final_gather.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/render_scenes.h"

namespace {

using gather::Effect;

constexpr int kWidth = 64, kHeight = 48;

struct Picture {
    gather::Plan plan;
    core::Frame frame;

    gather::EffectCost cost(Effect effect, const gather::Settings& settings) const {
        return gather::effect_costs(plan, frame.passes, kWidth, kHeight,
                                    settings)[static_cast<std::size_t>(effect)];
    }
};

Picture render(const core::Scene& scene, const gather::Settings& settings, const char* effects,
               const std::set<std::string>& layers = {}) {
    const core::TriangleTracer tracer(scene);
    const core::Camera camera =
        scene.cameras.empty() ? core::framing(core::world_bounds(scene), 4.0 / 3.0) : scene.cameras.front();
    Picture picture;
    picture.plan =
        gather::make_plan(scene, kWidth, kHeight, settings, gather::parse_effects(effects), layers);
    picture.frame = gather::FinalGather(settings, picture.plan)
                        .render({.scene = scene,
                                 .camera = camera,
                                 .tracer = tracer,
                                 .primary = tracer,
                                 .width = kWidth,
                                 .height = kHeight,
                                 .crop = {},
                                 .seed = 5,
                                 .aovs = layers,
                                 .progress = {},
                                 .stop_requested = {}});
    return picture;
}

void expect_same(const core::Image& a, const core::Image& b) {
    ASSERT_EQ(a.channels().size(), b.channels().size());
    for (std::size_t i = 0; i < a.channels().size(); ++i) {
        EXPECT_EQ(a.channels()[i].name, b.channels()[i].name);
        EXPECT_EQ(a.channels()[i].values, b.channels()[i].values) << a.channels()[i].name;
    }
}

core::Scene asset(const std::string& name) {
    return core::load_scene_file(std::string(FIELDLIGHT_SOURCE_DIR) + "/assets/" + name, {});
}

core::Scene dark_room() {
    core::Scene scene = tests::area_lit_room();
    for (core::Material& material : scene.materials) material.emission = glm::vec3(0.0f);
    return scene;
}

TEST(Effects, AutoEqualsAllInEveryLayer) {
    const std::set<std::string> layers = {
        "Depth",       "Normal",     "Albedo", "Direct", "IndirectDiffuse", "IndirectSpecular",
        "HitDistance", "BentNormal", "Steps",  "Probes", "RaysPerTexel",    "ProbeWeight"};
    core::Scene unlit = tests::area_lit_room();
    for (core::Material& material : unlit.materials) material.unlit = true;
    core::Scene lamp_alone = dark_room();
    lamp_alone.lights.emplace_back(core::PointLight{"lamp", {0, 0.5f, 0.3f}, glm::vec3(1.0f)});
    const std::pair<const char*, core::Scene> scenes[] = {{"dark", dark_room()},
                                                          {"unlit", unlit},
                                                          {"lamp", lamp_alone},
                                                          {"room", tests::area_lit_room()},
                                                          {"mixed", tests::mixed_room()},
                                                          {"glossy", asset("glossy.glb")},
                                                          {"walls", asset("thin_walls.glb")}};
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
                    expect_same(render(scene, settings, "auto", layers).frame.image,
                                render(scene, settings, "all", layers).frame.image);
                }
            }
        }
    }
}

TEST(Effects, AutoEqualsAllInTheDarkWithEachLayerAlone) {
    gather::Settings settings;
    settings.frames = 2;
    for (const char* layer : {"BentNormal", "Probes", "RaysPerTexel", "ProbeWeight"}) {
        SCOPED_TRACE(layer);
        expect_same(render(dark_room(), settings, "auto", {layer}).frame.image,
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
        expect_same(listed.frame.image, found.frame.image);
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
    expect_same(render(scene, settings, "sky,screen_probes,emissive_sampling").frame.image,
                render(scene, settings, "sky,screen_probes").frame.image);
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
        if (effect != Effect::kBentNormal) probe_bytes += on.bytes;

        std::string others;
        for (std::size_t j = 0; j < gather::kEffectCount; ++j) {
            if (j == i) continue;
            if (!others.empty()) others += ',';
            others += gather::name_of(static_cast<Effect>(j));
        }
        core::Scene without = scene;
        gather::apply_plan(gather::make_plan(scene, kWidth, kHeight, settings, gather::parse_effects(others)),
                           without);
        const gather::EffectCost off = render(without, settings, others.c_str()).cost(effect, settings);
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

}  // namespace
