// Light at full resolution: probes behind things, rough lobes as harmonics, mirrors, outlines.
#include "gather/integrate/integrate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/math/sampling.h"
#include "core/trace/triangle_tracer.h"
#include "gather/integrate/rough_lobe.h"
#include "gather/screen_probes/probe_visibility.h"
#include "tests/gather/constant_atlas.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/gather_pictures.h"
#include "tests/support/render_scenes.h"

namespace {

constexpr glm::vec3 kUp(0.0f, 1.0f, 0.0f);

/// A pixel on the floor between probes 0.1 apart, and a wall beside it.
class ProbeVisibility : public testing::Test {
protected:
    ProbeVisibility()
        : scene_(tests::scene_of(tests::box({0.01f, 0.2f, 1.0f}), tests::translation({0.15, 0, 0}))),
          tracer_(scene_),
          atlas_(tests::constant_atlas(4, {0.1f, 0, 0}, {0, 0, 0.1f}, kUp)) {
        visible_.resize(48, 48);
        visible_.depth[0] = 2.0f;
        core::SurfacePoint& point = visible_.points[0];
        point.position = visible_.origins[0] = {
            0.1f, 0, 0.1f};  // As the probe in the middle; the wall stands before column 2.
        point.geometric_normal = kUp;
        weights_.resize(1);
        weights_[0].count = 3;
        weights_[0].probe = {3, 4, 5};
        weights_[0].weight = {0.2f, 0.4f, 0.4f};
    }

    std::uint64_t hide(std::span<const float> openness) {
        const core::Camera camera;
        return gather::hide_probes(tests::pass_inputs(scene_, tracer_, camera), visible_, atlas_, openness, 0,
                                   weights_)
            .rays;
    }

    core::Scene scene_;
    core::TriangleTracer tracer_;
    gather::ProbeAtlas atlas_;
    gather::VisibleSurfaces visible_;
    std::vector<gather::ProbeWeights> weights_;
};

TEST_F(ProbeVisibility, AProbeBehindAWallIsNotRead) {
    EXPECT_GT(hide({}), 0u);
    EXPECT_FLOAT_EQ(weights_[0].weight[0], 1.0f / 3.0f);
    EXPECT_FLOAT_EQ(weights_[0].weight[1], 2.0f / 3.0f);
    EXPECT_EQ(weights_[0].weight[2], 0.0f);
    EXPECT_TRUE(weights_[0].confident);
}

TEST_F(ProbeVisibility, WhereAllAreHiddenTheyStayAndThePixelIsNotConfident) {
    weights_[0].count = 1;
    weights_[0].probe = {5};
    weights_[0].weight = {1.0f};
    hide({});
    EXPECT_EQ(weights_[0].weight[0], 1.0f);
    EXPECT_FALSE(weights_[0].confident);
}

/// What weighs too little to be asked does not stand in for what is hidden.
TEST_F(ProbeVisibility, ACrumbThatIsNotAskedIsNotSeen) {
    weights_[0].count = 2;
    weights_[0].probe = {5, 3};
    weights_[0].weight = {0.99f, 0.01f};
    EXPECT_EQ(hide({}), 1u);
    EXPECT_EQ(weights_[0].weight[0], 0.99f);
    EXPECT_EQ(weights_[0].weight[1], 0.01f);
    EXPECT_FALSE(weights_[0].confident);
}

TEST_F(ProbeVisibility, InTheOpenNoRayIsTraced) {
    const float open = 1.0f;
    EXPECT_EQ(hide({&open, 1}), 0u);
    EXPECT_EQ(weights_[0].weight[2], 0.4f);
}

/// A metal seen at some angle, in a frame that no axis of the world helps.
core::SurfacePoint rough_metal(float roughness) {
    core::SurfacePoint point;
    point.geometric_normal = glm::normalize(glm::vec3(0.3f, 0.8f, -0.5f));
    point.frame = core::ShadingFrame::from_normal(point.geometric_normal);
    point.roughness = roughness;
    point.brdf = core::Brdf{};
    point.brdf.diffuse = glm::vec3(0.0f);
    point.brdf.f0 = {0.9f, 0.5f, 0.04f};
    point.brdf.alpha = roughness * roughness;
    return point;
}

/// Radiance of third order comes back through the lobe as brute force says.
TEST(RoughLobe, ReflectsHarmonicsAsTheBrdfDoes) {
    core::ShColor light{};
    for (std::size_t k = 0; k < core::kShCount; ++k) {
        light[k] = glm::vec3(k == 0 ? 4.0f : 0.7f - 0.15f * static_cast<float>(k));
    }
    for (const float roughness : {0.5f, 0.8f, 0.97f}) {
        for (const float cosine : {0.15f, 0.55f, 0.99f}) {
            SCOPED_TRACE(testing::Message() << roughness << " at " << cosine);
            const core::SurfacePoint point = rough_metal(roughness);
            const float sine = std::sqrt(1.0f - cosine * cosine);
            const glm::vec3 local(0.6f * sine, 0.8f * sine, cosine);
            const glm::vec3 outgoing = point.frame.to_world(local);
            const core::ShColor lobe = gather::rough_lobe(point, outgoing);
            glm::vec3 reflected(0.0f);
            for (std::size_t k = 0; k < core::kShCount; ++k) reflected += lobe[k] * light[k];
            glm::vec3 truth(0.0f);
            constexpr std::uint32_t kCount = 1u << 15;
            for (std::uint32_t i = 0; i < kCount; ++i) {
                const glm::vec3 incoming =
                    core::sample_cosine_hemisphere(core::SampleSequence(5, i).point(0));
                const glm::vec3 radiance =
                    core::sh_dot(light, core::sh_basis(point.frame.to_world(incoming)));
                truth += core::evaluate(point.brdf, local, incoming).value.specular * radiance *
                         (core::kPi / static_cast<float>(kCount));
            }
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(reflected[c] / truth[c], 1.0f, 0.03f) << c;
        }
    }
}

gather::Settings few_frames() {
    gather::Settings settings;
    settings.frames = 16;
    return settings;
}

/// A room with a point light, whose green wall is metal.
core::Scene metal_walled_room(float roughness) {
    core::Scene scene = tests::area_lit_room();
    scene.instances.pop_back();  // The lamp, whose spot on the ceiling is all noise.
    scene.lights.emplace_back(core::PointLight{"lamp", {0.0f, 0.3f, 0.7f}, glm::vec3(1.0f)});
    for (core::Material& material : scene.materials) {
        if (material.base_color.g < 2.0f * material.base_color.r) continue;
        material.metallic = 1.0f;
        material.roughness = roughness;
    }
    return scene;
}

/// What the metal wall reflects, against the path tracer.
struct ReflectionError {
    double squares = 0.0;  ///< Sum over pixels.
    double energy = 0.0;   ///< Of the truth's.
};

class MetalWall {
public:
    explicit MetalWall(float roughness)
        : scene_(metal_walled_room(roughness)),
          truth_(tests::render(scene_, tests::room_camera(),
                               {.width = 160,
                                .height = 120,
                                .samples_per_pixel = 256,
                                .bounces = 1,
                                .aovs = {"IndirectSpecular"}})) {}

    ReflectionError error(const gather::Settings& settings) const {
        const core::Frame frame =
            tests::gather_picture(scene_, tests::room_camera(), settings, "auto",
                                  {.width = 160, .height = 120, .aovs = {"IndirectSpecular"}})
                .frame;
        const std::vector<float>& mine = *frame.image.find("IndirectSpecular.G");
        const std::vector<float>& truth = *truth_.image.find("IndirectSpecular.G");
        ReflectionError result;
        double sum = 0.0;
        for (std::size_t i = 0; i < mine.size(); ++i) {
            const auto a = static_cast<double>(mine[i]);
            const auto b = static_cast<double>(truth[i]);
            result.energy += a;
            sum += b;
            result.squares += (a - b) * (a - b);
        }
        result.energy /= sum;
        return result;
    }

private:
    core::Scene scene_;
    core::Frame truth_;
};

/// The path tracer's picture, which blurred probes do not give.
TEST(Reflections, MirrorsShowWhatThePathTracerSees) {
    const MetalWall wall(0.15f);
    gather::Settings settings = few_frames();
    const ReflectionError traced = wall.error(settings);
    EXPECT_NEAR(traced.energy, 1.0, 0.01);
    settings.integrate.reflections = false;
    EXPECT_LT(traced.squares, 0.2 * wall.error(settings).squares);
}

/// Neighbours' rays take noise away, and neither bring light nor take it.
TEST(Reflections, RaysAreSharedAmongNeighbors) {
    const MetalWall wall(0.4f);
    gather::Settings settings;
    settings.frames = 2;
    settings.integrate.reflection_neighbors = 0;
    const ReflectionError alone = wall.error(settings);
    settings.integrate.reflection_neighbors = 8;
    const ReflectionError shared = wall.error(settings);
    EXPECT_LT(shared.squares, 0.5 * alone.squares);
    EXPECT_NEAR(shared.energy / alone.energy, 1.0, 0.01);
}

/// Coverage of a bright ball in the dark, against many samples of the film.
TEST(Outlines, FurtherSamplesOfTheFilmSmoothThemAndMoveNothing) {
    const core::Scene ball = tests::furnace(0.0f);
    const core::Camera camera = tests::camera_of(ball);
    const core::Frame truth =
        tests::render(ball, camera, {.width = 64, .height = 48, .samples_per_pixel = 4096, .bounces = 0});
    const auto errors = [&](int samples) {
        gather::Settings settings = few_frames();
        settings.bounces = 0;
        settings.film.outline_samples = samples;
        double squares = 0.0;
        double mean = 0.0;
        for (std::uint64_t seed = 1; seed <= 4; ++seed) {
            const core::Frame frame =
                tests::gather_picture(ball, camera, settings, "auto", {.seed = seed}).frame;
            squares += tests::mean_squared_error(frame.image, truth.image);
            mean += 0.25 * tests::mean_radiance(frame.image);
        }
        EXPECT_NEAR(mean / tests::mean_radiance(truth.image), 1.0, 0.002) << samples;
        return squares;
    };
    const double one = errors(1);
    EXPECT_GT(one, 0.0);
    EXPECT_LT(errors(4), 0.3 * one);
}

/// A bar a quarter of a pixel wide, of its own instance: most samples that meet it have none beside them on
/// it.
TEST(Outlines, WhatIsThinnerThanAPixelKeepsItsLight) {
    const core::Camera camera = tests::camera_of(tests::furnace(0.0f));
    core::Scene scene;
    core::Material material = tests::lambert(glm::vec3(0.5f));
    material.emission = glm::vec3(1.0f);
    const std::uint32_t emissive = tests::add_material(scene, material);
    tests::add_instance(scene, tests::add_mesh(scene, tests::box({0.006f, 0.6f, 0.006f})),
                        tests::translation({0.013, 0, 0}), emissive);
    const core::Frame truth =
        tests::render(scene, camera, {.width = 64, .height = 48, .samples_per_pixel = 4096, .bounces = 0});
    gather::Settings settings = few_frames();
    settings.bounces = 0;
    settings.film.outline_samples = 4;
    double mean = 0.0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        mean += tests::mean_radiance(
                    tests::gather_picture(scene, camera, settings, "auto", {.seed = seed}).frame.image) /
                8.0;
    }
    EXPECT_NEAR(mean / tests::mean_radiance(truth.image), 1.0, 0.03);
}

/// Pixels that no outline crosses take the same samples whether others take more or not.
TEST(Outlines, PixelsElsewhereStayAsTheyAre) {
    const core::Scene scene = tests::area_lit_room();
    gather::Settings settings = few_frames();
    settings.bounces = 0;
    const core::Frame with = tests::gather_picture(scene, tests::room_camera(), settings, "auto").frame;
    settings.film.outline_samples = 1;
    const core::Frame without = tests::gather_picture(scene, tests::room_camera(), settings, "auto").frame;
    const std::vector<float>& a = *with.image.find("G");
    const std::vector<float>& b = *without.image.find("G");
    std::size_t same = 0;
    for (std::size_t i = 0; i < a.size(); ++i) same += a[i] == b[i] ? 1 : 0;
    EXPECT_GT(same, a.size() / 2);
    EXPECT_LT(same, a.size());
}

}  // namespace
