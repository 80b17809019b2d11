#include <draco/compression/expert_encode.h>
#include <draco/core/encoder_buffer.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "tests/core/scene/gltf_builder.h"

namespace {

using tests::GltfBuilder;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kColumns = 9;
constexpr std::size_t kRows = 7;
constexpr std::size_t kVertexCount = kColumns * kRows;
constexpr std::size_t kTriangleCount = 2 * (kColumns - 1) * (kRows - 1);
constexpr std::size_t kHeaderSize = 11;

/// A wavy sheet; texture coordinates tell its vertices apart.
struct Sheet {
    std::vector<float> positions;
    std::vector<float> normals;
    std::vector<float> uvs;
    std::vector<std::uint8_t> colors;  ///< Four bytes a vertex.
    std::vector<std::uint32_t> indices;
};

Sheet make_sheet() {
    Sheet sheet;
    for (std::size_t y = 0; y < kRows; ++y) {
        for (std::size_t x = 0; x < kColumns; ++x) {
            const auto u = static_cast<float>(x);
            const auto v = static_cast<float>(y);
            sheet.positions.insert(sheet.positions.end(), {u, v, std::sin(0.7f * u + 0.3f * v)});
            const float tilt = 0.1f * u - 0.05f * v;
            sheet.normals.insert(sheet.normals.end(), {std::sin(tilt), 0.0f, std::cos(tilt)});
            sheet.uvs.insert(sheet.uvs.end(), {u / kColumns, v / kRows});
            const auto shade = static_cast<std::uint8_t>(4 * (y * kColumns + x));
            sheet.colors.insert(sheet.colors.end(), {shade, 255, 0, 128});
            if (x + 1 == kColumns || y + 1 == kRows) continue;
            const auto corner = static_cast<std::uint32_t>(y * kColumns + x);
            constexpr auto kRow = static_cast<std::uint32_t>(kColumns);
            sheet.indices.insert(sheet.indices.end(), {corner, corner + 1, corner + kRow, corner + kRow,
                                                       corner + 1, corner + kRow + 1});
        }
    }
    return sheet;
}

int add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, int component_count,
                  draco::DataType data_type, bool normalized, const void* values) {
    const std::size_t stride =
        static_cast<std::size_t>(component_count) * static_cast<std::size_t>(DataTypeLength(data_type));
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, static_cast<std::uint8_t>(component_count), data_type, normalized,
                   static_cast<std::int64_t>(stride), 0);
    const int id = mesh.AddAttribute(attribute, true, mesh.num_points());
    for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
        mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i),
                                              static_cast<const std::uint8_t*>(values) + i * stride);
    }
    return id;
}

std::unique_ptr<draco::Mesh> draco_mesh(const Sheet& sheet) {
    auto mesh = std::make_unique<draco::Mesh>();
    mesh->set_num_points(kVertexCount);
    for (std::size_t i = 0; i < sheet.indices.size(); i += 3) {
        draco::Mesh::Face face;
        for (std::size_t c = 0; c < 3; ++c) face[c] = draco::PointIndex(sheet.indices[i + c]);
        mesh->AddFace(face);
    }
    using Attribute = draco::GeometryAttribute;
    add_attribute(*mesh, Attribute::POSITION, 3, draco::DT_FLOAT32, false, sheet.positions.data());
    add_attribute(*mesh, Attribute::NORMAL, 3, draco::DT_FLOAT32, false, sheet.normals.data());
    add_attribute(*mesh, Attribute::TEX_COORD, 2, draco::DT_FLOAT32, false, sheet.uvs.data());
    add_attribute(*mesh, Attribute::COLOR, 4, draco::DT_UINT8, true, sheet.colors.data());
    return mesh;
}

constexpr int kPositionBits = 14;
constexpr int kNormalBits = 10;

/// @param quantised positions and normals; texture coordinates and colours stay exact.
Bytes encode(const draco::Mesh& mesh, int method, bool quantised, bool predicted = true) {
    draco::ExpertEncoder encoder(mesh);
    encoder.SetEncodingMethod(method);
    for (int i = 0; !predicted && i < mesh.num_attributes(); ++i) {
        EXPECT_TRUE(encoder.SetAttributePredictionScheme(i, draco::PREDICTION_NONE).ok());
    }
    if (quantised) {
        encoder.SetAttributeQuantization(0, kPositionBits);
        encoder.SetAttributeQuantization(1, kNormalBits);
    }
    draco::EncoderBuffer buffer;
    EXPECT_TRUE(encoder.EncodeToBuffer(&buffer).ok());
    return {buffer.data(), buffer.data() + buffer.size()};
}

Bytes encode_sheet(int method, bool quantised = false) {
    return encode(*draco_mesh(make_sheet()), method, quantised);
}

/// What the accessors and the extension say of the sheet; tests change single things.
struct Claims {
    std::size_t vertex_count = kVertexCount;
    std::size_t index_count = 3 * kTriangleCount;
    std::string draco_attributes = R"("POSITION":0,"NORMAL":1,"TEXCOORD_0":2,"COLOR_0":3)";
    std::string primitive_members;
};

GltfBuilder file_of(const Bytes& data, const Claims& claims = {}) {
    GltfBuilder builder;
    for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
        builder.set(list, R"(["KHR_draco_mesh_compression"])");
    }
    const auto accessor = [&](GltfBuilder::Component component, const char* type, std::size_t count,
                              const char* extra = "") {
        return builder.add("accessors", fmt::format(R"({{"componentType":{},"type":"{}","count":{}{}}})",
                                                    static_cast<int>(component), type, count, extra));
    };
    const int position = accessor(GltfBuilder::kFloat, "VEC3", claims.vertex_count);
    const int normal = accessor(GltfBuilder::kFloat, "VEC3", claims.vertex_count);
    const int uv = accessor(GltfBuilder::kFloat, "VEC2", claims.vertex_count);
    const int color =
        accessor(GltfBuilder::kUnsignedByte, "VEC4", claims.vertex_count, R"(,"normalized":true)");
    const int indices = accessor(GltfBuilder::kUnsignedShort, "SCALAR", claims.index_count);
    const int view = builder.add_view(data);
    const int mesh = builder.add_mesh(fmt::format(
        R"({{"attributes":{{"POSITION":{},"NORMAL":{},"TEXCOORD_0":{},"COLOR_0":{}}},"indices":{}{},)"
        R"("extensions":{{"KHR_draco_mesh_compression":{{"bufferView":{},"attributes":{{{}}}}}}}}})",
        position, normal, uv, color, indices, claims.primitive_members, view, claims.draco_attributes));
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    return builder;
}

struct Deviation {
    double position = 0.0;
    double normal = 0.0;
};

/// Checks the triangles and exact attributes of a loaded sheet, vertices matched by texture coordinates, and
/// measures the others.
Deviation compare(const core::Mesh& mesh) {
    const Sheet sheet = make_sheet();
    std::map<std::pair<float, float>, std::uint32_t> vertex_of_uv;
    for (std::uint32_t i = 0; i < kVertexCount; ++i) {
        vertex_of_uv[{sheet.uvs[2 * i], sheet.uvs[2 * i + 1]}] = i;
    }
    Deviation deviation;
    std::vector<std::uint32_t> original;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const auto found = vertex_of_uv.find({mesh.uvs[0].at(i).x, mesh.uvs[0][i].y});
        if (found == vertex_of_uv.end()) {
            ADD_FAILURE() << "vertex " << i << " has texture coordinates of no vertex";
            return deviation;
        }
        const std::uint32_t vertex = found->second;
        original.push_back(vertex);
        for (int c = 0; c < 3; ++c) {
            const std::size_t at = 3 * vertex + static_cast<std::size_t>(c);
            deviation.position = std::max(
                deviation.position, std::abs(double{mesh.positions[i][c]} - double{sheet.positions[at]}));
            deviation.normal =
                std::max(deviation.normal, std::abs(double{mesh.normals[i][c]} - double{sheet.normals[at]}));
        }
        for (int c = 0; c < 4; ++c) {
            EXPECT_EQ(mesh.colors.at(i)[c],
                      static_cast<float>(sheet.colors[4 * vertex + static_cast<std::size_t>(c)]) / 255.0f);
        }
    }
    const auto sorted = [](std::vector<std::array<std::uint32_t, 3>> triangles) {
        for (auto& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        std::sort(triangles.begin(), triangles.end());
        return triangles;
    };
    std::vector<std::array<std::uint32_t, 3>> loaded;
    std::vector<std::array<std::uint32_t, 3>> expected;
    for (const glm::uvec3& t : mesh.triangles) {
        loaded.push_back({original[t.x], original[t.y], original[t.z]});
    }
    for (std::size_t i = 0; i < sheet.indices.size(); i += 3) {
        expected.push_back({sheet.indices[i], sheet.indices[i + 1], sheet.indices[i + 2]});
    }
    EXPECT_EQ(sorted(loaded), sorted(expected));
    return deviation;
}

TEST(GltfDraco, BothMethodsAreExactWithoutQuantisation) {
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        const core::Scene scene = file_of(encode_sheet(method)).load();
        const Deviation deviation = compare(scene.meshes.at(0));
        EXPECT_EQ(deviation.position, 0.0);
        // The loader normalises anew.
        EXPECT_LT(deviation.normal, 1e-7);
        EXPECT_TRUE(scene.warnings.empty());
    }
}

TEST(GltfDraco, QuantisedAttributesStayWithinTheirBits) {
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        const core::Scene scene = file_of(encode_sheet(method, true)).load();
        const Deviation deviation = compare(scene.meshes.at(0));
        // Half a step of the longest side, which is 8, and float rounding.
        EXPECT_LT(deviation.position, 0.5 * 8.0 / ((1 << kPositionBits) - 1) + 1e-6);
        EXPECT_GT(deviation.position, 0.0);
        // A step of the octahedron, stretched by unfolding at most by sqrt(3).
        EXPECT_LT(deviation.normal, 1.74 * 2.0 / ((1 << kNormalBits) - 1));
    }
}

TEST(GltfDraco, PlainAttributesAndMorphTargetsMayStandBesideCompressedOnes) {
    Claims claims;
    claims.draco_attributes = R"("POSITION":0,"NORMAL":1,"TEXCOORD_0":2)";
    claims.primitive_members = R"(,"targets":[{"POSITION":5}])";
    // The sequential method keeps the order of the vertices.
    GltfBuilder builder = file_of(encode_sheet(draco::MESH_SEQUENTIAL_ENCODING), claims);
    std::vector<float> lifts(3 * kVertexCount, 0.0f);
    for (std::size_t i = 0; i < kVertexCount; ++i) lifts[3 * i + 2] = 10.0f;
    ASSERT_EQ(builder.add_floats("VEC3", lifts), 5);
    builder.add("nodes", R"({"mesh":0,"weights":[1]})");
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.meshes.size(), 2u);
    EXPECT_EQ(scene.meshes[0].colors.at(0), glm::vec4(0.0f)) << "an accessor without data is zeros";
    for (std::size_t i = 0; i < kVertexCount; ++i) {
        EXPECT_EQ(scene.meshes[1].positions[i], scene.meshes[0].positions[i] + glm::vec3(0, 0, 10));
    }
}

TEST(GltfDraco, StripsAreDecodedToTriangles) {
    Claims claims;
    claims.primitive_members = R"(,"mode":5)";
    claims.index_count = kTriangleCount + 2;
    compare(file_of(encode_sheet(draco::MESH_EDGEBREAKER_ENCODING), claims).load().meshes.at(0));
}

TEST(GltfDraco, DataThatClaimMoreThanTheirAccessorsAreRefused) {
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        const Bytes data = encode_sheet(method);
        Claims few_indices;
        few_indices.index_count = 3 * (kTriangleCount - 1);
        EXPECT_NE(
            file_of(data, few_indices)
                .error()
                .find("'test.gltf': meshes[0].primitives[0]: its Draco data claim 96 triangles, but its "
                      "accessor has 285 indices"),
            std::string::npos)
            << file_of(data, few_indices).error();
    }
}

void append_varint(Bytes& bytes, std::uint32_t value) {
    for (; value >= 0x80; value >>= 7) bytes.push_back(static_cast<std::uint8_t>(value | 0x80));
    bytes.push_back(static_cast<std::uint8_t>(value));
}

/// Draco's headers, with counts that nothing follows.
Bytes header_of(int method, std::uint32_t faces, std::uint32_t vertices) {
    Bytes bytes = encode_sheet(method);
    bytes.resize(kHeaderSize);
    if (method == draco::MESH_EDGEBREAKER_ENCODING) {
        bytes.push_back(0);  // The kind of traversal.
        append_varint(bytes, vertices);
        append_varint(bytes, faces);
        bytes.push_back(255);  // Attributes with seams of their own.
        append_varint(bytes, faces);
        append_varint(bytes, 0);
    } else {
        append_varint(bytes, faces);
        append_varint(bytes, vertices);
        bytes.push_back(1);
    }
    bytes.resize(bytes.size() + 64);
    return bytes;
}

TEST(GltfDraco, HeadersThatClaimMuchAreRefusedBeforeMemoryIsTaken) {
    Claims huge;
    huge.vertex_count = std::size_t{1} << 62;
    huge.index_count = std::size_t{1} << 62;
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        const Bytes data = header_of(method, 1'000'000'000, 3);
        EXPECT_NE(file_of(data).error().find("claim 1000000000 triangles"), std::string::npos)
            << file_of(data).error();
        EXPECT_NE(file_of(data, huge).error().find("(kind 71"), std::string::npos)
            << file_of(data, huge).error();
        EXPECT_NE(file_of(header_of(method, 1, 2'000'000'000)).error().find("claim 2000000000 vertices"),
                  std::string::npos)
            << file_of(header_of(method, 1, 2'000'000'000)).error();
    }
}

TEST(GltfDraco, ManyAttributesAreRefusedBeforeMemoryIsTaken) {
    Claims claims;
    claims.vertex_count = 1998;
    claims.index_count = 1998;
    claims.draco_attributes = R"("POSITION":0)";
    draco::Mesh mesh;
    mesh.set_num_points(1998);
    for (std::uint32_t i = 0; i < 1998; i += 3) {
        mesh.AddFace({draco::PointIndex(i), draco::PointIndex(i + 1), draco::PointIndex(i + 2)});
    }
    const std::vector<float> positions(std::size_t{3} * 1998, 0.0f);
    add_attribute(mesh, draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32, false, positions.data());
    // Constant bytes take almost nothing compressed, but nine bytes each while they are decoded.
    const Bytes zeros(std::size_t{127} * 1998, 0);
    for (int i = 0; i < 150; ++i) {
        add_attribute(mesh, draco::GeometryAttribute::GENERIC, 127, draco::DT_UINT8, false, zeros.data());
    }
    const Bytes data = encode(mesh, draco::MESH_SEQUENTIAL_ENCODING, false, false);
    EXPECT_LT(data.size(), 50'000u);
    const std::string error = file_of(data, claims).error();
    EXPECT_NE(error.find("(kind 71"), std::string::npos) << error;
}

TEST(GltfDraco, OtherVersionsAndKindsAreRefused) {
    const Bytes data = encode_sheet(draco::MESH_EDGEBREAKER_ENCODING);
    const auto changed = [&](std::size_t at, std::uint8_t value) {
        Bytes bytes = data;
        bytes.at(at) = value;
        return file_of(bytes).error();
    };
    EXPECT_NE(changed(0, 'X').find("do not begin with Draco's header"), std::string::npos);
    EXPECT_NE(changed(5, 1).find("have version 1.2; 2.2 is read"), std::string::npos) << changed(5, 1);
    EXPECT_NE(changed(6, 1).find("have version 2.1; 2.2 is read"), std::string::npos);
    EXPECT_NE(changed(7, 0).find("hold no triangle mesh"), std::string::npos);
    EXPECT_NE(changed(8, 7).find("use method 7"), std::string::npos);
}

TEST(GltfDraco, AttributesThatAreNotThereAreNamed) {
    const Bytes data = encode_sheet(draco::MESH_EDGEBREAKER_ENCODING);
    Claims claims;
    claims.draco_attributes = R"("POSITION":0,"NORMAL":77)";
    EXPECT_NE(file_of(data, claims).error().find("have no attribute 77 for NORMAL"), std::string::npos);
    claims.draco_attributes = R"("POSITION":0,"NORMAL":2)";
    EXPECT_NE(file_of(data, claims).error().find("NORMAL has 2 components in its Draco data and 3 in"),
              std::string::npos);
    claims.draco_attributes = R"("POSITION":0,"COLOR_0":18446744073709551615)";
    EXPECT_NE(file_of(data, claims).error().find("have no attribute 18446744073709551615"),
              std::string::npos);
}

TEST(GltfDraco, OtherModesAreRefused) {
    Claims claims;
    claims.primitive_members = R"(,"mode":6)";
    EXPECT_NE(file_of(encode_sheet(draco::MESH_EDGEBREAKER_ENCODING), claims)
                  .error()
                  .find("need mode TRIANGLES or TRIANGLE_STRIP"),
              std::string::npos);
}

TEST(GltfDraco, EveryTruncationIsRefused) {
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        const Bytes data = encode_sheet(method, true);
        for (std::size_t size = 1; size < data.size(); size += size < 100 ? 1 : 7) {
            const std::string error = file_of({data.begin(), data.begin() + static_cast<long>(size)}).error();
            EXPECT_NE(error.find("'test.gltf': meshes[0].primitives[0]: its Draco data"), std::string::npos)
                << size << " of " << data.size() << ": " << error;
        }
    }
}

TEST(GltfDraco, FlippedBitsLoadOrAreRefused) {
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
        for (const bool quantised : {true, false}) {
            const Bytes data = encode_sheet(method, quantised);
            std::size_t refused = 0;
            for (std::size_t bit = 0; bit < 8 * data.size(); bit += 37) {
                Bytes damaged = data;
                damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ 1u << bit % 8);
                const std::string error = file_of(damaged).error();
                if (error == "no error") continue;
                ++refused;
                EXPECT_NE(error.find("'test.gltf': "), std::string::npos) << error;
            }
            EXPECT_GT(refused, 10u);
        }
    }
}

}  // namespace
