#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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

TEST(GltfMaterials, RequiredExtensionsThatAreUnknownAreRefusedByName) {
    GltfBuilder builder;
    builder.set("extensionsRequired", R"(["KHR_texture_transform","VENDOR_unheard"])");
    EXPECT_NE(builder.error().find("VENDOR_unheard"), std::string::npos) << builder.error();
}

}  // namespace
