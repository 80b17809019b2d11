// What a plan is asked for, what it decides by itself and why, and what it takes out of a scene.
#include "gather/plan.h"

#include <gtest/gtest.h>

#include <functional>
#include <ostream>
#include <string>
#include <variant>
#include <vector>

#include "core/support/error.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/render_scenes.h"

namespace {

using gather::Effect;

gather::Plan plan_of(const core::Scene& scene, const char* effects = "auto",
                     const gather::Settings& settings = {}, const std::set<std::string>& layers = {}) {
    return gather::make_plan(scene, 64, 48, settings, gather::parse_effects(effects), layers);
}

/// A box of one material under a point light.
core::Scene box_of(const core::Material& material) {
    core::Scene scene = tests::scene_of(tests::box(glm::vec3(0.5f)));
    scene.materials[0] = material;
    scene.lights.emplace_back(core::PointLight{"lamp", {0, 2, 2}, glm::vec3(10.0f)});
    return scene;
}

core::Scene with_light(const core::Light& light) {
    core::Scene scene = tests::area_lit_room();
    scene.lights.push_back(light);
    return scene;
}

core::Scene with_sky(const glm::vec3& radiance) {
    core::Scene scene = tests::area_lit_room();
    scene.sky = core::Sky::constant(radiance);
    return scene;
}

core::Scene dark_box() {
    core::Scene scene = box_of(tests::lambert(glm::vec3(0.5f)));
    scene.lights.clear();
    return scene;
}

core::Material with_alpha(core::AlphaMode mode, float alpha) {
    core::Material material = tests::lambert(glm::vec3(0.5f));
    material.alpha_mode = mode;
    material.base_color.a = alpha;
    return material;
}

core::Material glossy(float roughness) {
    core::Material material = tests::lambert(glm::vec3(0.5f));
    material.specular = 1.0f;
    material.roughness = roughness;
    return material;
}

core::Material unlit() {
    core::Material material = tests::lambert(glm::vec3(0.5f));
    material.unlit = true;
    return material;
}

gather::Settings single_frame() {
    gather::Settings settings;
    settings.frames = 1;
    return settings;
}

/// A scene with what `auto` makes of an effect in it.
struct Case {
    std::string name;
    Effect effect;
    bool on;
    std::function<core::Scene()> scene;
    std::string reason;  ///< Part of what a person is told.
    gather::Settings settings = {};
};

void PrintTo(const Case& row, std::ostream* stream) {
    *stream << row.name;
}

std::vector<Case> cases() {
    const core::Light point = core::PointLight{"p", {0, 1, 0}, glm::vec3(3.0f)};
    const core::Light black = core::PointLight{"p", {0, 1, 0}, glm::vec3(0.0f)};
    const core::Light sun = core::make_sun(0.3f, 0.5f, 1000.0f, 0.01f);
    const auto room = [] { return tests::area_lit_room(); };
    return {
        {"PunctualLights", Effect::kPunctualLights, true, [=] { return with_light(point); },
         "1 point or spot light"},
        {"NoPunctualLight", Effect::kPunctualLights, false, room, "no point or spot light shines"},
        {"BlackPunctualLight", Effect::kPunctualLights, false, [=] { return with_light(black); },
         "no point or spot light shines"},
        {"Sun", Effect::kSun, true, [=] { return with_light(sun); }, "1 directional light"},
        {"NoSun", Effect::kSun, false, [=] { return with_light(point); }, "no directional light shines"},
        {"Sky", Effect::kSky, true, [] { return with_sky(glm::vec3(1.0f)); }, "the sky is not black"},
        {"BlackSky", Effect::kSky, false, [] { return with_sky(glm::vec3(0.0f)); }, "the sky is black"},
        {"EmissiveSampling", Effect::kEmissiveSampling, true, room, "1 emissive object"},
        {"NothingEmits", Effect::kEmissiveSampling, false, [] { return box_of(glossy(0.3f)); },
         "nothing emits"},
        {"AlphaMask", Effect::kAlphaMask, true,
         [] { return box_of(with_alpha(core::AlphaMode::kMask, 0.2f)); }, "1 part with alpha MASK"},
        {"AlphaMaskThatCutsNothing", Effect::kAlphaMask, false,
         [] { return box_of(with_alpha(core::AlphaMode::kMask, 1.0f)); }, "no alpha MASK cuts anything out"},
        {"AlphaBlend", Effect::kAlphaBlend, true,
         [] { return box_of(with_alpha(core::AlphaMode::kBlend, 0.5f)); }, "1 part with alpha BLEND"},
        {"OpaqueBlend", Effect::kAlphaBlend, false,
         [] { return box_of(with_alpha(core::AlphaMode::kBlend, 1.0f)); },
         "no alpha BLEND lets light through"},
        {"ScreenProbes", Effect::kScreenProbes, true, room, "light that comes from other surfaces"},
        {"ScreenProbesInTheDark", Effect::kScreenProbes, false, dark_box, "nothing shines"},
        {"ScreenProbesOfUnlit", Effect::kScreenProbes, false, [] { return box_of(unlit()); },
         "every material is unlit"},
        {"AdaptiveProbes", Effect::kAdaptiveProbes, true, room, "edges may leave pixels without a probe"},
        {"AdaptiveProbesInTheDark", Effect::kAdaptiveProbes, false, dark_box, "screen_probes is off"},
        {"LightingPdf", Effect::kLightingPdf, true, room, "the last frame's probes"},
        {"LightingPdfOfOneFrame", Effect::kLightingPdf, false, room, "a single frame has no last one",
         single_frame()},
        {"LightingPdfInTheDark", Effect::kLightingPdf, false, dark_box, "screen_probes is off"},
        {"SpatialFilter", Effect::kSpatialFilter, true, room, "3 passes over 3 x 3 probes"},
        {"SpatialFilterInTheDark", Effect::kSpatialFilter, false, dark_box, "screen_probes is off"},
        {"RoughSpecular", Effect::kRoughSpecular, true, [] { return box_of(glossy(0.3f)); },
         "1 part may be smoother than 0.8"},
        {"RoughSpecularOfRough", Effect::kRoughSpecular, false, [] { return box_of(glossy(0.9f)); },
         "every material is rougher than 0.8"},
        {"RoughSpecularOfDiffuse", Effect::kRoughSpecular, false, room, "every material is purely diffuse"},
        {"Reflections", Effect::kReflections, true, [] { return box_of(glossy(0.3f)); },
         "1 part may be smoother than 0.5"},
        {"ReflectionsOfRough", Effect::kReflections, false, [] { return box_of(glossy(0.6f)); },
         "every material is rougher than 0.5"},
        {"ReflectionsOfDiffuse", Effect::kReflections, false, room, "every material is purely diffuse"},
        {"BentNormal", Effect::kBentNormal, true, room, "contact shadows"},
        {"BentNormalInTheDark", Effect::kBentNormal, false, dark_box, "screen_probes is off"},
        {"Temporal", Effect::kTemporal, true, room, "16 frames make the picture"},
        {"TemporalOfOneFrame", Effect::kTemporal, false, room, "there is a single frame", single_frame()},
    };
}

class PlannedByItself : public testing::TestWithParam<Case> {};

TEST_P(PlannedByItself, SaysWhy) {
    const Case& row = GetParam();
    const core::Scene scene = row.scene();
    const gather::PlannedEffect planned = plan_of(scene, "auto", row.settings)[row.effect];
    EXPECT_EQ(planned.on, row.on);
    EXPECT_NE(planned.reason.find(row.reason), std::string::npos) << planned.reason;
    EXPECT_EQ(planned.cost == "none", !row.on) << planned.cost;
    EXPECT_FALSE(planned.cost.empty());
}

INSTANTIATE_TEST_SUITE_P(GatherPlan, PlannedByItself, testing::ValuesIn(cases()),
                         [](const auto& row) { return row.param.name; });

TEST(GatherPlan, EveryEffectIsOnInOneOfTheseScenesAndOffInAnother) {
    for (std::size_t i = 0; i < gather::kEffectCount; ++i) {
        bool seen[2] = {false, false};
        for (const Case& row : cases()) {
            if (row.effect == static_cast<Effect>(i)) seen[row.on ? 1 : 0] = true;
        }
        EXPECT_TRUE(seen[0] && seen[1]) << gather::name_of(static_cast<Effect>(i));
    }
}

TEST(GatherPlan, AllRunsWhatTheSceneDoesNotCallForAndSaysSo) {
    const gather::Plan plan = plan_of(dark_box(), "all");
    for (std::size_t i = 0; i < gather::kEffectCount; ++i) {
        EXPECT_TRUE(plan.effects[i].on) << gather::name_of(static_cast<Effect>(i));
        EXPECT_FALSE(plan.effects[i].reason.empty()) << gather::name_of(static_cast<Effect>(i));
    }
    EXPECT_EQ(plan[Effect::kSky].reason, "asked for by --effects all, though the sky is black");
}

TEST(GatherPlan, AListRunsWhatItNamesAndNothingElse) {
    const gather::Plan plan = plan_of(tests::mixed_room(), "screen_probes,sun");
    for (std::size_t i = 0; i < gather::kEffectCount; ++i) {
        const auto effect = static_cast<Effect>(i);
        EXPECT_EQ(plan.on(effect), effect == Effect::kScreenProbes || effect == Effect::kSun)
            << gather::name_of(effect);
    }
    EXPECT_EQ(plan[Effect::kSun].reason, "named in --effects");
    EXPECT_EQ(plan[Effect::kSky].reason, "not named in --effects");
}

TEST(GatherPlan, EffectsTakeWholeNamesAlone) {
    EXPECT_EQ(gather::parse_effects("sky,sun").list.size(), 2u);
    for (const char* wrong : {"", "sky,", ",sky", "skies"}) {
        EXPECT_THROW(gather::parse_effects(wrong), core::InputError) << wrong;
    }
}

TEST(GatherPlan, ASingleTileIsNeverFilteredWhateverIsAskedFor) {
    const gather::Settings settings;
    const gather::Plan plan = gather::make_plan({}, 16, 16, settings, gather::parse_effects("all"));
    EXPECT_FALSE(plan.on(Effect::kSpatialFilter));
    EXPECT_TRUE(plan.on(Effect::kScreenProbes));
}

TEST(GatherPlan, ASettingThatIsOffKeepsItsEffectOffWhateverIsAskedFor) {
    gather::Settings settings;
    settings.screen_probes.adaptive = false;
    settings.screen_probes.spatial_filter = false;
    settings.integrate.rough_specular = false;
    settings.integrate.bent_normal = false;
    settings.temporal.accumulate = false;
    settings.lighting.sampled_emitters = gather::SampledEmitters::kNone;
    const gather::Plan plan = plan_of(tests::mixed_room(), "all", settings);
    for (const Effect effect :
         {Effect::kAdaptiveProbes, Effect::kSpatialFilter, Effect::kLightingPdf, Effect::kRoughSpecular,
          Effect::kBentNormal, Effect::kTemporal, Effect::kEmissiveSampling}) {
        EXPECT_FALSE(plan.on(effect)) << gather::name_of(effect);
        EXPECT_FALSE(plan[effect].reason.empty());
    }
}

TEST(GatherPlan, ALayerThatShowsProbesCallsForThem) {
    for (const char* layer : {"Probes", "RaysPerTexel", "ProbeHitDistance", "ProbeWeight", "BentNormal"}) {
        const gather::Plan plan = plan_of(dark_box(), "auto", {}, {"Depth", layer});
        EXPECT_TRUE(plan.on(Effect::kScreenProbes)) << layer;
        EXPECT_NE(plan[Effect::kScreenProbes].reason.find(layer), std::string::npos);
    }
    EXPECT_FALSE(plan_of(dark_box(), "auto", {}, {"Depth", "Normal"}).on(Effect::kScreenProbes));
    gather::Settings settings;
    settings.integrate.bent_normal = false;
    EXPECT_FALSE(plan_of(dark_box(), "auto", settings, {"BentNormal"}).on(Effect::kScreenProbes));
}

/// KHR_materials_ior says that 1 takes the reflection at normal incidence away; the one at grazing incidence
/// stays, and so does the specular lobe.
TEST(GatherPlan, AnIndexOfRefractionOfOneIsSpecular) {
    core::Material material = glossy(0.3f);
    material.ior = 1.0f;
    EXPECT_TRUE(plan_of(box_of(material)).on(Effect::kRoughSpecular));
    material.specular = 0.0f;
    EXPECT_FALSE(plan_of(box_of(material)).on(Effect::kRoughSpecular));
}

/// Everything that a plan can take out of a scene.
core::Scene scene_of_everything() {
    core::Scene scene = tests::mixed_room();
    scene.lights.emplace_back(
        core::SpotLight{.name = "spot", .position = {0, 0.5f, 0}, .intensity = glm::vec3(1.0f)});
    const std::uint32_t box = tests::add_mesh(scene, tests::box(glm::vec3(0.1f)));
    for (const auto& [mode, alpha] : {std::pair{core::AlphaMode::kMask, 0.2f},
                                      {core::AlphaMode::kBlend, 0.5f},
                                      {core::AlphaMode::kMask, 1.0f},
                                      {core::AlphaMode::kBlend, 1.0f}}) {
        tests::add_instance(scene, box, glm::dmat4(1.0), tests::add_material(scene, with_alpha(mode, alpha)));
    }
    return scene;
}

struct Contents {
    std::size_t punctual_lights = 0, suns = 0, masks = 0, blends = 0;
    bool sky = false;
    bool operator==(const Contents&) const = default;
};

Contents contents_of(const core::Scene& scene) {
    Contents contents;
    for (const core::Light& light : scene.lights) {
        ++(std::holds_alternative<core::DirectionalLight>(light) ? contents.suns : contents.punctual_lights);
    }
    for (const core::Material& material : scene.materials) {
        contents.masks += material.alpha_mode == core::AlphaMode::kMask ? 1 : 0;
        contents.blends += material.alpha_mode == core::AlphaMode::kBlend ? 1 : 0;
    }
    contents.sky = !scene.sky.black();
    return contents;
}

TEST(ApplyPlan, ChangesNothingUnderAutoAndAll) {
    for (const core::Scene& before : {scene_of_everything(), tests::area_lit_room(), dark_box()}) {
        for (const char* effects : {"auto", "all"}) {
            core::Scene scene = before;
            gather::apply_plan(plan_of(scene, effects), scene);
            EXPECT_EQ(core::scene_hash(scene), core::scene_hash(before)) << effects;
        }
    }
}

TEST(ApplyPlan, TakesOutWhatAListDoesNotName) {
    const Contents all = contents_of(scene_of_everything());
    EXPECT_EQ(all, (Contents{2, 1, 2, 2, true}));
    const auto without = [](Effect left_out) {
        std::string list;
        for (std::size_t i = 0; i < gather::kEffectCount; ++i) {
            if (static_cast<Effect>(i) == left_out) continue;
            if (!list.empty()) list += ',';
            list += gather::name_of(static_cast<Effect>(i));
        }
        core::Scene scene = scene_of_everything();
        gather::apply_plan(plan_of(scene, list.c_str()), scene);
        return contents_of(scene);
    };
    // Alpha that makes nothing invisible is not the effect's: one of each stays.
    EXPECT_EQ(without(Effect::kPunctualLights), (Contents{0, 1, 2, 2, true}));
    EXPECT_EQ(without(Effect::kSun), (Contents{2, 0, 2, 2, true}));
    EXPECT_EQ(without(Effect::kSky), (Contents{2, 1, 2, 2, false}));
    EXPECT_EQ(without(Effect::kAlphaMask), (Contents{2, 1, 1, 2, true}));
    EXPECT_EQ(without(Effect::kAlphaBlend), (Contents{2, 1, 2, 1, true}));
    EXPECT_EQ(without(Effect::kBentNormal), all) << "a pass is nothing in the scene";
}

}  // namespace
