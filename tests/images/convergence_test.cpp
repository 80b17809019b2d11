// The path tracer against itself where it must agree: between estimators, and with more samples.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/image/z_test.h"
#include "core/render/path_tracer.h"
#include "tests/support/render_scenes.h"

namespace {

TEST(PathTracer, AgreesBetweenBothEstimators) {
    // BRDF sampling alone against light sampling with multiple importance sampling: one integral, two ways.
    const core::Scene scene = tests::area_lit_room();
    const core::Image mixed =
        tests::render(scene, tests::room_camera(),
                      {.samples_per_pixel = 512, .bounces = 3, .seed = 1, .aovs = {"Variance"}})
            .image;
    const core::Image scattered = tests::render(scene, tests::room_camera(),
                                                {.samples_per_pixel = 8192,
                                                 .bounces = 3,
                                                 .seed = 2,
                                                 .light_sampling = false,
                                                 .aovs = {"Variance"}})
                                      .image;
    // reliability.md: >= 99.75 % of pixels pass.
    EXPECT_GE(core::pixel_z_test(mixed, scattered).passing_fraction(), 0.9975);
    EXPECT_NEAR(tests::mean_radiance(mixed) / tests::mean_radiance(scattered), 1.0, 0.01);
}

TEST(PathTracer, ConvergesAtLeastAsFastAsRandomSampling) {
    const core::Scene scene = tests::mixed_room();
    const core::Image reference =
        tests::render(scene, tests::room_camera(), {.samples_per_pixel = 16384, .bounces = 2, .seed = 99})
            .image;
    // Least squares of log MSE over log samples; the reference's own error is 1/32 of the last point's at
    // most.
    std::vector<double> x, y;
    for (const int samples : {8, 32, 128, 512}) {
        double error = 0.0;
        const int seeds = 2048 / samples > 16 ? 16 : 4;
        for (int seed = 0; seed < seeds; ++seed) {
            const core::Image image =
                tests::render(
                    scene, tests::room_camera(),
                    {.samples_per_pixel = samples, .bounces = 2, .seed = static_cast<std::uint64_t>(seed)})
                    .image;
            error += tests::mean_squared_error(image, reference) / seeds;
        }
        x.push_back(std::log(samples));
        y.push_back(std::log(error));
    }
    double mean_x = 0.0, mean_y = 0.0, covariance = 0.0, variance = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        mean_x += x[i] / static_cast<double>(x.size());
        mean_y += y[i] / static_cast<double>(x.size());
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
        covariance += (x[i] - mean_x) * (y[i] - mean_y);
        variance += (x[i] - mean_x) * (x[i] - mean_x);
    }
    EXPECT_LE(covariance / variance, -0.9);  // reliability.md.
}

}  // namespace
