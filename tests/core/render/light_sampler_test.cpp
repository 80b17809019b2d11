#include "core/render/light_sampler.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/analytic_scenes.h"
#include "tests/support/chi_square.h"
#include "tests/support/render_scenes.h"

namespace {

/// Two emissive rectangles of different brightness, a sky and a wide sun.
core::Scene many_lights() {
    core::Scene scene;
    core::Material bright = tests::lambert(glm::vec3(0.5f));
    bright.emission = glm::vec3(4.0f);
    core::Material dim = bright;
    dim.emission = glm::vec3(1.0f);
    const std::uint32_t mesh = tests::add_mesh(scene, tests::quad(1.0f, 0.6f, 3, 2));
    const std::uint32_t first = tests::add_material(scene, bright);
    const std::uint32_t second = tests::add_material(scene, dim);
    tests::add_instance(scene, mesh, tests::translation({0.2, 0.1, 2.0}), first);
    tests::add_instance(scene, mesh, tests::translation({-1.5, 0.3, 1.2}) * tests::rotation(1.0, {0, 1, 0}),
                        second);
    scene.sky = core::Sky::constant(glm::vec3(0.4f));
    scene.lights.emplace_back(core::make_sun(0.6f, 0.5f, 3.0f, 0.5f));
    return scene;
}

TEST(LightSampler, ChoosesDirectionsWithTheDensityItClaims) {
    const core::Scene scene = many_lights();
    const core::LightSampler sampler(scene);
    EXPECT_EQ(sampler.group_count(), 4u);
    const core::LightReceiver receiver{glm::vec3(0.1f, -0.2f, 0.0f),
                                       glm::normalize(glm::vec3(0.2f, 0.1f, 1.0f))};
    const core::LightSampler::Selection selection = sampler.selection(receiver);

    // The truth about which triangle a direction meets, in double, by Cramer's rule.
    struct Emitter {
        std::uint32_t instance, triangle;
        glm::dvec3 to_receiver, edge1, edge2;  ///< From the first corner.
    };
    std::vector<Emitter> emitters;
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        const core::Mesh& mesh = scene.meshes[scene.instances[i].mesh];
        for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
            glm::dvec3 p[3];
            for (int c = 0; c < 3; ++c) {
                p[c] = glm::dvec3(scene.instances[i].world_from_local *
                                  glm::dvec4(mesh.positions[mesh.triangles[t][c]], 1.0));
            }
            emitters.push_back({i, t, glm::dvec3(receiver.position) - p[0], p[1] - p[0], p[2] - p[0]});
        }
    }
    const auto density = [&](const glm::vec3& direction) {
        const glm::dvec3 back = -glm::dvec3(direction);
        double sum = 0.0;
        for (const Emitter& e : emitters) {
            const glm::dvec3 normal = glm::cross(e.edge1, e.edge2);
            const double determinant = glm::dot(normal, back);
            if (std::abs(determinant) < 1e-12) continue;
            const glm::dvec3 moment = glm::cross(e.to_receiver, back);
            const double u = -glm::dot(moment, e.edge2) / determinant;
            const double v = glm::dot(moment, e.edge1) / determinant;
            const double distance = glm::dot(normal, e.to_receiver) / determinant;
            if (u < 0 || v < 0 || u + v > 1 || distance <= 0) continue;
            sum += static_cast<double>(sampler.emitter_pdf(receiver, selection, e.instance, e.triangle,
                                                           direction, static_cast<float>(distance)));
        }
        return sum;
    };
    // Emitters alone are compared cell by cell; sky and sun fall into the cell of samples that return
    // nothing.
    tests::ChiSquareSettings settings;
    settings.polar_cells = 20;
    settings.azimuth_cells = 40;
    settings.integration_points = 64;  // The density jumps at the triangles' edges, which lie within cells.
    settings.sample_count = 200'000;
    const double p = tests::chi_square_p_value(
        [&](const glm::vec2& u, float) -> std::optional<glm::vec3> {
            const auto sample = sampler.sample(receiver, selection, u);
            if (!(sample.pdf > 0.0f) || sample.instance == core::kNoIndex) return std::nullopt;
            return sample.direction;
        },
        density, settings);
    EXPECT_GT(p, 0.01);
}

TEST(LightSampler, EstimatesWhatTheUnweightedSkySends) {
    // Irradiance from sky and sun by light sampling, against the closed form: sky pi L (the normal sees half
    // of it), sun E cos. 1 %: 2e5 samples of a bounded integrand.
    core::Scene scene;
    scene.sky = core::Sky::constant(glm::vec3(0.4f));
    scene.lights.emplace_back(core::make_sun(0.0f, core::kPi / 2.0f, 3.0f, 0.02f));
    const core::LightSampler sampler(scene);
    const core::LightReceiver receiver{glm::vec3(0.0f), {0, 1, 0}};
    const auto selection = sampler.selection(receiver);
    tests::TestRandom random(6);
    double sum = 0.0;
    constexpr int kCount = 200000;
    for (int i = 0; i < kCount; ++i) {
        const auto sample = sampler.sample(receiver, selection,
                                           {static_cast<float>(random.uniform() * 0.99999994),
                                            static_cast<float>(random.uniform() * 0.99999994)});
        if (sample.pdf > 0.0f && sample.direction.y > 0.0f) {
            sum += static_cast<double>(sample.radiance.x * sample.direction.y / sample.pdf);
        }
    }
    EXPECT_NEAR(sum / kCount, 0.4 * 3.14159265 + 3.0, 0.01 * (0.4 * 3.14159265 + 3.0));
}

TEST(LightSampler, GivesNoProbabilityToLightsBelowTheHorizonAndSomeToAllOthers) {
    const core::Scene scene = many_lights();
    const core::LightSampler sampler(scene);
    const core::LightReceiver away{glm::vec3(0.0f), {0, 0, -1}};
    const auto selection = sampler.selection(away);
    tests::TestRandom random(6);
    for (int i = 0; i < 10000; ++i) {
        const auto sample = sampler.sample(
            away, selection, {static_cast<float>(random.uniform()), static_cast<float>(random.uniform())});
        EXPECT_EQ(sample.instance, core::kNoIndex);
    }
}

TEST(LightSampler, WeighsEscapedLightBetweenZeroAndAllOfIt) {
    const core::Scene scene = many_lights();
    const core::LightSampler sampler(scene);
    const core::LightReceiver receiver{glm::vec3(0.0f), {0, 1, 0}};
    const auto selection = sampler.selection(receiver);
    tests::TestRandom random(3);
    for (int i = 0; i < 1000; ++i) {
        const glm::vec3 direction(random.direction());
        const float whole = sampler.escaped_radiance(direction).x;
        const float weighted = sampler.weighted_escaped_radiance(receiver, selection, direction, 0.3f).x;
        EXPECT_GT(weighted, 0.0f);
        EXPECT_LE(weighted, whole);
    }
}

TEST(LightSampler, SamplesASubsetOfEverythingLikeTheWhole) {
    const core::Scene scene = many_lights();
    const core::LightSampler whole(scene);
    const core::LightSampler subset(
        scene, {&scene.sky, std::vector<std::uint8_t>(scene.instances.size(), std::uint8_t{1})});
    ASSERT_EQ(subset.group_count(), whole.group_count());
    const core::LightReceiver receiver{glm::vec3(0.1f, -0.2f, 0.0f), {0, 0, 1}};
    const auto selection = whole.selection(receiver);
    EXPECT_EQ(subset.selection(receiver).scale, selection.scale);
    EXPECT_EQ(subset.selection(receiver).floor, selection.floor);
    tests::TestRandom random(9);
    for (int i = 0; i < 10000; ++i) {
        const glm::vec2 u(random.uniform() * 0.9999999, random.uniform() * 0.9999999);
        const auto a = whole.sample(receiver, selection, u);
        const auto b = subset.sample(receiver, selection, u);
        EXPECT_EQ(a.direction, b.direction);
        EXPECT_EQ(a.radiance, b.radiance);
        EXPECT_EQ(a.pdf, b.pdf);
        EXPECT_EQ(a.instance, b.instance);
    }
}

TEST(LightSampler, NeverSamplesWhatASubsetLeavesOut) {
    const core::Scene scene = many_lights();
    const core::Sky sky = core::Sky::constant(glm::vec3(0.1f));
    const core::LightSampler sampler(scene, {&sky, {0, 1}});
    EXPECT_EQ(sampler.group_count(), 3u);
    EXPECT_FALSE(sampler.samples_emitter(0));
    EXPECT_TRUE(sampler.samples_emitter(1));
    EXPECT_TRUE(sampler.emits(0, 0));
    EXPECT_TRUE(sampler.emits(1, 0));
    const core::LightReceiver receiver{glm::vec3(0.1f, -0.2f, 0.0f), {0, 0, 1}};
    const auto selection = sampler.selection(receiver);
    EXPECT_EQ(sampler.emitter_pdf(receiver, selection, 0, 0, {0, 0, 1}, 2.0f), 0.0f);
    tests::TestRandom random(9);
    bool met_the_other = false;
    for (int i = 0; i < 10000; ++i) {
        const auto sample = sampler.sample(
            receiver, selection, glm::vec2(random.uniform() * 0.9999999, random.uniform() * 0.9999999));
        EXPECT_NE(sample.instance, 0u);
        met_the_other = met_the_other || sample.instance == 1u;
    }
    EXPECT_TRUE(met_the_other);

    // The subset's sky takes the place of the scene's, or there is none. Straight down there is no sun.
    EXPECT_EQ(sampler.escaped_radiance({0, -1, 0}), glm::vec3(0.1f));
    const core::LightSampler skyless(scene, {nullptr, {0, 0}});
    EXPECT_EQ(skyless.group_count(), 1u);
    EXPECT_EQ(skyless.escaped_radiance({0, -1, 0}), glm::vec3(0.0f));
}

/// A rectangle whose emission texture is black but for `bright` texels of 64 x 64, between what is probed.
core::Scene lit_window(std::size_t bright) {
    core::Scene scene;
    core::TextureImage image;
    image.width = image.height = 64;
    image.rgba.assign(4 * 64 * 64, 0);
    for (std::size_t i = 0; i < bright; ++i) image.rgba[4 * (64 * 63 + i) + 1] = 255;
    scene.images.push_back(image);
    scene.textures.emplace_back();
    core::Material material = tests::lambert(glm::vec3(0.5f));
    material.emission = glm::vec3(3.0f);
    material.emission_texture.texture = 0;
    const std::uint32_t mesh = tests::add_mesh(scene, tests::quad(1.0f, 1.0f, 1, 1));
    tests::add_instance(scene, mesh, tests::translation({0, 0, 0}), tests::add_material(scene, material));
    return scene;
}

TEST(LightSampler, SamplesTexturesThatAreBrightBetweenTheProbes) {
    const core::Scene dark = lit_window(0);
    EXPECT_TRUE(core::LightSampler(dark).empty());
    const core::Scene lit = lit_window(1);
    const core::LightSampler sampler(lit);
    EXPECT_EQ(sampler.group_count(), 1u);
    for (std::uint32_t t = 0; t < 2; ++t) EXPECT_TRUE(sampler.emits(0, t)) << t;
}

TEST(LightSampler, IsEmptyInADarkScene) {
    const core::Scene scene = tests::scene_of(tests::box());
    EXPECT_TRUE(core::LightSampler(scene).empty());
}

}  // namespace
