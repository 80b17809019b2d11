// The bundled scenes through both tracers, as `fieldlight render` makes them.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "cli/render_job.h"
#include "core/image/exr.h"
#include "core/image/metrics.h"
#include "core/support/parallel.h"
#include "tests/support/shared_data.h"

namespace {

struct SceneCase {
    std::string name;
    std::string sky;
    int resolution;
    /// Largest relative difference of the mean radiance, and of the coverage, between fields and triangles.
    double radiance_tolerance, coverage_tolerance;
};

std::ostream& operator<<(std::ostream& out, const SceneCase& c) {
    return out << c.name;
}

core::Image render(const SceneCase& c, cli::TracerKind kind, const std::filesystem::path& folder,
                   int threads = 0) {
    cli::Program program;
    program.common.quiet = true;
    cli::RenderOptions options;
    options.scene.file = tests::assets_folder() / (c.name + ".glb");
    options.scene.sky = c.sky;
    options.output = folder / (c.name + ".exr");
    options.tracer = options.primary = kind;
    options.width = options.height = 64;
    options.samples_per_pixel = 32;
    options.bounces = 2;
    options.bake.resolution = c.resolution;
    core::with_thread_limit(threads, [&] { cli::run_render(program, options); });
    return core::read_exr(options.output);
}

double mean(const core::Image& image, const char* channel) {
    double sum = 0.0;
    for (const float value : *image.find(channel)) sum += static_cast<double>(value);
    return sum / static_cast<double>(image.pixel_count());
}

class BundledScene : public testing::TestWithParam<SceneCase> {};

TEST_P(BundledScene, LooksAlikeThroughFieldsAndTriangles) {
    const tests::TemporaryFolder folder;
    const core::Image triangles = render(GetParam(), cli::TracerKind::kTriangle, folder.path());
    const core::Image fields = render(GetParam(), cli::TracerKind::kSdf, folder.path());
    EXPECT_EQ(core::count_nonfinite(triangles) + core::count_nonfinite(fields), 0u);
    EXPECT_GT(mean(triangles, "G"), 0.0);
    EXPECT_NEAR(mean(fields, "G") / mean(triangles, "G"), 1.0, GetParam().radiance_tolerance);
    EXPECT_NEAR(mean(fields, "A") / mean(triangles, "A"), 1.0, GetParam().coverage_tolerance);
}

TEST_P(BundledScene, HasTheSamePixelsThroughFieldsAtAnyThreadCount) {
    const tests::TemporaryFolder folder;
    const core::Image one = render(GetParam(), cli::TracerKind::kSdf, folder.path(), 1);
    for (const int threads : {2, 3, 8}) {
        std::filesystem::remove_all(folder.path() / (GetParam().name + ".bake"));  // The bake must agree too.
        const core::Image many = render(GetParam(), cli::TracerKind::kSdf, folder.path(), threads);
        for (const core::Channel& channel : one.channels()) {
            ASSERT_EQ(channel.values, *many.find(channel.name)) << threads << " threads, " << channel.name;
        }
    }
}

// Tolerances: the 10 % of radiance and 1 % of coverage.
INSTANTIATE_TEST_SUITE_P(Assets, BundledScene,
                         testing::Values(SceneCase{"cornell_box", "", 64, 0.1, 0.01},
                                         SceneCase{"two_rooms", "1500,1900,2600", 64, 0.1, 0.01},
                                         SceneCase{"glossy", "", 48, 0.1, 0.01}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
