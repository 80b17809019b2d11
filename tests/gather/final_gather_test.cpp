// The whole frame against what is known: the furnace, other thread counts, `all` against `auto`.
#include "gather/final_gather.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "core/trace/triangle_tracer.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/gather_pictures.h"
#include "tests/support/render_scenes.h"

namespace {

core::Frame render(const core::Scene& scene, const gather::Settings& settings, const char* effects,
                   int width = 64, int height = 48) {
    return tests::gather_picture(scene, tests::camera_of(scene), settings, effects,
                                 {.width = width, .height = height, .aovs = {"IndirectDiffuse", "Depth"}})
        .frame;
}

const char* const kAssets[] = {"cornell_box", "two_rooms", "thin_walls", "glossy", "instances"};

TEST(FinalGather, PixelsAreTheSameAtAnyThreadCount) {
    const core::Scene indoors = tests::asset("glossy");
    core::Scene outdoors = indoors;
    outdoors.lights.emplace_back(core::make_sun(0.5f, 0.7f, 20.0f, 0.01f));
    outdoors.sky = tests::peaked_sky();
    gather::Settings settings;
    settings.frames = 3;
    for (const core::Scene* scene : {&indoors, static_cast<const core::Scene*>(&outdoors)}) {
        std::optional<core::Frame> first;
        for (const int threads : {1, 2, 3, 8}) {
            core::with_thread_limit(threads, [&] {
                const core::Frame frame = render(*scene, settings, "auto");
                if (first) tests::expect_same_bits(frame.image, first->image);
                first = frame;
            });
        }
    }
}

TEST(FinalGather, AutoEqualsAllAndNothingIsNotFinite) {
    for (const char* name : kAssets) {
        SCOPED_TRACE(name);
        const core::Scene scene = tests::asset(name);
        for (const int frames : {1, 3}) {
            gather::Settings settings;
            settings.frames = frames;
            const core::Frame automatic = render(scene, settings, "auto");
            EXPECT_EQ(core::count_nonfinite(automatic.image), 0u);
            tests::expect_same_bits(automatic.image, render(scene, settings, "all").image);
        }
    }
}

TEST(FinalGather, PassesThatAreOffTakeNoTimeAndNoRays) {
    const core::Scene scene = tests::asset("cornell_box");
    gather::Settings settings;
    settings.frames = 1;
    const core::Frame frame = render(scene, settings, "emissive_sampling");
    for (const core::PassCost& pass : frame.passes) {
        EXPECT_TRUE(pass.name == "primary" || pass.name == "direct" || pass.name == "accumulate")
            << pass.name;
    }
}

/// A constant sky about a convex Lambert body: every point sends back rho E / pi = rho, and no light comes
/// from elsewhere.
TEST(FinalGather, ConvexBodyInAConstantSkyIsAFurnace) {
    core::Scene scene = tests::asset("instances");
    scene.lights.clear();
    scene.sky = core::Sky::constant(glm::vec3(1.0f));
    // A single body: its own hits return nothing but what a convex body cannot meet.
    scene.instances.resize(1);
    for (core::Material& material : scene.materials) {
        material = core::Material{};
        material.base_color = glm::vec4(0.5f, 0.5f, 0.5f, 1.0f);
        material.metallic = 0.0f;
        material.specular = 0.0f;
    }
    scene.cameras.clear();
    gather::Settings settings;
    settings.frames = 8;
    settings.bounces = 0;
    settings.lighting.sampled_emitters = gather::SampledEmitters::kNone;
    const core::Frame frame = render(scene, settings, "auto");
    const std::vector<float>& light = *frame.image.find("IndirectDiffuse.R");
    const std::vector<float>& alpha = *frame.image.find("A");
    double sum = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < light.size(); ++i) {
        if (alpha[i] < 1.0f) continue;
        sum += static_cast<double>(light[i]);
        ++count;
        EXPECT_LE(light[i], 0.5f * 1.05f);
    }
    ASSERT_GT(count, 50);
    // The whole, converged, within 5 % and never above 1 % (reliability.md).
    EXPECT_NEAR(sum / count / 0.5, 1.0, 0.05);
    EXPECT_LE(sum / count / 0.5, 1.01);
}

/// The front rim of the Cornell box faces the dark: nothing lights it. Without adaptive probes hardly any
/// stands on it, and those of the lit walls within, which do, must not stand in.
TEST(FinalGather, SurfacesWithoutAProbeTraceTheirOwnRays) {
    const core::Scene scene = tests::asset("cornell_box");
    gather::Settings settings;
    settings.frames = 4;
    settings.screen_probes.adaptive = false;
    const auto rim_light = [&] {
        const core::Frame frame = render(scene, settings, "auto", 160, 120);
        const std::vector<float>& light = *frame.image.find("IndirectDiffuse.G");
        const std::vector<float>& depth = *frame.image.find("Depth.Z");
        const std::vector<float>& alpha = *frame.image.find("A");
        float least = std::numeric_limits<float>::infinity();
        for (std::size_t i = 0; i < depth.size(); ++i) {
            if (alpha[i] == 1.0f) least = std::min(least, depth[i]);
        }
        double sum = 0.0;
        int count = 0;
        for (std::size_t i = 0; i < depth.size(); ++i) {
            if (alpha[i] < 1.0f || depth[i] > 1.001f * least) continue;
            sum += static_cast<double>(light[i]);
            ++count;
        }
        EXPECT_GT(count, 100);
        return sum / count;
    };
    // Not 0: the same depth takes in the first pixels of the lit walls.
    const double traced = rim_light();
    settings.integrate.near_field = gather::NearField::kMultiBounce;
    EXPECT_LT(traced, 0.1 * rim_light());  // There the nearest probe does stand in.
}

/// A sunlit floor whose shading leans away from a lit curb: the curb is under the shading's horizon, and what
/// is over it but under the floor is the floor. As to the path tracer, neither brings light.
TEST(FinalGather, WhatLiesUnderEitherHorizonBringsNoLight) {
    core::Mesh floor = tests::quad(4.0f, 4.0f);
    std::fill(floor.normals.begin(), floor.normals.end(), glm::normalize(glm::vec3(1.0f, 0.0f, 1.0f)));
    core::Scene scene = tests::scene_of(floor);
    tests::add_instance(scene, tests::add_mesh(scene, tests::box(glm::vec3(0.1f, 2.0f, 0.5f))),
                        tests::translation({-2.1, 0.0, 0.0}));
    core::DirectionalLight sun;
    sun.direction = glm::normalize(glm::vec3(-1.0f, 0.0f, -1.0f));
    sun.illuminance = glm::vec3(10.0f);
    scene.lights = {sun};
    scene.cameras = {core::look_at({0.5, 0.0, 3.0}, {0.5, 0.0, 0.0}, {0.0, 1.0, 0.0}, 0.6)};
    gather::Settings settings;
    settings.frames = 4;
    settings.screen_probes.spacing = 1;
    settings.screen_probes.importance_sampling = false;
    settings.screen_probes.spatial_filter = false;
    settings.integrate.bent_normal = false;
    settings.integrate.diffuse = gather::DiffuseIntegral::kSum;
    const core::Frame frame = render(scene, settings, "all", 24, 18);
    double indirect = 0.0;
    double all = 0.0;
    for (std::size_t i = 0; i < frame.image.pixel_count(); ++i) {
        indirect += static_cast<double>((*frame.image.find("IndirectDiffuse.G"))[i]);
        all += static_cast<double>((*frame.image.find("G"))[i]);
    }
    EXPECT_GT(all, 1.0);
    EXPECT_LE(indirect, 1e-5 * all);
}

TEST(FinalGather, RefusesLayersItDoesNotKnow) {
    const core::Scene scene = tests::asset("cornell_box");
    const core::TriangleTracer tracer(scene);
    gather::FinalGather renderer({}, {});
    EXPECT_THROW(renderer.render({.scene = scene,
                                  .camera = scene.cameras.front(),
                                  .tracer = tracer,
                                  .primary = tracer,
                                  .width = 8,
                                  .height = 8,
                                  .crop = {},
                                  .seed = 0,
                                  .aovs = {"Variance"},
                                  .progress = {},
                                  .stop_requested = {}}),
                 core::InputError);
}

}  // namespace
