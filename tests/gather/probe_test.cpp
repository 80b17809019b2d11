// Probes stage by stage: each average gives back a constant environment, each ray is accounted for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "core/math/sampling.h"
#include "gather/integrate/bent_normal.h"
#include "gather/integrate/reflectance.h"
#include "gather/screen_probes/filtering.h"
#include "gather/screen_probes/importance.h"
#include "gather/screen_probes/interpolation.h"
#include "gather/screen_probes/probe_atlas.h"
#include "tests/gather/constant_atlas.h"

namespace {

/// Probes on the plane z = 0, a tenth apart.
gather::ProbeAtlas constant_atlas(int resolution) {
    return tests::constant_atlas(resolution, {0.1f, 0, 0}, {0, 0.1f, 0}, {0, 0, 1});
}

glm::vec3 random_direction(std::mt19937& random) {
    std::uniform_real_distribution<float> u;
    return core::sample_uniform_sphere({u(random), u(random)});
}

TEST(ProbeAtlas, HarmonicsGiveBackAConstantEnvironment) {
    std::mt19937 random(1);
    for (const int resolution : {4, 8, 16, 32}) {
        gather::ProbeAtlas atlas = constant_atlas(resolution);
        gather::project_to_sh(gather::TexelTable(resolution), atlas);
        for (int i = 0; i < 200; ++i) {
            const core::Sh lobe = core::sh_clamped_cosine(random_direction(random));
            // The stage's furnace: 1 +- 1e-4 (reliability.md).
            EXPECT_NEAR(core::sh_dot(atlas.sh[0], lobe).x / core::kPi, 1.0f, 1e-4f) << resolution;
        }
    }
}

TEST(ProbeAtlas, CosineWeightsSumToPi) {
    std::mt19937 random(2);
    for (const int resolution : {4, 8, 16}) {
        const gather::TexelTable table(resolution);
        std::vector<float> weights(static_cast<std::size_t>(resolution * resolution));
        for (int i = 0; i < 100; ++i) {
            table.cosine_weights(random_direction(random), weights);
            double sum = 0.0;
            for (const float weight : weights) sum += static_cast<double>(weight);
            EXPECT_NEAR(sum / 3.14159265358979, 1.0, 1e-5) << resolution;
        }
    }
}

TEST(ProbeAtlas, ReadsAreContinuousAcrossTheBorder) {
    gather::ProbeAtlas atlas = constant_atlas(8);
    std::mt19937 random(3);
    std::uniform_real_distribution<float> u;
    for (glm::vec3& value : atlas.radiance) value = glm::vec3(u(random));
    for (int i = 0; i < 1000; ++i) {
        const float along = u(random);
        // (0, v) and (0, 1 - v) are one direction.
        EXPECT_NEAR(atlas.read(0, {0.0f, along}).x, atlas.read(0, {0.0f, 1.0f - along}).x, 2e-6f);
        EXPECT_NEAR(atlas.read(0, {along, 1.0f}).x, atlas.read(0, {1.0f - along, 1.0f}).x, 2e-6f);
    }
}

TEST(SpatialFilter, GivesBackAConstantEnvironment) {
    gather::ProbeAtlas atlas = constant_atlas(8);
    gather::ScreenProbeSettings settings;
    gather::filter_probes(settings, gather::TexelTable(8), atlas);
    for (const glm::vec3& value : atlas.radiance) EXPECT_NEAR(value.x, 1.0f, 1e-4f);
}

TEST(SpatialFilter, FillsCulledTexelsFromNeighbours) {
    gather::ProbeAtlas atlas = constant_atlas(8);
    const std::size_t culled = 4 * atlas.texel_count() + 20;
    atlas.radiance[culled] = glm::vec3(0.0f);
    atlas.hit_distance[culled] = 0.0f;
    atlas.ray_count[culled] = 0;
    gather::filter_probes({}, gather::TexelTable(8), atlas);
    EXPECT_NEAR(atlas.radiance[culled].x, 1.0f, 1e-6f);
}

TEST(SpatialFilter, ClampKeepsDistantLightOutOfAContact) {
    // The centre probe's texel meets something dark and near; its neighbours see far, bright light there.
    const auto centre_after = [](bool clamp) {
        gather::ProbeAtlas atlas = constant_atlas(8);
        for (float& distance : atlas.hit_distance) distance = 1000.0f;
        const std::size_t texel = 4 * atlas.texel_count() + 20;
        atlas.radiance[texel] = glm::vec3(0.0f);
        atlas.hit_distance[texel] = 0.05f;
        gather::ScreenProbeSettings settings;
        settings.clamp_hit_distance = clamp;
        gather::filter_probes(settings, gather::TexelTable(8), atlas);
        return atlas.radiance[texel].x;
    };
    EXPECT_LT(centre_after(true), 0.01f);
    EXPECT_GT(centre_after(false), 0.5f);
}

TEST(StructuredImportance, CompositeWeightsOfEveryTexelAreZeroOrOne) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> u;
    for (int trial = 0; trial < 2000; ++trial) {
        std::vector<float> brdf(64), light(64);
        for (float& value : brdf) value = u(random) < 0.4f ? 0.05f * u(random) : u(random);
        for (float& value : light) value = 4.0f * u(random) * u(random);
        std::vector<gather::ProbeRay> rays = gather::uniform_rays(8);
        gather::choose_rays(brdf, light, 0.1f, rays);
        ASSERT_EQ(rays.size(), 64u);
        std::map<std::size_t, std::vector<gather::ProbeRay>> by_texel;
        for (const gather::ProbeRay& ray : rays) by_texel[ray.texel(8)].push_back(ray);
        for (const auto& [texel, list] : by_texel) {
            ASSERT_TRUE(list.size() == 1 || list.size() == 4);
            if (list.size() == 1) {
                EXPECT_EQ(list[0].level, 0);
                continue;
            }
            int seen = 0;
            for (const gather::ProbeRay& ray : list) seen |= 1 << ((ray.x & 1) + 2 * (ray.y & 1));
            EXPECT_EQ(seen, 15);  // Each quarter once.
        }
        for (std::size_t texel = 0; texel < 64; ++texel) {
            // The guess of the light never culls.
            EXPECT_TRUE(brdf[texel] < 0.1f || by_texel.count(texel)) << texel;
        }
    }
}

TEST(StructuredImportance, RaysGoToTheBrightestTexel) {
    std::vector<float> brdf(64, 1.0f), light(64, 0.5f);
    for (std::size_t texel = 0; texel < 32; ++texel) brdf[texel] = 0.0f;
    light[40] = 10.0f;
    std::vector<gather::ProbeRay> rays = gather::uniform_rays(8);
    gather::choose_rays(brdf, light, 0.1f, rays);
    EXPECT_EQ(std::count_if(rays.begin(), rays.end(), [](const auto& ray) { return ray.texel(8) == 40; }), 4);
}

/// One pixel that looks at a surface from the side. @return what its probe's rays are asked to serve towards
/// the mirror direction
float worth_of_mirror(const core::Brdf& brdf, float roughness, const gather::SpecularReaders& readers) {
    gather::VisibleSurfaces visible;
    visible.resize(1, 1);
    visible.points[0].brdf = brdf;
    visible.points[0].roughness = roughness;
    visible.outgoing[0] = glm::normalize(glm::vec3(2.0f, 0.0f, 1.0f));
    visible.depth[0] = 1.0f;
    const gather::Probe probe{{0, 0}, glm::vec3(0.0f), glm::vec3(0.0f, 0.0f, 1.0f), 1.0f, 0};
    const core::Sh lobe = gather::accumulate_brdf(visible, probe, 1, 1000.0f, readers);
    return core::sh_dot(lobe, core::sh_basis(glm::normalize(glm::vec3(-2.0f, 0.0f, 1.0f))));
}

TEST(StructuredImportance, OnlySurfacesThatReadTheMirrorDirectionAskForRaysThere) {
    core::Brdf metal;
    metal.diffuse = glm::vec3(0.0f);
    metal.f0 = glm::vec3(0.9f);
    core::Brdf coated = metal;
    coated.diffuse = glm::vec3(0.6f);
    coated.f0 = glm::vec3(0.04f);
    core::Brdf lambert = coated;
    lambert.f0 = lambert.f90 = glm::vec3(0.0f);
    const gather::SpecularReaders readers{.above = 0.5f, .most = 0.8f};
    const float none = worth_of_mirror(metal, 0.7f, {});
    EXPECT_GT(worth_of_mirror(metal, 0.7f, readers), none + 0.9f);
    const float little = worth_of_mirror(coated, 0.7f, readers) - none;
    EXPECT_GT(little, 0.05f);
    EXPECT_LT(little, 0.5f);
    EXPECT_EQ(worth_of_mirror(metal, 0.5f, readers), none);  // It takes rays of its own.
    EXPECT_EQ(worth_of_mirror(metal, 0.9f, readers), none);  // It reads harmonics.
    EXPECT_EQ(worth_of_mirror(lambert, 0.7f, readers), none);
}

TEST(ProbeInterpolation, WeightsSumToOneAndLeaveOutOtherPlanes) {
    gather::ProbeAtlas atlas = constant_atlas(8);
    atlas.probes[5].position.z = 0.5f;  // A foreground beside the reader.
    const gather::ProbeWeights weights =
        gather::find_probes(atlas, {{30.0f, 26.0f}, {0.15f, 0.1f, 0.0f}, {0.0f, 0.0f, 1.0f}, 2.0f}, 1e4f);
    float sum = 0.0f;
    for (std::size_t i = 0; i < weights.count; ++i) {
        sum += weights.weight[i];
        EXPECT_TRUE(weights.probe[i] != 5 || weights.weight[i] < 1e-6f);
    }
    EXPECT_NEAR(sum, 1.0f, 1e-6f);
    EXPECT_TRUE(weights.confident);
}

TEST(ProbeInterpolation, NearestPlaneStandsInWhereNoProbeFits) {
    const gather::ProbeAtlas atlas = constant_atlas(8);
    const gather::ProbeWeights weights =
        gather::find_probes(atlas, {{30.0f, 26.0f}, {0.15f, 0.1f, 1.0f}, {0.0f, 0.0f, 1.0f}, 2.0f}, 1e4f);
    EXPECT_FALSE(weights.confident);
    EXPECT_EQ(weights.count, 1u);
}

TEST(BentNormal, NothingOccludedChangesNothing) {
    std::mt19937 random(5);
    core::ShColor light{};
    for (glm::vec3& value : light) value = random_direction(random);
    light[0] = glm::vec3(5.0f);
    for (int i = 0; i < 100; ++i) {
        const glm::vec3 n = random_direction(random);
        const glm::vec3 expected = core::sh_dot(light, core::sh_clamped_cosine(n));
        EXPECT_NEAR(gather::cone_irradiance(light, {n, 1.0f}).x, expected.x, 1e-6f * std::abs(expected.x));
    }
}

TEST(BentNormal, ConstantEnvironmentGivesPiTimesTheMultiBounceOcclusion) {
    core::ShColor light{};
    light[0] = glm::vec3(1.0f / 0.282094792f);
    for (const float v : {0.0f, 0.2f, 0.5f, 0.9f, 1.0f}) {
        for (const float albedo : {0.0f, 0.2f, 0.5f}) {
            const float far = gather::cone_irradiance(light, {{0.0f, 0.0f, 1.0f}, v}).x;
            const float ao = gather::multi_bounce(v, albedo);
            EXPECT_NEAR(far + (ao - v) * core::kPi, core::kPi * ao, 1e-5f);
            EXPECT_LE(ao, 1.0f + 1e-4f);
        }
    }
}

TEST(Reflectance, DiffuseAlbedoIsTheIntegralOfTheLobe) {
    core::Brdf brdf;
    brdf.diffuse = glm::vec3(0.8f);
    brdf.alpha = 0.25f;
    for (const float cosine : {0.1f, 0.4f, 0.7f, 1.0f}) {
        const glm::vec3 outgoing(std::sqrt(1.0f - cosine * cosine), 0.0f, cosine);
        double sum = 0.0;
        constexpr int kSide = 128;
        for (int j = 0; j < kSide; ++j) {
            for (int i = 0; i < kSide; ++i) {
                const glm::vec3 incoming = core::sample_cosine_hemisphere(
                    {(static_cast<float>(i) + 0.5f) / kSide, (static_cast<float>(j) + 0.5f) / kSide});
                sum += static_cast<double>(core::evaluate(brdf, outgoing, incoming).value.diffuse.x) *
                       static_cast<double>(core::kPi);
            }
        }
        // Both are midpoint sums; the table is linear between 64 entries.
        EXPECT_NEAR(gather::diffuse_albedo(brdf, cosine).x, sum / (kSide * kSide), 2e-3);
    }
}

}  // namespace
