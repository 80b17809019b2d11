// Near light as a control variate: what short rays find beside what the probes hold.
#include <gtest/gtest.h>

#include <vector>

#include "core/math/octahedral.h"
#include "core/trace/triangle_tracer.h"
#include "gather/integrate/bent_normal.h"
#include "gather/temporal/accumulation.h"
#include "tests/gather/constant_atlas.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/gather_pictures.h"
#include "tests/support/render_scenes.h"

namespace {

constexpr glm::vec3 kUp(0.0f, 1.0f, 0.0f);
constexpr std::uint32_t kFrames = 64;

/// A pixel on the floor at the foot of a black wall that covers half of its hemisphere, in an unlit scene.
class NearLight : public testing::Test {
protected:
    NearLight()
        : scene_(tests::scene_of(tests::box({0.01f, 10.0f, 10.0f}), tests::translation({0.02, 0, 0}))),
          tracer_(scene_),
          lighting_(scene_, tracer_, {}),
          hit_lighting_(scene_, tracer_, lighting_, false, 0.0f, 0.0f),
          atlas_(tests::constant_atlas(32, {0.1f, 0, 0}, {0, 0, 0.1f}, kUp)) {
        visible_.resize(1, 1);
        visible_.depth[0] = 2.0f;
        visible_.footprint = gather::PixelFootprint(core::CameraRays(core::Camera{}, 64, 64), 64, 64);
        visible_.outgoing[0] = kUp;
        core::SurfacePoint& point = visible_.points[0];
        point.geometric_normal = kUp;
        point.frame = core::ShadingFrame::from_normal(kUp);
        weights_.resize(1);
        weights_[0].count = 1;
        weights_[0].probe = {4};
        weights_[0].weight = {1.0f};
        settings_.bent_normal_pixels = 100.0f;
    }

    /// Sums over all frames.
    gather::NearLight trace() {
        gather::NearLight sum;
        for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
            const core::Camera camera;
            const core::RenderInputs inputs = tests::pass_inputs(scene_, tracer_, camera);
            const gather::NearLighting near{hit_lighting_, atlas_, weights_, history_};
            std::vector<gather::BentNormal> bent;
            std::vector<gather::NearLight> light;
            gather::trace_bent_normals(inputs, visible_, settings_, frame, &near, bent, light);
            gather::share_near_light(visible_, settings_, 1e5f, frame, bent, history_, light);
            if (light[0].kind == gather::NearLight::Kind::kCompared) ++compared_;
            sum.found.irradiance += light[0].found.irradiance;
            sum.held.irradiance += light[0].held.irradiance;
        }
        return sum;
    }

    /// The texels on the wall's side (x > 0) or the other hold this.
    void fill(float walled, float open) {
        const int n = atlas_.resolution;
        for (std::size_t i = 0; i < atlas_.radiance.size(); ++i) {
            const int t = static_cast<int>(i) % (n * n);
            const glm::vec2 at((static_cast<float>(t % n) + 0.5f) / static_cast<float>(n),
                               (static_cast<float>(t / n) + 0.5f) / static_cast<float>(n));
            atlas_.radiance[i] = glm::vec3(core::direction_from_octahedral(at).x > 0.0f ? walled : open);
        }
    }

    core::Scene scene_;
    core::TriangleTracer tracer_;
    gather::SceneLighting lighting_;
    gather::HitLighting hit_lighting_;
    gather::ProbeAtlas atlas_;
    gather::VisibleSurfaces visible_;
    std::vector<gather::ProbeWeights> weights_;
    gather::IntegrateSettings settings_;
    gather::NearHistory history_;
    std::uint32_t compared_ = 0;
};

TEST_F(NearLight, AWallBeforeTheProbesBrightestDirectionLeavesThemNoShare) {
    fill(100.0f, 1.0f);
    const gather::NearLight sum = trace();
    EXPECT_EQ(compared_, kFrames);
    EXPECT_LT(history_.agreement[0].probe_share(), 0.05f);
    // Half of the hemisphere holds 1, and the texels at the border bring some of the other.
    EXPECT_GT(sum.found.irradiance.x / kFrames, 0.9f * core::kPi / 2.0f);
    EXPECT_LT(sum.found.irradiance.x / kFrames, 2.0f * core::kPi);
    EXPECT_GT(sum.held.irradiance.x, 10.0f * sum.found.irradiance.x);
}

TEST_F(NearLight, AWallBeforeWhatIsDarkAnywayLeavesTheProbesAll) {
    fill(0.0f, 1.0f);
    const gather::NearLight sum = trace();
    EXPECT_GT(history_.agreement[0].probe_share(), 0.95f);
    EXPECT_NEAR(sum.found.irradiance.x / sum.held.irradiance.x, 1.0f, 0.1f);
}

/// Four pixels in a row, two of them compared; what they find is 1 and 4, and the probes held 2 and 8.
class NearLightSharing : public testing::Test {
protected:
    NearLightSharing() : light_(4), bent_(4) {
        visible_.resize(4, 1);
        for (std::size_t i = 0; i < 4; ++i) {
            visible_.depth[i] = 2.0f;
            core::SurfacePoint& point = visible_.points[i];
            point.position = {0.01f * static_cast<float>(i), 0, 0};
            point.geometric_normal = kUp;
            point.frame = core::ShadingFrame::from_normal(kUp);
            point.triangle = static_cast<std::uint32_t>(i);
        }
        for (const std::size_t i : {0, 1}) {
            const float scale = i == 0 ? 1.0f : 4.0f;
            light_[i].kind = gather::NearLight::Kind::kCompared;
            light_[i].found.irradiance = glm::vec3(scale);
            light_[i].held.irradiance = glm::vec3(2.0f * scale);
            light_[i].agreement = {2.0f * scale * scale, 4.0f * scale * scale};
        }
    }

    void share(int radius) {
        gather::IntegrateSettings settings;
        settings.near_field_radius = radius;
        gather::share_near_light(visible_, settings, 1e5f, 0, bent_, history_, light_);
    }

    gather::VisibleSurfaces visible_;
    std::vector<gather::NearLight> light_;
    std::vector<gather::BentNormal> bent_;
    gather::NearHistory history_;
};

TEST_F(NearLightSharing, IsAMeanByATentOverThePlane) {
    share(1);
    EXPECT_FLOAT_EQ(light_[0].found.irradiance.x, (2.0f * 1.0f + 4.0f) / 3.0f);
    EXPECT_FLOAT_EQ(light_[0].held.irradiance.x, (2.0f * 2.0f + 8.0f) / 3.0f);
    EXPECT_FLOAT_EQ(light_[0].compared_share, 1.0f);
    EXPECT_FLOAT_EQ(light_[0].open_share, 0.0f);
    // The third pixel is open, and lends the probes' light.
    EXPECT_FLOAT_EQ(light_[1].found.irradiance.x, (1.0f + 2.0f * 4.0f) / 4.0f);
    EXPECT_FLOAT_EQ(light_[1].compared_share, 0.75f);
    EXPECT_FLOAT_EQ(light_[1].open_share, 0.25f);
    EXPECT_FLOAT_EQ(history_.agreement[0].probe_share(), 0.5f);
    // And takes its share of what its neighbour found, so that none is lost.
    EXPECT_FLOAT_EQ(light_[2].found.irradiance.x, 4.0f / 4.0f);
    EXPECT_FLOAT_EQ(light_[2].compared_share, 0.25f);
    EXPECT_FLOAT_EQ(light_[2].open_share, 0.75f);
    EXPECT_EQ(light_[3].open_share, 1.0f);
    EXPECT_EQ(light_[3].found.irradiance.x, 0.0f);
    EXPECT_EQ(history_.agreement[3].held, 0.0f);
    // Its own rays have found nothing yet: it does not pass on what it was lent.
    EXPECT_EQ(history_.compared, (std::vector<std::uint8_t>{1, 1, 0, 0}));
}

TEST_F(NearLightSharing, KeepsToItselfOffThePlaneAndWhereTheRadiusIsZero) {
    visible_.points[1].position.y = 1.0f;
    share(1);
    EXPECT_FLOAT_EQ(light_[0].found.irradiance.x, 1.0f);
    EXPECT_FLOAT_EQ(light_[1].found.irradiance.x, 4.0f);
    visible_.points[1].position.y = 0.0f;
    share(0);
    EXPECT_FLOAT_EQ(light_[0].found.irradiance.x, 1.0f);
    EXPECT_FLOAT_EQ(light_[1].found.irradiance.x, 4.0f);
}

/// One pixel of a plane finds something; all have as many neighbours as it.
TEST_F(NearLightSharing, LosesNothingAmongOpenPixels) {
    for (const int radius : {1, 2, 8}) {
        const int edge = 4 * radius + 1;
        const auto pixels = static_cast<std::size_t>(edge * edge);
        visible_.resize(edge, edge);
        for (std::size_t i = 0; i < pixels; ++i) {
            visible_.depth[i] = 2.0f;
            visible_.points[i].geometric_normal = kUp;
            visible_.points[i].frame = core::ShadingFrame::from_normal(kUp);
        }
        light_.assign(pixels, {});
        bent_.assign(pixels, {});
        history_ = {};
        gather::NearLight& middle = light_[visible_.index(2 * radius, 2 * radius)];
        middle.kind = gather::NearLight::Kind::kCompared;
        middle.found.irradiance = glm::vec3(3.0f);
        middle.held.irradiance = glm::vec3(5.0f);
        share(radius);
        float found = 0.0f, held = 0.0f, compared = 0.0f;
        for (const gather::NearLight& light : light_) {
            found += light.found.irradiance.x;
            held += light.held.irradiance.x;
            compared += light.compared_share;
        }
        EXPECT_NEAR(found, 3.0f, 1e-4f) << radius;
        EXPECT_NEAR(held, 5.0f, 1e-4f) << radius;
        EXPECT_NEAR(compared, 1.0f, 1e-4f) << radius;
    }
}

TEST_F(NearLightSharing, LobesThatReflectWhatIsNearShareItAmongTheirLike) {
    for (std::size_t i = 0; i < 4; ++i) {
        visible_.points[i].brdf.f0 = glm::vec3(0.5f);
        visible_.points[i].brdf.alpha = 0.8f;
    }
    light_[1].found.specular = glm::vec3(3.0f);
    const std::vector<gather::NearLight> own = light_;
    share(1);
    EXPECT_FLOAT_EQ(light_[0].found.specular.x, 1.0f);
    EXPECT_FLOAT_EQ(light_[1].found.specular.x, 1.5f);
    visible_.points[1].brdf.alpha = 0.6f;
    light_ = own;
    share(1);
    EXPECT_EQ(light_[0].found.specular.x, 0.0f);
    EXPECT_FLOAT_EQ(light_[1].found.specular.x, 3.0f);
    EXPECT_FLOAT_EQ(light_[0].found.irradiance.x, 1.0f);
}

TEST_F(NearLightSharing, APixelWithoutProbesTakesNothingOfThem) {
    light_[1].kind = gather::NearLight::Kind::kAlone;
    share(1);
    EXPECT_FLOAT_EQ(light_[1].found.irradiance.x, (1.0f + 2.0f * 4.0f) / 3.0f);
    EXPECT_EQ(light_[1].compared_share, 0.0f);
    EXPECT_EQ(light_[1].open_share, 0.0f);
    // What it found counts for the other, and no probe's light is set against it.
    EXPECT_FLOAT_EQ(light_[0].found.irradiance.x, 2.0f);
    EXPECT_FLOAT_EQ(light_[0].held.irradiance.x, 4.0f / 3.0f);
    EXPECT_FLOAT_EQ(light_[0].compared_share, 2.0f / 3.0f);
}

TEST(Accumulation, TakesAShareOfTheControlButNothingBelowZero) {
    gather::Accumulation accumulation(3, 1, {"IndirectDiffuse", "IndirectSpecular"}, true);
    gather::FramePixel pixel;
    pixel.surface = true;
    for (int frame = 0; frame < 2; ++frame) {
        pixel.indirect_diffuse = glm::vec3(3.0f);
        pixel.indirect_specular = glm::vec3(1.0f);
        pixel.diffuse_control = glm::vec3(frame == 0 ? 2.0f : -4.0f);
        pixel.specular_control = glm::vec3(0.5f);
        accumulation.add(0, pixel);
        accumulation.add(1, pixel);
        pixel.diffuse_control.y = -100.0f;  // One channel is enough.
        accumulation.add(2, pixel);
    }
    const std::vector<float> shares = {0.5f, 0.0f, 0.5f};
    const core::Image image = accumulation.develop(shares);
    EXPECT_EQ(*image.find("IndirectDiffuse.R"), (std::vector<float>{2.5f, 3.0f, 3.0f}));
    EXPECT_EQ(*image.find("IndirectSpecular.R"), (std::vector<float>{1.25f, 1.0f, 1.25f}));
    EXPECT_EQ(*image.find("R"), (std::vector<float>{3.75f, 4.0f, 4.25f}));
}

/// Beside a lit floor the probes are bright, and hardly any pixel at the foot of the wall sees what they do.
TEST(NearLightPicture, CreasesBesideALitFloorAreNotBlack) {
    gather::Settings settings;
    settings.frames = 16;
    const core::Scene scene = tests::asset("two_rooms");
    const core::Image image =
        tests::gather_picture(scene, tests::camera_of(scene), settings, "auto",
                              {.width = 160, .height = 90, .aovs = {"IndirectDiffuse", "Albedo"}})
            .frame.image;
    const std::vector<float>& albedo = *image.find("Albedo.G");
    int black = 0, surfaces = 0;
    for (std::size_t i = 0; i < albedo.size(); ++i) {
        if (!(albedo[i] > 0.05f)) continue;
        ++surfaces;
        for (const char* channel : {"IndirectDiffuse.R", "IndirectDiffuse.G", "IndirectDiffuse.B"}) {
            black += (*image.find(channel))[i] > 0.0f ? 0 : 1;
        }
    }
    EXPECT_GT(surfaces, 10000);
    EXPECT_EQ(black, 0);
}

}  // namespace
