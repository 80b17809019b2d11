// The rays of probes on a ball in a constant sky: what a texel holds is known.
#include "gather/screen_probes/tracing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "core/math/sampling.h"
#include "core/trace/triangle_tracer.h"
#include "gather/screen_probes/placement.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/gather_pictures.h"

namespace {

/// Radiance 1 from everywhere, and none from the black ball itself.
core::Scene black_ball() {
    core::Scene scene = tests::scene_of(tests::icosphere(4));
    scene.materials = {tests::lambert(glm::vec3(0.0f))};
    scene.sky = core::Sky::constant(glm::vec3(1.0f));
    return scene;
}

TEST(ProbeTracing, AlongTheHorizonNoTexelHoldsMuchMoreThanArrives) {
    const core::Scene scene = black_ball();
    const core::TriangleTracer tracer(scene);
    const core::Camera camera = core::look_at({0.0, 0.0, 4.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 0.6);
    const core::RenderInputs inputs = tests::pass_inputs(scene, tracer, camera, 64);
    gather::ScreenProbeSettings settings;
    settings.spacing = 2;
    gather::LightingSettings light;
    light.sampled_emitters = gather::SampledEmitters::kNone;
    const gather::SceneLighting lighting(scene, tracer, light);
    const gather::HitLighting hit_lighting(scene, tracer, lighting, false, 0.0f, 0.0f);
    const gather::TexelTable table(settings.resolution);
    gather::VisibleSurfaces visible;
    gather::find_visible_surfaces(inputs, lighting, std::vector<std::uint32_t>(64 * 64, 0), visible);
    gather::ProbeAtlas atlas;
    gather::place_probes(visible, settings, false, 0, 1, atlas);
    gather::trace_probes({.inputs = inputs,
                          .visible = visible,
                          .lighting = lighting,
                          .hit_lighting = hit_lighting,
                          .table = table,
                          .settings = settings,
                          .cull = false,
                          .specular_readers = {}},
                         atlas);
    float most = 0.0f;
    for (const glm::vec3& radiance : atlas.radiance) most = std::max(most, radiance.x);
    EXPECT_LE(most, 2.0f);
    std::vector<float> weights(atlas.texel_count());
    double sum = 0.0;
    int count = 0;
    for (std::size_t p = 0; p < atlas.probes.size(); ++p) {
        if (!atlas.probes[p].valid()) continue;
        const gather::Probe& probe = atlas.probes[p];
        table.cosine_weights(visible.points[visible.index(probe.pixel.x, probe.pixel.y)].frame.normal,
                             weights);
        for (std::size_t t = 0; t < weights.size(); ++t) {
            sum += static_cast<double>(weights[t] * atlas.radiance_of(p)[t].x / core::kPi);
        }
        ++count;
    }
    ASSERT_GT(count, 500);
    EXPECT_NEAR(sum / count, 1.0, 0.01);
}

}  // namespace
