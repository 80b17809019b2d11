#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/core/scene/gltf_builder.h"

namespace {

using tests::GltfBuilder;

const std::vector<float> kTriangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};
const std::vector<float> kStripOfFour = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};

/// One mesh of one primitive without normals, at one node.
core::Scene load_primitive(GltfBuilder& builder, const std::string& primitive) {
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", builder.add_mesh(primitive)));
    return builder.load();
}

std::string error_of_primitive(GltfBuilder& builder, const std::string& primitive) {
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", builder.add_mesh(primitive)));
    return builder.error();
}

std::string with_positions(int accessor, const std::string& more = "") {
    return fmt::format(R"({{"attributes":{{"POSITION":{}}}{}{}}})", accessor, more.empty() ? "" : ",", more);
}

glm::vec3 corner(const core::Mesh& mesh, std::size_t triangle, int c) {
    return mesh.positions[mesh.triangles[triangle][c]];
}

TEST(GltfGeometry, StripsKeepOneOrientation) {
    GltfBuilder builder;
    const core::Scene scene =
        load_primitive(builder, with_positions(builder.add_floats("VEC3", kStripOfFour), R"("mode":5)"));
    const core::Mesh& mesh = scene.meshes.at(0);
    ASSERT_EQ(mesh.triangles.size(), 2u);
    // Flat normals are exact on an axis-aligned plane.
    for (const glm::vec3& normal : mesh.normals) EXPECT_EQ(normal, glm::vec3(0, 0, 1));
}

TEST(GltfGeometry, FansTurnAboutTheirFirstVertex) {
    GltfBuilder builder;
    const int position = builder.add_floats("VEC3", {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    const core::Scene scene = load_primitive(builder, with_positions(position, R"("mode":6)"));
    const core::Mesh& mesh = scene.meshes.at(0);
    ASSERT_EQ(mesh.triangles.size(), 2u);
    for (std::size_t t = 0; t < 2; ++t) EXPECT_EQ(corner(mesh, t, 2), glm::vec3(0, 0, 0));
    EXPECT_EQ(mesh.normals[0], glm::vec3(0, 0, 1));
    EXPECT_EQ(corner(mesh, 1, 0), glm::vec3(1, 1, 0));
}

TEST(GltfGeometry, PointsAndLinesAreNamedAndSkipped) {
    GltfBuilder builder;
    const core::Scene scene =
        load_primitive(builder, with_positions(builder.add_floats("VEC3", kTriangle), R"("mode":1)"));
    EXPECT_EQ(core::drawn_triangle_count(scene), 0u);
    EXPECT_EQ(scene.instances.size(), 1u);
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("'mesh_0' primitive 0 has mode LINES"), std::string::npos);
}

TEST(GltfGeometry, IndicesOfEveryUnsignedTypeAreRead) {
    const auto load = [](auto values, GltfBuilder::Component type) {
        GltfBuilder builder;
        const int indices = builder.add_accessor(builder.add_view(values), type, values.size(), "SCALAR");
        const int position = builder.add_floats("VEC3", kStripOfFour);
        return load_primitive(builder, with_positions(position, fmt::format(R"("indices":{})", indices)));
    };
    const core::Scene scenes[] = {
        load(std::vector<std::uint8_t>{3, 1, 0}, GltfBuilder::kUnsignedByte),
        load(std::vector<std::uint16_t>{3, 1, 0}, GltfBuilder::kUnsignedShort),
        load(std::vector<std::uint32_t>{3, 1, 0}, GltfBuilder::kUnsignedInt),
    };
    for (const core::Scene& scene : scenes) {
        EXPECT_EQ(corner(scene.meshes[0], 0, 0), glm::vec3(1, 1, 0));
        EXPECT_EQ(corner(scene.meshes[0], 0, 2), glm::vec3(0, 0, 0));
    }
}

TEST(GltfGeometry, AnIndexOutOfRangeIsRefusedByNumber) {
    GltfBuilder builder;
    const int indices = builder.add_indices({0, 1, 3});
    const std::string error = error_of_primitive(
        builder,
        with_positions(builder.add_floats("VEC3", kTriangle), fmt::format(R"("indices":{})", indices)));
    EXPECT_NE(error.find("accessors[0]: index 2 is 3, but meshes[0].primitives[0] has 3 vertices (kind 65"),
              std::string::npos)
        << error;
}

TEST(GltfGeometry, VerticesThatNoTriangleUsesAreLeftOut) {
    GltfBuilder builder;
    std::vector<float> positions(3 * 1000, 7.0f);
    std::copy(kTriangle.begin(), kTriangle.end(), positions.begin() + 3 * 500);
    const int position = builder.add_floats("VEC3", positions);
    const int normal = builder.add_floats("VEC3", std::vector<float>(3 * 1000, 1.0f));
    const int indices = builder.add_indices({502, 500, 501});
    const core::Scene scene =
        load_primitive(builder, fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{}}},"indices":{}}})",
                                            position, normal, indices));
    EXPECT_EQ(scene.meshes[0].positions.size(), 3u);
    EXPECT_EQ(corner(scene.meshes[0], 0, 0), glm::vec3(0, 1, 0));
    EXPECT_EQ(corner(scene.meshes[0], 0, 2), glm::vec3(1, 0, 0));
}

TEST(GltfGeometry, InterleavedAttributesAreReadWithTheirStride) {
    GltfBuilder builder;
    // Position and normal of each vertex side by side.
    const int view =
        builder.add_view(std::vector<float>{0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0}, 24);
    const int position = builder.add_accessor(view, GltfBuilder::kFloat, 3, "VEC3");
    const int normal = builder.add_accessor(view, GltfBuilder::kFloat, 3, "VEC3", R"("byteOffset":12)");
    const core::Scene scene = load_primitive(
        builder, fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{}}}}})", position, normal));
    const core::Mesh& mesh = scene.meshes[0];
    EXPECT_EQ(mesh.positions[1], glm::vec3(1, 0, 0));
    EXPECT_EQ(mesh.normals[1], glm::vec3(0, 1, 0));
    EXPECT_EQ(mesh.normals[2], glm::vec3(1, 0, 0));
}

TEST(GltfGeometry, SparseValuesReplaceThoseOfTheBuffer) {
    GltfBuilder builder;
    const int base = builder.add_view(kTriangle);
    const int indices = builder.add_view(std::vector<std::uint16_t>{2});
    const int values = builder.add_view(std::vector<float>{5, 6, 7});
    const int position = builder.add_accessor(
        base, GltfBuilder::kFloat, 3, "VEC3",
        fmt::format(R"("sparse":{{"count":1,"indices":{{"bufferView":{},"componentType":5123}},)"
                    R"("values":{{"bufferView":{}}}}})",
                    indices, values));
    const core::Scene scene = load_primitive(builder, with_positions(position));
    EXPECT_EQ(corner(scene.meshes[0], 0, 1), glm::vec3(1, 0, 0));
    EXPECT_EQ(corner(scene.meshes[0], 0, 2), glm::vec3(5, 6, 7));
}

TEST(GltfGeometry, SparseAccessorsWithoutABufferStartFromZeros) {
    GltfBuilder builder;
    const int indices = builder.add_view(std::vector<std::uint8_t>{1, 2});
    const int values = builder.add_view(std::vector<float>{1, 0, 0, 0, 1, 0});
    const int position = builder.add(
        "accessors",
        fmt::format(R"({{"componentType":5126,"count":3,"type":"VEC3","sparse":{{"count":2,)"
                    R"("indices":{{"bufferView":{},"componentType":5121}},"values":{{"bufferView":{}}}}}}})",
                    indices, values));
    const core::Scene scene = load_primitive(builder, with_positions(position));
    EXPECT_EQ(corner(scene.meshes[0], 0, 0), glm::vec3(0, 0, 0));
    EXPECT_EQ(corner(scene.meshes[0], 0, 1), glm::vec3(1, 0, 0));
}

TEST(GltfGeometry, NormalisedIntegersSpanZeroToOneOrMinusOneToOne) {
    GltfBuilder builder;
    const int position = builder.add_floats("VEC3", kTriangle);
    const int uv = builder.add_accessor(builder.add_view(std::vector<std::uint8_t>{0, 255, 51, 102, 255, 0}),
                                        GltfBuilder::kUnsignedByte, 3, "VEC2", R"("normalized":true)");
    const int normal = builder.add_accessor(
        builder.add_view(std::vector<std::int8_t>{0, 0, 127, 0, -128, 0, 0, 0, 0, -127, 0, 0}, 4),
        GltfBuilder::kByte, 3, "VEC3", R"("normalized":true)");
    const core::Scene scene = load_primitive(
        builder, fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{},"TEXCOORD_0":{}}}}})", position,
                             normal, uv));
    const core::Mesh& mesh = scene.meshes[0];
    EXPECT_EQ(mesh.uvs[0][0], glm::vec2(0, 1));
    EXPECT_FLOAT_EQ(mesh.uvs[0][1].x, 0.2f);
    EXPECT_EQ(mesh.normals[0], glm::vec3(0, 0, 1));
    EXPECT_EQ(mesh.normals[1], glm::vec3(-1, 0, 0));
}

/// KHR_mesh_quantization: positions, normals, tangents and texture coordinates of 8 and 16 bits.
TEST(GltfGeometry, QuantisedPositionsStandForThemselvesOrForFractions) {
    const auto load = [](auto values, GltfBuilder::Component type, bool normalized) {
        GltfBuilder builder;
        builder.set("extensionsRequired", R"(["KHR_mesh_quantization"])");
        const int view = builder.add_view(values, static_cast<int>(4 * sizeof(values[0])));
        const int position =
            builder.add_accessor(view, type, 3, "VEC3", fmt::format(R"("normalized":{})", normalized));
        return load_primitive(builder, with_positions(position)).meshes.at(0).positions.at(1);
    };
    // The second of three vertices; every fourth component is padding.
    const std::vector<std::int8_t> bytes = {0, 0, 0, 9, 127, -127, 51, 9, 0, 1, 0, 9};
    EXPECT_EQ(load(bytes, GltfBuilder::kByte, false), glm::vec3(127, -127, 51));
    EXPECT_EQ(load(bytes, GltfBuilder::kByte, true), glm::vec3(1, -1, 51.0f / 127));
    const std::vector<std::uint8_t> unsigned_bytes = {0, 0, 0, 9, 255, 51, 3, 9, 0, 1, 0, 9};
    EXPECT_EQ(load(unsigned_bytes, GltfBuilder::kUnsignedByte, false), glm::vec3(255, 51, 3));
    EXPECT_EQ(load(unsigned_bytes, GltfBuilder::kUnsignedByte, true), glm::vec3(1, 0.2f, 3.0f / 255));
    const std::vector<std::int16_t> shorts = {0, 0, 0, 9, 32767, -32768, 300, 9, 0, 1, 0, 9};
    EXPECT_EQ(load(shorts, GltfBuilder::kShort, false), glm::vec3(32767, -32768, 300));
    EXPECT_EQ(load(shorts, GltfBuilder::kShort, true), glm::vec3(1, -1, 300.0f / 32767));
    const std::vector<std::uint16_t> unsigned_shorts = {0, 0, 0, 9, 65535, 13107, 300, 9, 0, 1, 0, 9};
    EXPECT_EQ(load(unsigned_shorts, GltfBuilder::kUnsignedShort, false), glm::vec3(65535, 13107, 300));
    EXPECT_EQ(load(unsigned_shorts, GltfBuilder::kUnsignedShort, true), glm::vec3(1, 0.2f, 300.0f / 65535));
}

TEST(GltfGeometry, QuantisedTextureCoordinatesStandForThemselvesOrForFractions) {
    const auto load = [](auto values, GltfBuilder::Component type, bool normalized) {
        GltfBuilder builder;
        const int position = builder.add_floats("VEC3", kTriangle);
        const int view = builder.add_view(values, 4);
        const int uv =
            builder.add_accessor(view, type, 3, "VEC2", fmt::format(R"("normalized":{})", normalized));
        const core::Scene scene = load_primitive(
            builder, fmt::format(R"({{"attributes":{{"POSITION":{},"TEXCOORD_0":{}}}}})", position, uv));
        return scene.meshes.at(0).uvs[0].at(1);
    };
    const std::vector<std::int16_t> shorts = {0, 0, -32767, 700, 0, 0};
    EXPECT_EQ(load(shorts, GltfBuilder::kShort, false), glm::vec2(-32767, 700));
    EXPECT_EQ(load(shorts, GltfBuilder::kShort, true), glm::vec2(-1, 700.0f / 32767));
    const std::vector<std::int8_t> bytes = {0, 0, 9, 9, -127, 64, 9, 9, 0, 0, 9, 9};
    EXPECT_EQ(load(bytes, GltfBuilder::kByte, false), glm::vec2(-127, 64));
    EXPECT_EQ(load(bytes, GltfBuilder::kByte, true), glm::vec2(-1, 64.0f / 127));
    const std::vector<std::uint8_t> unsigned_bytes = {0, 0, 9, 9, 200, 64, 9, 9, 0, 0, 9, 9};
    EXPECT_EQ(load(unsigned_bytes, GltfBuilder::kUnsignedByte, false), glm::vec2(200, 64));
    const std::vector<std::uint16_t> unsigned_shorts = {0, 0, 40000, 64, 0, 0};
    EXPECT_EQ(load(unsigned_shorts, GltfBuilder::kUnsignedShort, false), glm::vec2(40000, 64));
}

TEST(GltfGeometry, QuantisedNormalsAndTangentsAreUnitAgain) {
    GltfBuilder builder;
    const int texture = builder.add_texture(1, 1, {128, 128, 255, 255});
    builder.add("materials", fmt::format(R"({{"normalTexture":{{"index":{}}}}})", texture));
    const int position = builder.add_floats("VEC3", kTriangle);
    const int uv = builder.add_floats("VEC2", {0, 1, 1, 1, 0, 0});
    // 90 and 90 of 127 are 45 degrees, with a length of 1.002.
    const std::vector<std::int8_t> normals = {90, 0, 90, 0, 0, 0, 127, 0, 0, 0, 127, 0};
    const std::vector<std::int16_t> tangents = {23170, 0,     -23170, -32767, 32767, 0,
                                                0,     32767, 32767,  0,      0,     32767};
    const int normal = builder.add_accessor(builder.add_view(normals, 4), GltfBuilder::kByte, 3, "VEC3",
                                            R"("normalized":true)");
    const int tangent = builder.add_accessor(builder.add_view(tangents, 8), GltfBuilder::kShort, 3, "VEC4",
                                             R"("normalized":true)");
    const core::Scene scene = load_primitive(
        builder, fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{},"TANGENT":{},"TEXCOORD_0":{}}},)"
                             R"("material":0}})",
                             position, normal, tangent, uv));
    const core::Mesh& mesh = scene.meshes[0];
    const float half = std::sqrt(0.5f);
    // 1e-6: normalised in double, stored in float.
    EXPECT_LT(glm::length(mesh.normals[0] - glm::vec3(half, 0, half)), 1e-6f);
    EXPECT_LT(glm::length(glm::vec3(mesh.tangents[0]) - glm::vec3(half, 0, -half)), 1e-6f);
    EXPECT_EQ(mesh.tangents[0].w, -1.0f);
    EXPECT_EQ(mesh.tangents[1], glm::vec4(1, 0, 0, 1));
}

TEST(GltfGeometry, QuantisedMorphTargetsAreInTheUnitsOfTheirPositions) {
    GltfBuilder builder;
    const std::vector<std::uint16_t> positions = {0, 0, 0, 0, 1000, 0, 0, 0, 0, 1000, 0, 0};
    const int position =
        builder.add_accessor(builder.add_view(positions, 8), GltfBuilder::kUnsignedShort, 3, "VEC3");
    const std::vector<std::int8_t> displacements = {0, 0, -100, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    const int displacement =
        builder.add_accessor(builder.add_view(displacements, 4), GltfBuilder::kByte, 3, "VEC3");
    const int mesh = builder.add(
        "meshes",
        fmt::format(R"({{"primitives":[{}],"weights":[0.5]}})",
                    with_positions(position, fmt::format(R"("targets":[{{"POSITION":{}}}])", displacement))));
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    EXPECT_EQ(corner(builder.load().meshes[0], 0, 0), glm::vec3(0, 0, -50));
}

TEST(GltfGeometry, VertexColoursOfThreeComponentsAreOpaque) {
    GltfBuilder builder;
    const int position = builder.add_floats("VEC3", kTriangle);
    const int color = builder.add_floats("VEC3", {0.25f, 0.5f, 1, 0, 0, 0, 3, -1, 0});
    const core::Scene scene = load_primitive(
        builder, fmt::format(R"({{"attributes":{{"POSITION":{},"COLOR_0":{}}}}})", position, color));
    EXPECT_EQ(scene.meshes[0].colors[0], glm::vec4(0.25f, 0.5f, 1, 1));
    EXPECT_EQ(scene.meshes[0].colors[2], glm::vec4(1, 0, 0, 1)) << "the specification clamps colours";
}

TEST(GltfGeometry, VertexColoursMayBeNormalisedShortsWithAlpha) {
    GltfBuilder builder;
    const int position = builder.add_floats("VEC3", kTriangle);
    const std::vector<std::uint16_t> values = {65535, 0, 0, 13107, 0, 65535, 0, 0, 0, 0, 65535, 65535};
    const int color = builder.add_accessor(builder.add_view(values), GltfBuilder::kUnsignedShort, 3, "VEC4",
                                           R"("normalized":true)");
    const core::Scene scene = load_primitive(
        builder, fmt::format(R"({{"attributes":{{"POSITION":{},"COLOR_0":{}}}}})", position, color));
    EXPECT_FLOAT_EQ(scene.meshes[0].colors[0].a, 0.2f);
}

TEST(GltfGeometry, MissingNormalsAreFlatAndSplitVertices) {
    GltfBuilder builder;
    // Two triangles that share an edge at a right angle.
    const int position = builder.add_floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
    const int indices = builder.add_indices({0, 1, 2, 0, 3, 1});
    const core::Scene scene =
        load_primitive(builder, with_positions(position, fmt::format(R"("indices":{})", indices)));
    const core::Mesh& mesh = scene.meshes[0];
    ASSERT_EQ(mesh.positions.size(), 6u);
    EXPECT_EQ(mesh.normals[mesh.triangles[0].x], glm::vec3(0, 0, 1));
    EXPECT_EQ(mesh.normals[mesh.triangles[1].x], glm::vec3(0, 1, 0));
}

TEST(GltfGeometry, NormalsWithoutDirectionComeFromTheFaces) {
    GltfBuilder builder;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const int position = builder.add_floats("VEC3", kTriangle);
    const int normal = builder.add_floats("VEC3", {0, 0, 0, nan, 0, 1, 0, 0, 5});
    const core::Scene scene = load_primitive(
        builder, fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{}}}}})", position, normal));
    for (const glm::vec3& made : scene.meshes[0].normals) EXPECT_EQ(made, glm::vec3(0, 0, 1));
    ASSERT_EQ(scene.warnings.size(), 1u);
}

TEST(GltfGeometry, PositionsThatAreNotFiniteAreRefusedByMeshAndAccessor) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        GltfBuilder builder;
        const std::string error = error_of_primitive(
            builder, with_positions(builder.add_floats("VEC3", {0, 0, 0, 1, bad, 0, 0, 1, 0})));
        EXPECT_NE(error.find("meshes[0].primitives[0]: POSITION (accessor 0) of vertex 1"), std::string::npos)
            << error;
    }
}

TEST(GltfGeometry, AttributesOfUnequalLengthAreRefused) {
    GltfBuilder builder;
    const int position = builder.add_floats("VEC3", kTriangle);
    const int normal = builder.add_floats("VEC3", {0, 0, 1, 0, 0, 1});
    const std::string error = error_of_primitive(
        builder, fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{}}}}})", position, normal));
    EXPECT_NE(error.find("accessors[1]: has 2 elements"), std::string::npos) << error;
}

TEST(GltfGeometry, MeshesThatShareAccessorsAreOneWithManyInstances) {
    GltfBuilder builder;
    const int position = builder.add_floats("VEC3", kTriangle);
    builder.add("materials", R"({"name":"red"})");
    builder.add("materials", R"({"name":"green"})");
    for (int material = 0; material < 2; ++material) {
        const int mesh =
            builder.add_mesh(with_positions(position, fmt::format(R"("material":{})", material)));
        builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    }
    const core::Scene scene = builder.load();
    EXPECT_EQ(scene.meshes.size(), 1u);
    ASSERT_EQ(scene.instances.size(), 2u);
    EXPECT_EQ(scene.material_of(0, 0).name, "red");
    EXPECT_EQ(scene.material_of(1, 0).name, "green");
}

TEST(GltfGeometry, PrimitivesBecomePartsWithTheirOwnMaterials) {
    GltfBuilder builder;
    const int position = builder.add_floats("VEC3", kStripOfFour);
    builder.add("materials", R"({"name":"first"})");
    const std::string strip = with_positions(position, R"("mode":5,"material":0)");
    const int indices = builder.add_indices({0, 1, 2});
    const std::string single = with_positions(position, fmt::format(R"("indices":{})", indices));
    const int mesh =
        builder.add("meshes", fmt::format(R"({{"name":"pair","primitives":[{},{}]}})", strip, single));
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.meshes[0].parts.size(), 2u);
    EXPECT_EQ(scene.meshes[0].name, "pair");
    EXPECT_EQ(scene.meshes[0].parts[1].first_triangle, 2u);
    EXPECT_EQ(scene.material_of(0, 1).name, "first");
    EXPECT_EQ(scene.material_of(0, 2).name, "default") << "a primitive without a material has glTF's default";
}

TEST(GltfGeometry, MorphTargetsStandAtTheirDefaultWeights) {
    GltfBuilder builder;
    const int position = builder.add_floats("VEC3", kTriangle);
    const int displacement = builder.add_floats("VEC3", {0, 0, 4, 0, 0, 0, 0, 0, 0});
    const std::string primitive =
        with_positions(position, fmt::format(R"("targets":[{{"POSITION":{}}}])", displacement));
    const int mesh =
        builder.add("meshes", fmt::format(R"({{"primitives":[{}],"weights":[0.5]}})", primitive));
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    builder.add("nodes", fmt::format(R"({{"mesh":{},"weights":[0]}})", mesh));
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.meshes.size(), 2u);
    EXPECT_EQ(corner(scene.meshes[scene.instances[0].mesh], 0, 0), glm::vec3(0, 0, 2));
    EXPECT_EQ(corner(scene.meshes[scene.instances[1].mesh], 0, 0), glm::vec3(0, 0, 0));
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("morph targets stand still"), std::string::npos);
}

TEST(GltfGeometry, ANormalMapMakesTangentsAndOtherMaterialsDoNot) {
    for (const bool mapped : {true, false}) {
        GltfBuilder builder;
        const int texture = builder.add_texture(1, 1, {128, 128, 255, 255});
        builder.add("materials",
                    mapped ? fmt::format(R"({{"normalTexture":{{"index":{}}}}})", texture) : "{}");
        const int position = builder.add_floats("VEC3", kTriangle);
        const int normal = builder.add_floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
        // u grows along x, v falls along y: the picture stands upright.
        const int uv = builder.add_floats("VEC2", {0, 1, 1, 1, 0, 0});
        const core::Scene scene = load_primitive(
            builder,
            fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{},"TEXCOORD_0":{}}},"material":0}})",
                        position, normal, uv));
        const std::vector<glm::vec4>& tangents = scene.meshes[0].tangents;
        ASSERT_EQ(tangents.size(), mapped ? 3u : 0u);
        for (const glm::vec4& tangent : tangents) EXPECT_EQ(tangent, glm::vec4(1, 0, 0, 1));
    }
}

}  // namespace
