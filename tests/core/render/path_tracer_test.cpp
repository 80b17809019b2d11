#include "core/render/path_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/render_scenes.h"

namespace {

using tests::RenderRequest;

class Furnace : public testing::TestWithParam<float> {};

TEST_P(Furnace, HasRadianceOneWithoutALimitOnBounces) {
    const core::Image image = tests::render(tests::furnace(GetParam()), tests::inside_camera(),
                                            {.width = 32, .height = 32, .samples_per_pixel = 128})
                                  .image;
    EXPECT_NEAR(tests::mean_radiance(image), 1.0, 0.005);  // reliability.md.
}

TEST_P(Furnace, LosesExactlyWhatTruncationCutsOff) {
    const double rho = static_cast<double>(GetParam());
    for (const int bounces : {0, 1, 2, 5}) {
        const core::Image image =
            tests::render(tests::furnace(GetParam()), tests::inside_camera(),
                          {.width = 24, .height = 24, .samples_per_pixel = 128, .bounces = bounces})
                .image;
        // N indirect bounces: emission scattered 0 ... N + 1 times, a geometric series.
        const double expected = 1.0 - std::pow(rho, bounces + 2);
        EXPECT_NEAR(tests::mean_radiance(image) / expected, 1.0, 0.005) << bounces << " bounces";
    }
}

INSTANTIATE_TEST_SUITE_P(Albedo, Furnace, testing::Values(0.2f, 0.5f, 0.8f, 0.95f), [](const auto& test) {
    return "rho_" + std::to_string(static_cast<int>(test.param * 100));
});

TEST(PathTracer, LightsASphereFromItsCentreWithRadianceOne) {
    const core::Image image = tests::render(tests::lamp_in_sphere(), tests::inside_camera(),
                                            {.width = 32, .height = 32, .samples_per_pixel = 256})
                                  .image;
    EXPECT_NEAR(tests::mean_radiance(image), 1.0, 0.005);  // The issue's bound.
}

TEST(PathTracer, DoublesEveryPixelExactlyWithAllLights) {
    const RenderRequest request{.samples_per_pixel = 32};
    const core::Image once = tests::render(tests::mixed_room(1.0f), tests::room_camera(), request).image;
    const core::Image twice = tests::render(tests::mixed_room(2.0f), tests::room_camera(), request).image;
    for (const char* channel : {"R", "G", "B"}) {
        const std::vector<float>& a = *once.find(channel);
        const std::vector<float>& b = *twice.find(channel);
        for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(2.0f * a[i], b[i]) << channel << " pixel " << i;
    }
}

TEST(PathTracer, GivesTheSameBitsAtAnyThreadCount) {
    const core::Scene scene = tests::mixed_room();
    const RenderRequest request{
        .width = 40, .height = 24, .samples_per_pixel = 16, .aovs = {"Variance", "Direct", "Normal"}};
    const core::Image reference = tests::render(scene, tests::room_camera(), request).image;
    for (const int threads : {1, 2, 3, 8}) {
        core::Image image;
        core::with_thread_limit(threads,
                                [&] { image = tests::render(scene, tests::room_camera(), request).image; });
        for (const core::Channel& channel : reference.channels()) {
            ASSERT_EQ(channel.values, *image.find(channel.name)) << threads << " threads, " << channel.name;
        }
    }
}

TEST(PathTracer, GivesTheSameBeautyWhateverLayersAreAskedForButVariance) {
    const core::Scene scene = tests::mixed_room();
    const core::Image alone = tests::render(scene, tests::room_camera(), {.samples_per_pixel = 16}).image;
    const core::Image with = tests::render(scene, tests::room_camera(),
                                           {.samples_per_pixel = 16,
                                            .aovs = {"Depth", "Normal", "Albedo", "Direct", "IndirectDiffuse",
                                                     "IndirectSpecular", "HitDistance", "Steps"}})
                                 .image;
    for (const char* channel : {"R", "G", "B", "A"}) EXPECT_EQ(*alone.find(channel), *with.find(channel));
    EXPECT_EQ(core::count_nonfinite(with), 0u);
}

TEST(PathTracer, SplitsTheBeautyIntoDirectAndIndirect) {
    const core::Image image =
        tests::render(tests::mixed_room(), tests::room_camera(),
                      {.samples_per_pixel = 16, .aovs = {"Direct", "IndirectDiffuse", "IndirectSpecular"}})
            .image;
    const auto beauty = *image.color();
    const auto direct = *image.color("Direct");
    const auto diffuse = *image.color("IndirectDiffuse");
    const auto specular = *image.color("IndirectSpecular");
    double indirect = 0.0;
    for (std::size_t i = 0; i < beauty.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(beauty[i][c], direct[i][c] + diffuse[i][c] + specular[i][c],
                        1e-5f * (1.0f + beauty[i][c]));
        }
        indirect += static_cast<double>(diffuse[i].y);
    }
    EXPECT_GT(indirect, 0.0);

    // With no indirect bounce, all there is is direct; the scene is Lambert, so nothing is specular.
    const core::Image truncated =
        tests::render(tests::mixed_room(), tests::room_camera(),
                      {.samples_per_pixel = 16, .bounces = 0, .aovs = {"Direct", "IndirectDiffuse"}})
            .image;
    for (std::size_t i = 0; i < truncated.pixel_count(); ++i) {
        // The sums run in another order: rounding of 16 terms.
        EXPECT_NEAR((*truncated.find("Direct.G"))[i], (*truncated.find("G"))[i],
                    1e-5f * (*truncated.find("G"))[i]);
    }
    for (const float value : *truncated.find("IndirectDiffuse.G")) EXPECT_EQ(value, 0.0f);
}

TEST(PathTracer, PredictsItsOwnVariance) {
    // Mean claimed variance against the spread of the means over seeds. 24 seeds of 256 pixels and 3
    // channels: the ratio's own deviation is about sqrt(2 / (23 * 256)) x a heavy tail, well under 15 %.
    const core::Scene scene = tests::mixed_room();
    constexpr int kSeeds = 24;
    std::vector<double> sum(256 * 3, 0.0), squares(256 * 3, 0.0);
    double claimed = 0.0;
    for (int seed = 0; seed < kSeeds; ++seed) {
        const core::Image image = tests::render(scene, tests::room_camera(),
                                                {.samples_per_pixel = 32,
                                                 .bounces = 2,
                                                 .seed = static_cast<std::uint64_t>(seed),
                                                 .aovs = {"Variance"}})
                                      .image;
        const auto color = *image.color();
        for (std::size_t i = 0; i < color.size(); ++i) {
            for (std::size_t c = 0; c < 3; ++c) {
                const double value = static_cast<double>(color[i][static_cast<int>(c)]);
                sum[3 * i + c] += value;
                squares[3 * i + c] += value * value;
            }
        }
        const std::vector<glm::vec3> variance = *image.color("Variance");
        for (const glm::vec3& v : variance) claimed += static_cast<double>(v.x + v.y + v.z) / kSeeds;
    }
    double measured = 0.0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
        measured += (squares[i] - sum[i] * sum[i] / kSeeds) / (kSeeds - 1);
    }
    EXPECT_NEAR(claimed / measured, 1.0, 0.15);
}

TEST(PathTracer, RefusesLayersItCannotFill) {
    const core::Scene scene = tests::furnace(0.5f);
    EXPECT_THROW(tests::render(scene, tests::inside_camera(), {.aovs = {"Colour"}}), core::InputError);
    EXPECT_THROW(tests::render(scene, tests::inside_camera(), {.samples_per_pixel = 4, .aovs = {"Variance"}}),
                 core::InputError);
}

TEST(PathTracer, EndsWithinItsTimeBudget) {
    const core::Frame frame = tests::render(tests::furnace(0.5f), tests::inside_camera(),
                                            {.samples_per_pixel = 1 << 24, .time_budget_seconds = 0.2});
    EXPECT_GE(frame.samples_per_pixel, 1.0);
    EXPECT_LT(frame.samples_per_pixel, 1 << 20);
    EXPECT_NEAR(tests::mean_radiance(frame.image), 1.0, 0.2);
}

TEST(PathTracer, SeesBlackWhereThereIsNoLight) {
    core::Scene scene = tests::scene_of(tests::icosphere(2));
    const core::Image image = tests::render(scene, tests::inside_camera()).image;
    for (const char* channel : {"R", "G", "B"}) {
        for (const float value : *image.find(channel)) EXPECT_EQ(value, 0.0f);
    }
    for (const float value : *image.find("A")) EXPECT_EQ(value, 1.0f);
}

}  // namespace
