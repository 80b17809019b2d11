// What a point of a surface reads from probes on other surfaces, farther along, or beside something near.
#include "gather/screen_probes/interpolation.h"

#include <gtest/gtest.h>

#include "core/trace/triangle_tracer.h"
#include "gather/integrate/integrate.h"
#include "gather/lighting/scene_lighting.h"
#include "gather/screen_probes/near_field.h"
#include "tests/gather/constant_atlas.h"

namespace {

constexpr glm::vec3 kUp(0.0f, 1.0f, 0.0f);
constexpr glm::vec3 kAside(1.0f, 0.0f, 0.0f);

TEST(SurfaceWeight, ProbesRoundAConvexEdgeShareNothing) {
    // The top of a box and its side, hardly apart, so that the plane distances do not tell.
    EXPECT_EQ(gather::surface_weight({0, 0, 0}, kUp, 1.0f, {1e-4f, -1e-4f, 0}, kAside, 1e5f), 0.0f);
    // A little bent it still counts, less than a flat one.
    const glm::vec3 bent = glm::normalize(glm::vec3(0.5f, 1.0f, 0.0f));
    const float weight = gather::surface_weight({0, 0, 0}, kUp, 1.0f, {1e-4f, 0, 0}, bent, 1e5f);
    EXPECT_GT(weight, 0.5f);
    EXPECT_LT(weight, 0.95f);
    EXPECT_NEAR(gather::surface_weight({0, 0, 0}, kUp, 1.0f, {0.1f, 0, 0}, kUp, 1e5f), 1.0f, 1e-6f);
}

TEST(SurfaceWeight, AFloorSharesWithSlopesButNotWithTheWallBesideIt) {
    // Concave: the wall's point lies above the floor, the floor's in front of the wall.
    EXPECT_EQ(gather::surface_weight({1e-4f, 0, 0}, kUp, 1.0f, {0, 1e-4f, 0}, kAside, 1e5f), 0.0f);
    const glm::vec3 slope = glm::normalize(glm::vec3(1.0f, 1.5f, 0.0f));
    EXPECT_GT(gather::surface_weight({1e-4f, 0, 0}, kUp, 1.0f, {0, 1e-4f, 0}, slope, 1e5f), 0.9f);
}

/// Whoever zooms in, or looks without perspective from afar, sees the same edges as who comes near.
TEST(SurfaceWeight, DepthSaysNothingThroughALongLens) {
    core::Camera camera;
    const auto scale_at = [&](float depth) {
        return gather::PixelFootprint(core::CameraRays(camera, 640, 360), 640, 360).plane_scale(depth);
    };
    camera.vertical_fov = 0.9;
    EXPECT_EQ(scale_at(3.0f), 3.0f);
    camera.vertical_fov = 0.01;  // The picture is 1 unit high 100 away.
    EXPECT_NEAR(scale_at(100.0f), 2.0f, 0.01f);
    camera.orthographic = true;
    camera.magnification = {0.5, 0.5};
    for (const float depth : {10.0f, 1e3f, 1e6f}) EXPECT_NEAR(scale_at(depth), 2.0f, 0.01f) << depth;
}

TEST(SurfaceWeight, PlanesAreAskedFromBothSides) {
    // The second point lies in the first one's plane, but not the first in the second's.
    const glm::vec3 slope = glm::normalize(glm::vec3(0.3f, 1.0f, 0.0f));
    EXPECT_LT(gather::surface_weight({0.1f, 0, 0}, kUp, 1.0f, {0, 0, 0}, slope, 1e5f), 1e-6f);
}

/// A floor seen at a grazing angle: rows side by side on the screen are far apart.
gather::ProbeAtlas grazing_atlas() {
    return tests::constant_atlas(4, {0.1f, 0, 0}, {0, 0, -2.0f}, kUp);
}

/// Directional albedo of the specular lobe of a metal.
double sampled_albedo(const core::Brdf& metal, const glm::vec3& outgoing) {
    double albedo = 0.0;
    constexpr std::uint32_t kCount = 1u << 14;
    for (std::uint32_t i = 0; i < kCount; ++i) {
        const core::BrdfSample chosen =
            core::sample(metal, outgoing, 0.5f, core::SampleSequence(3, i).point(0));
        if (!(chosen.pdf > 0.0f)) continue;
        albedo += static_cast<double>(chosen.value.specular.x * chosen.incoming.z / chosen.pdf) / kCount;
    }
    return albedo;
}

/// More probes than a pixel reads, the one beside it the last of them.
TEST(ProbeInterpolation, WhereProbesCrowdThoseThatMatterAreRead) {
    gather::ProbeAtlas atlas = tests::constant_atlas(4, {0.1f, 0, 0}, {0, 0, 0.1f}, kUp);
    const glm::ivec2 at(24, 24);
    gather::Probe crumb = atlas.probes[4];
    for (int i = 0; i < 20; ++i) {
        crumb.pixel = {at.x - 15, at.y - 15 + i % 2};
        atlas.probes.push_back(crumb);
    }
    gather::Probe own = atlas.probes[4];
    own.pixel = at;
    atlas.probes.push_back(own);
    atlas.adaptive_begin = {9, 29, 29, 29, 29, 30, 30, 30, 30, 30};
    const gather::ProbeWeights weights =
        gather::find_probes(atlas, {glm::vec2(at), own.position, kUp, 2.0f, 0.1f}, 1e5f);
    EXPECT_EQ(weights.count, gather::ProbeWeights::kMost);
    float own_weight = 0.0f, sum = 0.0f;
    for (std::size_t i = 0; i < weights.count; ++i) {
        sum += weights.weight[i];
        if (weights.probe[i] == 29) own_weight = weights.weight[i];
    }
    EXPECT_NEAR(sum, 1.0f, 1e-5f);
    EXPECT_GT(own_weight, 0.5f);
}

TEST(ProbeInterpolation, LengthsWhoseSquaresVanishLeaveFiniteWeights) {
    const gather::ProbeAtlas atlas = tests::constant_atlas(4, {0.1f, 0, 0}, {0, 0, 0.1f}, kUp);
    for (const float spacing : {0.0f, 1e-30f}) {
        const gather::ProbeWeights weights = gather::find_probes(
            atlas, {glm::vec2(21, 25), atlas.probes[4].position, kUp, 2.0f, spacing}, 1e5f);
        float sum = 0.0f;
        for (std::size_t i = 0; i < weights.count; ++i) sum += weights.weight[i];
        EXPECT_NEAR(sum, 1.0f, 1e-6f) << spacing;
    }
}

TEST(ProbeInterpolation, OnAGrazingSurfaceNearerProbesCountMore) {
    const gather::ProbeAtlas atlas = grazing_atlas();
    // Half-way on the screen between the rows; in the world much nearer to the first.
    const gather::ProbeReader reader{{21.0f, 17.0f}, {0.1f, 0.0f, -0.1f}, kUp, 2.0f, 0.1f};
    const gather::ProbeWeights weights = gather::find_probes(atlas, reader, 1e4f);
    float first_row = 0.0f;
    for (std::size_t i = 0; i < weights.count; ++i) {
        if (weights.probe[i] < 3) first_row += weights.weight[i];
    }
    EXPECT_GT(first_row, 0.99f);
    EXPECT_GT(weights.surface_support, weights.support);
    // Without a spacing the world's distances are not asked.
    gather::ProbeReader without = reader;
    without.spacing = std::numeric_limits<float>::infinity();
    const gather::ProbeWeights even = gather::find_probes(atlas, without, 1e4f);
    EXPECT_FLOAT_EQ(even.surface_support, even.support);
}

TEST(NearField, ATexelThatEndsNearTakesWhatItsNeighboursSeeBeyond) {
    gather::ProbeAtlas atlas = tests::constant_atlas(4, {0.1f, 0, 0}, {0, 0, 0.1f}, kUp);
    for (glm::vec3& value : atlas.radiance) value = glm::vec3(2.0f);
    for (float& distance : atlas.hit_distance) distance = 10.0f;
    const std::size_t texels = atlas.texel_count();
    atlas.radiance[4 * texels + 3] = glm::vec3(1000.0f);
    atlas.hit_distance[4 * texels + 3] = 1e-3f;
    // In texel 5 all are near: none knows better, and the centre keeps its own.
    for (std::size_t p = 0; p < 9; ++p) atlas.hit_distance[p * texels + 5] = 1e-3f;
    atlas.radiance[4 * texels + 5] = glm::vec3(7.0f);

    core::Camera camera;
    gather::VisibleSurfaces visible;
    visible.footprint = gather::PixelFootprint(core::CameraRays(camera, 48, 48), 48, 48);
    gather::take_out_near_field({}, visible, 16.0f, atlas);
    EXPECT_EQ(atlas.radiance[4 * texels + 3], glm::vec3(2.0f));
    EXPECT_EQ(atlas.hit_distance[4 * texels + 3], 10.0f);
    EXPECT_EQ(atlas.radiance[4 * texels + 5], glm::vec3(7.0f));
    EXPECT_EQ(atlas.radiance[3 * texels + 3], glm::vec3(2.0f));
}

/// Probes that hold 1 everywhere: a lobe sends back its directional albedo, sampled here with other numbers.
TEST(IntegrateSpecular, ConstantProbesGiveTheDirectionalAlbedo) {
    const gather::ProbeAtlas atlas = grazing_atlas();
    gather::VisibleSurfaces visible;
    visible.resize(1, 1);
    visible.depth[0] = 2.0f;
    visible.outgoing[0] = glm::normalize(glm::vec3(0.4f, 1.0f, 0.1f));
    core::SurfacePoint& point = visible.points[0];
    point.geometric_normal = kUp;
    point.frame = core::ShadingFrame::from_normal(kUp);
    gather::ProbeWeights weights;
    weights.probe = {0, 4};
    weights.weight = {0.25f, 0.75f};
    weights.count = 2;
    gather::IntegrateSettings settings;
    settings.specular_directions = 64;
    const gather::TexelTable table(atlas.resolution);
    for (const float roughness : {0.2f, 0.5f, 0.8f}) {
        SCOPED_TRACE(roughness);
        point.roughness = roughness;
        point.brdf = core::Brdf{};
        point.brdf.diffuse = glm::vec3(0.0f);
        point.brdf.f0 = glm::vec3(0.7f);
        point.brdf.alpha = roughness * roughness;
        gather::IndirectLight light;
        light.reset(1, false);
        constexpr std::uint32_t kFrames = 64;
        for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
            gather::integrate_specular({visible, atlas, table, {}, settings, 1, frame}, {weights},
                                       {.directional = true}, {}, light);
        }
        const double albedo = sampled_albedo(point.brdf, point.frame.to_local(visible.outgoing[0]));
        EXPECT_NEAR(static_cast<double>(light.specular[0].x) / kFrames / albedo, 1.0, 0.01);
    }
}

/// A smooth metal under a constant sky that is sampled: light sampling and the lobe's own ray together bring
/// what the lobe reflects of it, however narrow it is.
TEST(HitLighting, LobeRaysAndLightSamplingAddUpOnASmoothMetal) {
    core::Scene scene;
    scene.sky = core::Sky::constant(glm::vec3(1.0f));
    const core::TriangleTracer tracer(scene);
    gather::LightingSettings settings;
    settings.sampled_emitters = gather::SampledEmitters::kAll;
    const gather::SceneLighting lighting(scene, tracer, settings);
    core::SurfacePoint surface;
    surface.geometric_normal = kUp;
    surface.frame = core::ShadingFrame::from_normal(kUp);
    for (const float roughness : {0.05f, 0.3f, 0.5f, 0.8f}) {
        SCOPED_TRACE(roughness);
        surface.roughness = roughness;
        surface.brdf = core::Brdf{};
        surface.brdf.diffuse = glm::vec3(0.0f);
        surface.brdf.f0 = glm::vec3(1.0f);
        surface.brdf.alpha = roughness * roughness;
        EXPECT_EQ(gather::mirrors_lights(surface), roughness <= 0.5f);
        const glm::vec3 outgoing = glm::normalize(glm::vec3(0.3f, 1.0f, 0.2f));
        const core::LightSampler::Selection selection = lighting.sampled().selection({glm::vec3(0.0f), kUp});
        double sum = 0.0;
        constexpr std::uint32_t kCount = 1u << 14;
        for (std::uint32_t i = 0; i < kCount; ++i) {
            const core::SampleSequence sequence(7, i);
            const auto light = gather::sample_light(lighting, lighting.sampled(), selection, surface,
                                                    glm::vec3(0.0f), outgoing, sequence.point(0), 0);
            if (light) sum += static_cast<double>(light->specular.x);
            if (!gather::mirrors_lights(surface)) continue;
            const auto lobe = gather::sample_lobe(selection, surface, glm::vec3(0.0f), outgoing,
                                                  sequence.point(1).x, sequence.point(2), 0);
            if (!lobe) continue;
            gather::trace_lobes(
                scene, tracer, lighting.sampled(), {&*lobe, 1},
                [&](std::size_t, const glm::vec3& value) { sum += static_cast<double>(value.x); });
        }
        const double albedo = kCount * sampled_albedo(surface.brdf, surface.frame.to_local(outgoing));
        EXPECT_NEAR(sum / albedo, 1.0, 0.02);
    }
}

}  // namespace
