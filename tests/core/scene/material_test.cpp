#include "core/scene/material.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/scene/scene.h"

namespace {

constexpr float kRounding = 1e-6f;  ///< A few float operations on numbers near one.

/// A scene with one texture of one texel.
core::Scene one_texel(std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t a) {
    core::Scene scene;
    core::TextureImage image;
    image.width = 1;
    image.height = 1;
    image.rgba = {r, g, b, a};
    scene.images.push_back(image);
    scene.textures.push_back({});
    return scene;
}

core::TextureUse first_texture() {
    core::TextureUse use;
    use.texture = 0;
    return use;
}

TEST(Material, BaseColourIsFactorTimesTextureTimesVertexColour) {
    const core::Scene scene = one_texel(255, 0, 255, 51);
    core::Material material;
    material.base_color = {0.5f, 1.0f, 1.0f, 0.5f};
    material.base_color_texture = first_texture();
    material.alpha_mode = core::AlphaMode::kBlend;
    core::SurfaceCoordinates coordinates;
    coordinates.color = {1.0f, 1.0f, 0.25f, 0.5f};
    const core::MaterialSample sample = core::sample_material(scene, material, coordinates);
    EXPECT_EQ(sample.base_color, glm::vec3(0.5f, 0.0f, 0.25f));
    EXPECT_NEAR(sample.alpha, 0.5f * 0.2f * 0.5f, kRounding);
    EXPECT_EQ(sample.alpha, core::sample_alpha(scene, material, coordinates));
}

TEST(Material, OpaqueOnesIgnoreAlpha) {
    core::Material material;
    material.base_color.a = 0.25f;
    EXPECT_EQ(core::sample_alpha({}, material, {}), 1.0f);
    EXPECT_EQ(core::sample_material({}, material, {}).alpha, 1.0f);
}

TEST(Material, GreenIsRoughnessAndBlueIsMetallic) {
    const core::Scene scene = one_texel(255, 51, 102, 255);
    core::Material material;
    material.roughness = 0.5f;
    material.metallic_roughness_texture = first_texture();
    const core::MaterialSample sample = core::sample_material(scene, material, {});
    EXPECT_NEAR(sample.roughness, 0.1f, kRounding);
    EXPECT_NEAR(sample.metallic, 0.4f, kRounding);
}

TEST(Material, DefaultDielectricReflectsFourPercent) {
    const core::MaterialSample sample = core::sample_material({}, {}, {});
    EXPECT_NEAR(sample.dielectric_f0.g, 0.04f, kRounding);
    EXPECT_EQ(sample.dielectric_f90, 1.0f);
}

TEST(Material, SpecularFactorScalesBothEndsAndZeroIsLambert) {
    core::Material material;
    material.specular = 0.5f;
    material.specular_color = {1.0f, 0.5f, 100.0f};
    const core::MaterialSample half = core::sample_material({}, material, {});
    EXPECT_NEAR(half.dielectric_f0.r, 0.02f, kRounding);
    EXPECT_NEAR(half.dielectric_f0.g, 0.01f, kRounding);
    EXPECT_NEAR(half.dielectric_f0.b, 0.5f, kRounding) << "coloured F0 is clamped to 1 before the factor";
    EXPECT_EQ(half.dielectric_f90, 0.5f);
    material.specular = 0.0f;
    EXPECT_EQ(core::sample_material({}, material, {}).dielectric_f0, glm::vec3(0));
    EXPECT_EQ(core::sample_material({}, material, {}).dielectric_f90, 0.0f);
}

TEST(Material, IndexOfRefractionSetsTheReflectance) {
    core::Material material;
    material.ior = 2.0f;
    EXPECT_NEAR(core::sample_material({}, material, {}).dielectric_f0.r, 1.0f / 9.0f, kRounding);
    material.ior = 0.0f;
    EXPECT_EQ(core::sample_material({}, material, {}).dielectric_f0.r, 1.0f);
}

TEST(Material, UnlitOnesEmitTheirBaseColourAndReflectNothing) {
    core::Material material;
    material.base_color = {0.25f, 0.5f, 1.0f, 1.0f};
    material.emission = glm::vec3(7.0f);
    material.unlit = true;
    const core::MaterialSample sample = core::sample_material({}, material, {});
    EXPECT_EQ(sample.emission, glm::vec3(0.25f, 0.5f, 1.0f));
    EXPECT_EQ(sample.base_color, glm::vec3(0));
    EXPECT_EQ(sample.dielectric_f0, glm::vec3(0));
    EXPECT_EQ(sample.dielectric_f90, 0.0f);
    EXPECT_EQ(core::sample_emission({}, material, {}), sample.emission);
    EXPECT_TRUE(material.emissive());
}

TEST(Material, EmissionGoesThroughTheSrgbCurve) {
    const core::Scene scene = one_texel(128, 255, 0, 255);
    core::Material material;
    material.emission = glm::vec3(10.0f);
    material.emission_texture = first_texture();
    const glm::vec3 emission = core::sample_emission(scene, material, {});
    EXPECT_NEAR(emission.r, 10.0 * std::pow((128.0 / 255.0 + 0.055) / 1.055, 2.4), 10 * kRounding);
    EXPECT_EQ(emission.g, 10.0f);
    EXPECT_EQ(emission.b, 0.0f);
    EXPECT_EQ(core::sample_material(scene, material, {}).emission, emission);
}

TEST(Material, OnlyThoseThatSendLightAreEmissive) {
    core::Material material;
    EXPECT_FALSE(material.emissive());
    material.emission.b = 1e-3f;
    EXPECT_TRUE(material.emissive());
}

TEST(Material, TexturesAreReadThroughTheirOwnCoordinates) {
    core::Scene scene = one_texel(0, 0, 0, 255);
    scene.images[0].width = 2;
    scene.images[0].rgba = {0, 0, 0, 255, 255, 255, 255, 255};
    scene.textures[0].nearest = true;
    core::Material material;
    material.base_color_texture = first_texture();
    material.base_color_texture.uv_set = 1;
    material.base_color_texture.uv_from_mesh_uv[2] = {0.5f, 0.0f};
    core::SurfaceCoordinates coordinates;
    coordinates.uv[1] = {0.25f, 0.5f};
    EXPECT_EQ(core::sample_material(scene, material, coordinates).base_color, glm::vec3(1));
    coordinates.uv[1] = {0.75f, 0.5f};
    EXPECT_EQ(core::sample_material(scene, material, coordinates).base_color, glm::vec3(0));
}

TEST(Material, NormalMapsAreScaledAndUnit) {
    const core::Scene scene = one_texel(255, 128, 255, 255);
    core::Material material;
    EXPECT_EQ(core::sample_tangent_normal(scene, material, {}), glm::vec3(0, 0, 1));
    material.normal_texture = first_texture();
    glm::vec3 normal = core::sample_tangent_normal(scene, material, {});
    // 128 is the code nearest the middle: 1 / 255 off.
    EXPECT_NEAR(normal.x, std::sqrt(0.5f), 1e-5f);
    EXPECT_NEAR(normal.y, 0.0f, 1.0f / 255.0f);
    EXPECT_NEAR(glm::length(normal), 1.0f, kRounding);
    material.normal_scale = 0.0f;
    EXPECT_EQ(core::sample_tangent_normal(scene, material, {}), glm::vec3(0, 0, 1));
}

TEST(Material, NoInputMakesANumberThatIsNotFinite) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    const core::Scene scene = one_texel(128, 128, 128, 128);
    for (const float bad : {nan, infinity, -infinity, -1.0f}) {
        core::Material material;
        material.base_color = glm::vec4(bad);
        material.emission = glm::vec3(bad);
        material.metallic = bad;
        material.roughness = bad;
        material.ior = bad;
        material.specular = bad;
        material.specular_color = glm::vec3(bad);
        material.normal_scale = bad;
        material.normal_texture = first_texture();
        material.base_color_texture = first_texture();
        material.alpha_mode = core::AlphaMode::kBlend;
        core::SurfaceCoordinates coordinates;
        coordinates.uv[0] = glm::vec2(bad);
        coordinates.color = glm::vec4(bad);
        const core::MaterialSample sample = core::sample_material(scene, material, coordinates);
        const glm::vec3 normal = core::sample_tangent_normal(scene, material, coordinates);
        for (int i = 0; i < 3; ++i) {
            EXPECT_TRUE(std::isfinite(sample.base_color[i]) && sample.base_color[i] >= 0.0f) << bad;
            EXPECT_TRUE(std::isfinite(sample.emission[i]) && sample.emission[i] >= 0.0f) << bad;
            EXPECT_TRUE(sample.dielectric_f0[i] >= 0.0f && sample.dielectric_f0[i] <= 1.0f) << bad;
        }
        EXPECT_TRUE(sample.alpha >= 0.0f && sample.alpha <= 1.0f) << bad;
        EXPECT_TRUE(sample.metallic >= 0.0f && sample.metallic <= 1.0f) << bad;
        EXPECT_TRUE(sample.roughness >= 0.0f && sample.roughness <= 1.0f) << bad;
        EXPECT_TRUE(sample.dielectric_f90 >= 0.0f && sample.dielectric_f90 <= 1.0f) << bad;
        EXPECT_NEAR(glm::length(normal), 1.0f, kRounding) << bad;
    }
}

}  // namespace
