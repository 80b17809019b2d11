// Contact shadows under the hit-distance clamp of the probes' spatial filter: without it the sky that a
// neighbour sees past an occluder is taken for light at its foot.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "tests/support/analytic_scenes.h"
#include "tests/support/gather_pictures.h"
#include "tests/support/render_scenes.h"

namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;

/// What the floor sends out far from the block: its albedo, under a sky of 1.
constexpr double kOpenFloor = 0.5;

/// Floor pixels by the truth, as shares of the open floor: the first strip lies at the block's foot.
struct Strip {
    double low, high;
};
constexpr std::array<Strip, 4> kStrips = {{{0.5, 0.6}, {0.6, 0.7}, {0.7, 0.8}, {0.8, 0.9}}};
/// All that is clearly darker than the open floor.
constexpr Strip kShadow = {0.5, 0.8};

/// A dark block on a grey floor; the uniform sky is found by hits alone, so the shadow is the probes' own.
core::Scene block_under_sky() {
    core::Scene scene;
    const std::uint32_t grey = tests::add_material(scene, tests::lambert(glm::vec3(kOpenFloor)));
    const std::uint32_t dark = tests::add_material(scene, tests::lambert(glm::vec3(0.1f)));
    const std::uint32_t floor = tests::add_mesh(scene, tests::box({15.0f, 0.1f, 15.0f}));
    const std::uint32_t block = tests::add_mesh(scene, tests::box(glm::vec3(1.0f)));
    tests::add_instance(scene, floor, tests::translation({0, -0.1, 0}), grey);
    tests::add_instance(scene, block, tests::translation({0, 1, 0}), dark);
    scene.sky = core::Sky::constant(glm::vec3(1.0f));
    return scene;
}

/// The foot of the block's front and the floor before it; the block's top is out of the picture.
core::Camera at_the_foot() {
    return core::look_at({0, 4, 7}, {0, 0.3, 1.6}, {0, 1, 0}, 0.5);
}

// Errors as measured, in %, by strip and over kShadow:
//                                        0.5-0.6  0.6-0.7  0.7-0.8  0.8-0.9   shadow
//   medium                                   -0.7     +1.6     -0.6     +0.1     +0.1
//   medium, no clamp                        +10.9    +23.4    +20.6    +11.3    +20.6
//   no bent normals                         +13.7     +3.7     -0.6     +0.1     +1.9
//   no bent normals, no clamp               +53.2    +38.7    +22.8    +11.4    +30.0
//   no bent normals, no filter              +12.4     +2.8     -1.3     -0.5     +1.1
class ContactShadow : public testing::Test {
protected:
    static void SetUpTestSuite() {
        truth_.emplace(tests::render(block_under_sky(), at_the_foot(),
                                     {.width = kWidth,
                                      .height = kHeight,
                                      .samples_per_pixel = 256,
                                      .bounces = 1,
                                      .seed = 7,
                                      .aovs = {"Normal"}})
                           .image);
    }
    static void TearDownTestSuite() { truth_.reset(); }

    /// The mean of several seeds, green.
    static std::vector<double> gathered(const gather::Settings& settings) {
        constexpr int kSeeds = 3;
        const core::Scene scene = block_under_sky();
        std::vector<double> mean(static_cast<std::size_t>(kWidth * kHeight));
        for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
            const core::Image image =
                tests::gather_picture(scene, at_the_foot(), settings, "auto",
                                      {.width = kWidth, .height = kHeight, .seed = seed})
                    .frame.image;
            const std::vector<float>& green = *image.find("G");
            for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += static_cast<double>(green[i]) / kSeeds;
        }
        return mean;
    }

    /// Mean of the picture over the strip's floor by that of the truth, less 1.
    static double error(const std::vector<double>& picture, const Strip& strip) {
        const std::vector<float>& green = *truth_->find("G");
        const std::vector<float>& up = *truth_->find("Normal.Y");
        double mine = 0.0;
        double right = 0.0;
        int count = 0;
        for (std::size_t i = 0; i < picture.size(); ++i) {
            const auto value = static_cast<double>(green[i]);
            if (!(up[i] > 0.99f) || !(value >= strip.low * kOpenFloor) ||
                !(value < strip.high * kOpenFloor)) {
                continue;
            }
            mine += picture[i];
            right += value;
            ++count;
        }
        return count >= 200 ? mine / right - 1.0 : std::numeric_limits<double>::quiet_NaN();
    }

    static inline std::optional<core::Image> truth_;
};

gather::Settings without_clamp(gather::Settings settings) {
    settings.screen_probes.clamp_hit_distance = false;
    return settings;
}

TEST_F(ContactShadow, MediumIsWithinFivePercentUnderTheClampAndWrongWithoutIt) {
    const gather::Settings medium;
    const std::vector<double> clamped = gathered(medium);
    for (const Strip& strip : kStrips) EXPECT_NEAR(error(clamped, strip), 0.0, 0.05) << strip.low;
    EXPECT_NEAR(error(clamped, kShadow), 0.0, 0.05);
    EXPECT_GE(error(gathered(without_clamp(medium)), kShadow), 0.15);
}

// The probes alone. At the very foot, nearer than the probes' spacing of 16 pixels, their interpolation blurs
// the shadow, filter or no filter (+14 % in the first strip); the short rays at full resolution mend that.
TEST_F(ContactShadow, TheProbesAloneAreWithinFivePercentUnderTheClampAndWrongWithoutIt) {
    gather::Settings probes;
    probes.integrate.bent_normal = false;
    const std::vector<double> clamped = gathered(probes);
    const std::vector<double> unclamped = gathered(without_clamp(probes));
    gather::Settings unfiltered_probes = probes;
    unfiltered_probes.screen_probes.spatial_filter = false;
    const std::vector<double> unfiltered = gathered(unfiltered_probes);
    EXPECT_NEAR(error(clamped, kShadow), 0.0, 0.05);
    EXPECT_GE(error(unclamped, kShadow), 0.15);
    for (const Strip& strip : kStrips) {
        if (strip.low >= 0.6) {
            EXPECT_NEAR(error(clamped, strip), 0.0, 0.05) << strip.low;
        }
        EXPECT_NEAR(error(clamped, strip), error(unfiltered, strip), 0.02) << strip.low;
    }
}

}  // namespace
