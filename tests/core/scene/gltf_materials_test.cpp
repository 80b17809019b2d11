#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/scene/brdf.h"
#include "tests/core/scene/gltf_builder.h"

namespace {

using tests::GltfBuilder;

core::Material load_material(GltfBuilder& builder, const std::string& material) {
    builder.add("materials", material);
    return builder.load().materials.at(0);
}

core::Material load_material(const std::string& material) {
    GltfBuilder builder;
    return load_material(builder, material);
}

TEST(GltfMaterials, DefaultsAreThoseOfTheSpecification) {
    const core::Material material = load_material("{}");
    EXPECT_EQ(material.base_color, glm::vec4(1));
    EXPECT_EQ(material.metallic, 1.0f);
    EXPECT_EQ(material.roughness, 1.0f);
    EXPECT_EQ(material.emission, glm::vec3(0));
    EXPECT_EQ(material.alpha_mode, core::AlphaMode::kOpaque);
    EXPECT_FALSE(material.double_sided);
    EXPECT_FALSE(material.unlit);
    EXPECT_EQ(material.ior, 1.5f);
    EXPECT_EQ(material.specular, 1.0f);
}

TEST(GltfMaterials, EmissionIsFactorTimesStrength) {
    const core::Material material = load_material(
        R"({"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8}}})");
    EXPECT_EQ(material.emission, glm::vec3(8, 4, 0));
}

TEST(GltfMaterials, AlphaModesAndSidesAreRead) {
    const core::Material mask =
        load_material(R"({"alphaMode":"MASK","alphaCutoff":0.25,"doubleSided":true})");
    EXPECT_EQ(mask.alpha_mode, core::AlphaMode::kMask);
    EXPECT_EQ(mask.alpha_cutoff, 0.25f);
    EXPECT_TRUE(mask.double_sided);
    EXPECT_EQ(load_material(R"({"alphaMode":"BLEND"})").alpha_mode, core::AlphaMode::kBlend);
}

TEST(GltfMaterials, ExtensionsOfTheSurfaceAreRead) {
    const core::Material material =
        load_material(R"({"extensions":{"KHR_materials_unlit":{},"KHR_materials_ior":{"ior":1.25},)"
                      R"("KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[1,2,3]}}})");
    EXPECT_TRUE(material.unlit);
    EXPECT_EQ(material.ior, 1.25f);
    EXPECT_EQ(material.specular, 0.5f);
    EXPECT_EQ(material.specular_color, glm::vec3(1, 2, 3));
}

TEST(GltfMaterials, FactorsOutOfRangeAreClampedWithAWarning) {
    GltfBuilder builder;
    builder.add("materials", R"({"pbrMetallicRoughness":{"metallicFactor":3,"roughnessFactor":-1}})");
    const core::Scene scene = builder.load();
    EXPECT_EQ(scene.materials[0].metallic, 1.0f);
    EXPECT_EQ(scene.materials[0].roughness, 0.0f);
    EXPECT_EQ(scene.warnings.size(), 2u);
}

TEST(GltfMaterials, SamplersSetWrapAndFilter) {
    GltfBuilder builder;
    const int texture =
        builder.add_texture(1, 1, {1, 2, 3, 4}, R"({"magFilter":9728,"wrapS":33071,"wrapT":33648})");
    builder.add("materials",
                fmt::format(R"({{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{}}}}}}})", texture));
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.textures.size(), 1u);
    EXPECT_TRUE(scene.textures[0].nearest);
    EXPECT_EQ(scene.textures[0].wrap_u, core::TextureWrap::kClampToEdge);
    EXPECT_EQ(scene.textures[0].wrap_v, core::TextureWrap::kMirroredRepeat);
    EXPECT_EQ(scene.images.at(0).rgba, (std::vector<std::uint8_t>{1, 2, 3, 4}));
}

TEST(GltfMaterials, TextureTransformsScaleThenRotateThenOffset) {
    GltfBuilder builder;
    builder.add_texture(1, 1, {0, 0, 0, 0});
    const core::Material material = load_material(
        builder,
        fmt::format(R"({{"emissiveTexture":{{"index":0,"texCoord":0,"extensions":{{"KHR_texture_transform":)"
                    R"({{"offset":[10,20],"rotation":{},"scale":[2,3],"texCoord":1}}}}}}}})",
                    std::numbers::pi / 2));
    const core::TextureUse& use = material.emission_texture;
    EXPECT_EQ(use.uv_set, 1) << "the extension's texCoord overrides";
    // Counter-clockwise in a picture whose v runs down: +u turns to -v, +v to +u. 1e-6: float pi / 2.
    const glm::vec2 along_u = use.uv_from_mesh_uv * glm::vec3(1, 0, 1);
    const glm::vec2 along_v = use.uv_from_mesh_uv * glm::vec3(0, 1, 1);
    EXPECT_NEAR(along_u.x, 10.0f, 1e-6f);
    EXPECT_NEAR(along_u.y, 18.0f, 1e-6f);
    EXPECT_NEAR(along_v.x, 13.0f, 1e-6f);
    EXPECT_NEAR(along_v.y, 20.0f, 1e-6f);
}

TEST(GltfMaterials, TexturesOnlyOneMaterialNeedsAreDecodedOnce) {
    GltfBuilder builder;
    const int texture = builder.add_texture(1, 1, {9, 9, 9, 9});
    builder.add_texture(1, 1, {8, 8, 8, 8});
    for (int i = 0; i < 2; ++i) {
        builder.add("materials", fmt::format(R"({{"normalTexture":{{"index":{},"scale":2}}}})", texture));
    }
    const core::Scene scene = builder.load();
    EXPECT_EQ(scene.images.size(), 1u);
    EXPECT_EQ(scene.textures.size(), 1u);
    EXPECT_EQ(scene.materials[1].normal_scale, 2.0f);
}

TEST(GltfMaterials, TextureCoordinatesThatAMeshLacksAreWarnedOf) {
    GltfBuilder builder;
    builder.add_texture(1, 1, {0, 0, 0, 0});
    builder.add("materials", R"({"name":"brick","emissiveTexture":{"index":0,"texCoord":1}})");
    const int mesh = builder.add_triangle_mesh(R"("material":0)");
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("'brick' needs TEXCOORD_1"), std::string::npos) << scene.warnings[0];
}

TEST(GltfMaterials, TextureCoordinatesPastTheSecondSetAreLeftOutWithAWarning) {
    GltfBuilder builder;
    builder.add_texture(1, 1, {0, 0, 0, 0});
    builder.add("materials", R"({"emissiveTexture":{"index":0,"texCoord":2}})");
    const core::Scene scene = builder.load();
    EXPECT_FALSE(scene.materials[0].emission_texture.present());
    EXPECT_EQ(scene.warnings.size(), 1u);
}

TEST(GltfMaterials, ReferencesOutOfRangeAreRefused) {
    for (const char* material : {R"({"normalTexture":{"index":1}})", R"({"occlusionTexture":{"index":1}})"}) {
        GltfBuilder builder;
        builder.add_texture(1, 1, {0, 0, 0, 0});
        builder.add("materials", material);
        EXPECT_NE(builder.error().find("is 1, but the file has 1 textures (kind 65"), std::string::npos)
            << builder.error();
    }
    GltfBuilder builder;
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", builder.add_triangle_mesh(R"("material":0)")));
    EXPECT_NE(builder.error().find("is 0, but the file has 0 materials"), std::string::npos);
}

TEST(GltfMaterials, BrokenImagesAreRefusedByName) {
    GltfBuilder builder;
    const int view = builder.add_view(std::vector<std::uint8_t>{1, 2, 3, 4});
    builder.add("images", fmt::format(R"({{"name":"noise","bufferView":{},"mimeType":"image/png"}})", view));
    builder.add("textures", R"({"source":0})");
    builder.add("materials", R"({"normalTexture":{"index":0}})");
    EXPECT_NE(builder.error().find("images[0] 'noise'"), std::string::npos) << builder.error();
    EXPECT_NE(builder.error().find("neither PNG nor JPEG"), std::string::npos) << builder.error();
}

TEST(GltfMaterials, OptionalExtensionsAreWarnedOfOnceWithWhatIsLost) {
    GltfBuilder builder;
    builder.set("extensionsUsed", R"(["KHR_materials_clearcoat","VENDOR_unheard","KHR_materials_ior"])");
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.warnings.size(), 2u);
    EXPECT_NE(scene.warnings[0].find("clear coats are missing"), std::string::npos);
    EXPECT_NE(scene.warnings[1].find("VENDOR_unheard"), std::string::npos);
    EXPECT_EQ(scene.extensions_used.size(), 3u);
}

TEST(GltfMaterials, ApproximatedExtensionsLoadEvenIfRequired) {
    for (const char* name :
         {"KHR_materials_anisotropy", "KHR_materials_clearcoat", "KHR_materials_diffuse_transmission",
          "KHR_materials_dispersion", "KHR_materials_iridescence", "KHR_materials_sheen",
          "KHR_materials_transmission", "KHR_materials_variants", "KHR_materials_volume"}) {
        GltfBuilder builder;
        builder.set("extensionsRequired", fmt::format(R"(["{}"])", name));
        builder.set("extensionsUsed", fmt::format(R"(["{}"])", name));
        const core::Scene scene = builder.load();
        ASSERT_EQ(scene.warnings.size(), 1u) << name;
        EXPECT_EQ(scene.warnings[0].find(fmt::format("{} is ignored: ", name)), 0u) << scene.warnings[0];
    }
}

TEST(GltfMaterials, RequiredImageFormatsThatAreNotDecodedAreRefused) {
    for (const char* name : {"KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif"}) {
        GltfBuilder builder;
        builder.set("extensionsRequired", fmt::format(R"(["{}"])", name));
        EXPECT_NE(builder.error().find(name), std::string::npos) << builder.error();
    }
}

TEST(GltfMaterials, VariantsShowTheDefault) {
    GltfBuilder builder;
    builder.set("extensionsUsed", R"(["KHR_materials_variants"])");
    builder.set("extensions", R"({"KHR_materials_variants":{"variants":[{"name":"night"}]}})");
    builder.add("materials", R"({"name":"day"})");
    builder.add("materials", R"({"name":"night"})");
    const int mesh = builder.add_triangle_mesh(
        R"("material":0,"extensions":{"KHR_materials_variants":{"mappings":[{"material":1,"variants":[0]}]}})");
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    EXPECT_EQ(builder.load().material_of(0, 0).name, "day");
}

/// The BRDF inputs that the archived extension defines from specular-glossiness values.
void expect_specular_glossiness(const core::Scene& scene, const glm::vec3& diffuse, const glm::vec3& specular,
                                float glossiness, float tolerance) {
    const core::MaterialSample sample = core::sample_material(scene, scene.materials.at(0), {});
    const core::Brdf brdf = core::make_brdf(sample);
    const float roughness = 1.0f - glossiness;
    EXPECT_NEAR(brdf.alpha, std::max(roughness * roughness, core::kMinimumAlpha), 2.0f * tolerance);
    const core::BrdfValue value = core::evaluate(brdf, glm::vec3(0, 0, 1), glm::vec3(0, 0, 1)).value;
    const float largest = std::max({specular.x, specular.y, specular.z});
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(brdf.f0[i], specular[i], tolerance);
        EXPECT_EQ(brdf.f90[i], 1.0f);
        // Straight on, the share that the coat leaves to the diffuse layer is 1 - max(specular).
        EXPECT_NEAR(value.diffuse[i] * std::numbers::pi_v<float>, diffuse[i] * (1.0f - largest), tolerance);
    }
}

TEST(GltfMaterials, SpecularGlossinessFactorsGiveTheBrdfOfTheirExtension) {
    GltfBuilder builder;
    builder.set("extensionsRequired", R"(["KHR_materials_pbrSpecularGlossiness"])");
    builder.add("materials",
                R"({"pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1],"roughnessFactor":0.1},"extensions":)"
                R"({"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.25,0.5,0.75,0.5],)"
                R"("specularFactor":[0.5,0.25,0.125],"glossinessFactor":0.75}}})");
    const core::Scene scene = builder.load();
    EXPECT_TRUE(scene.warnings.empty()) << "nothing is lost";
    EXPECT_EQ(scene.materials[0].base_color.a, 0.5f);
    EXPECT_EQ(scene.materials[0].metallic, 0.0f);
    expect_specular_glossiness(scene, {0.25f, 0.5f, 0.75f}, {0.5f, 0.25f, 0.125f}, 0.75f, 1e-6f);
}

TEST(GltfMaterials, SpecularGlossinessDefaultsAreWhiteAndSmooth) {
    GltfBuilder builder;
    builder.add("materials", R"({"extensions":{"KHR_materials_pbrSpecularGlossiness":{}}})");
    expect_specular_glossiness(builder.load(), glm::vec3(1), glm::vec3(1), 1.0f, 1e-6f);
}

float linear_from_srgb(int code) {
    return static_cast<float>(std::pow((code / 255.0 + 0.055) / 1.055, 2.4));
}

TEST(GltfMaterials, SpecularGlossinessTexturesGiveTheBrdfOfTheirExtension) {
    GltfBuilder builder;
    const int diffuse = builder.add_texture(1, 1, {200, 100, 50, 255});
    const int specular = builder.add_texture(1, 1, {180, 90, 60, 153});
    builder.add("materials",
                fmt::format(R"({{"extensions":{{"KHR_materials_pbrSpecularGlossiness":{{)"
                            R"("diffuseTexture":{{"index":{}}},"specularGlossinessTexture":{{"index":{}}},)"
                            R"("specularFactor":[1,0.5,0.25],"glossinessFactor":0.5}}}}}})",
                            diffuse, specular));
    const core::Scene scene = builder.load();
    const glm::vec3 expected_diffuse(linear_from_srgb(200), linear_from_srgb(100), linear_from_srgb(50));
    const glm::vec3 expected_specular(linear_from_srgb(180), 0.5f * linear_from_srgb(90),
                                      0.25f * linear_from_srgb(60));
    // Roughness is stored in 8 bits: half a step.
    expect_specular_glossiness(scene, expected_diffuse, expected_specular, 0.5f * 153.0f / 255.0f,
                               0.5f / 255.0f);
    EXPECT_EQ(scene.images.size(), 3u) << "two of the file, and the roughness made from one";
}

TEST(GltfMaterials, SpecularGlossinessTexturesAreConvertedOnceForEachGlossiness) {
    GltfBuilder builder;
    const int texture = builder.add_texture(2, 1, {1, 2, 3, 0, 4, 5, 6, 255}, R"({"wrapS":33071})");
    for (const char* glossiness : {"1", "1", "0.5", "0"}) {
        builder.add("materials",
                    fmt::format(R"({{"extensions":{{"KHR_materials_pbrSpecularGlossiness":{{)"
                                R"("specularGlossinessTexture":{{"index":{}}},"glossinessFactor":{}}}}}}})",
                                texture, glossiness));
    }
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.images.size(), 3u);
    EXPECT_EQ(scene.images[1].rgba, (std::vector<std::uint8_t>{0, 255, 0, 255, 0, 0, 0, 255}));
    EXPECT_EQ(scene.images[2].rgba, (std::vector<std::uint8_t>{0, 255, 0, 255, 0, 128, 0, 255}));
    const auto& use = scene.materials[0].metallic_roughness_texture;
    EXPECT_EQ(scene.materials[1].metallic_roughness_texture.texture, use.texture);
    EXPECT_EQ(scene.textures[static_cast<std::size_t>(use.texture)].wrap_u, core::TextureWrap::kClampToEdge);
    EXPECT_FALSE(scene.materials[3].metallic_roughness_texture.present());
    EXPECT_EQ(scene.materials[3].roughness, 1.0f);
}

TEST(GltfMaterials, UnlitMaterialsKeepTheirCoreColour) {
    const core::Material material =
        load_material(R"({"pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0,1]},"extensions":{)"
                      R"("KHR_materials_unlit":{},"KHR_materials_pbrSpecularGlossiness":{}}})");
    EXPECT_EQ(material.base_color, glm::vec4(1, 0.5f, 0, 1));
}

TEST(GltfMaterials, RequiredExtensionsThatAreUnknownAreRefusedByName) {
    GltfBuilder builder;
    builder.set("extensionsRequired", R"(["KHR_texture_transform","VENDOR_unheard"])");
    EXPECT_NE(builder.error().find("VENDOR_unheard"), std::string::npos) << builder.error();
}

}  // namespace
