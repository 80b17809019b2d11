#include "core/scene/gltf_meshopt.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/scene/gltf_json.h"
#include "core/support/error.h"
#include "tests/core/scene/gltf_builder.h"

namespace {

using tests::GltfBuilder;
using Bytes = std::vector<std::uint8_t>;

template <typename T>
Bytes encode_attributes(const std::vector<T>& values, std::size_t stride) {
    const std::size_t count = values.size() * sizeof(T) / stride;
    Bytes bytes(meshopt_encodeVertexBufferBound(count, stride));
    bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), values.data(), count, stride));
    return bytes;
}

Bytes encode_triangles(const std::vector<unsigned>& indices) {
    Bytes bytes(meshopt_encodeIndexBufferBound(indices.size(), 1000));
    bytes.resize(meshopt_encodeIndexBuffer(bytes.data(), bytes.size(), indices.data(), indices.size()));
    return bytes;
}

Bytes encode_sequence(const std::vector<unsigned>& indices) {
    Bytes bytes(meshopt_encodeIndexSequenceBound(indices.size(), 1000));
    bytes.resize(meshopt_encodeIndexSequence(bytes.data(), bytes.size(), indices.data(), indices.size()));
    return bytes;
}

/// Positions on a wavy sheet of 9 x 7 vertices: no count that a codec or filter prefers.
constexpr unsigned kColumns = 9;
constexpr unsigned kRows = 7;
std::vector<float> sheet_positions() {
    std::vector<float> positions;
    for (unsigned y = 0; y < kRows; ++y) {
        for (unsigned x = 0; x < kColumns; ++x) {
            const auto u = static_cast<float>(x);
            const auto v = static_cast<float>(y);
            positions.insert(positions.end(), {u, v, std::sin(0.7f * u + 0.3f * v)});
        }
    }
    return positions;
}

std::vector<unsigned> sheet_triangles() {
    std::vector<unsigned> indices;
    for (unsigned y = 0; y + 1 < kRows; ++y) {
        for (unsigned x = 0; x + 1 < kColumns; ++x) {
            const unsigned corner = y * kColumns + x;
            indices.insert(indices.end(), {corner, corner + 1, corner + kColumns, corner + kColumns,
                                           corner + 1, corner + kColumns + 1});
        }
    }
    return indices;
}

/// A file whose buffer 1 is a placeholder for what the views decode to.
class CompressedFile {
public:
    explicit CompressedFile(const std::string& placeholder_members =
                                R"(,"extensions":{"EXT_meshopt_compression":{"fallback":true}})") {
        builder.set("extensionsRequired", R"(["EXT_meshopt_compression"])");
        builder.add("buffers", fmt::format(R"({{"byteLength":1000000{}}})", placeholder_members));
    }

    /// @param view_members of the view itself, such as its own stride.
    int add_view(const Bytes& data, std::size_t count, std::size_t stride, const std::string& mode,
                 const std::string& filter = "NONE", const std::string& view_members = "") {
        const int source = builder.add_view(data);
        // The builder aligns, so the bytes of the view just added end the buffer.
        const std::size_t offset = builder.bytes().size() - data.size();
        EXPECT_EQ(source + 1,
                  builder.add("bufferViews", fmt::format(R"({{"buffer":1,"byteLength":{}{},"extensions":{{)"
                                                         R"("EXT_meshopt_compression":{{"buffer":0,)"
                                                         R"("byteOffset":{},"byteLength":{},"byteStride":{},)"
                                                         R"("count":{},"mode":"{}","filter":"{}"}}}}}})",
                                                         count * stride, view_members, offset, data.size(),
                                                         stride, count, mode, filter)));
        return source + 1;
    }

    int add_positions(const std::vector<float>& positions) {
        const std::size_t count = positions.size() / 3;
        const int view = add_view(encode_attributes(positions, 12), count, 12, "ATTRIBUTES", "NONE",
                                  R"(,"byteStride":12)");
        return builder.add_accessor(view, GltfBuilder::kFloat, count, "VEC3");
    }

    void add_node(const std::string& primitive) {
        builder.add("nodes", fmt::format(R"({{"mesh":{}}})", builder.add_mesh(primitive)));
    }

    GltfBuilder builder;
};

/// The sheet with compressed positions and triangles.
CompressedFile compressed_sheet(const Bytes& positions, const Bytes& triangles, std::size_t index_size = 2) {
    CompressedFile file;
    constexpr std::size_t kVertexCount = kColumns * kRows;
    const std::size_t index_count = sheet_triangles().size();
    const int position_view = file.add_view(positions, kVertexCount, 12, "ATTRIBUTES");
    const int index_view = file.add_view(triangles, index_count, index_size, "TRIANGLES");
    const int position = file.builder.add_accessor(position_view, GltfBuilder::kFloat, kVertexCount, "VEC3");
    const int indices = file.builder.add_accessor(
        index_view, index_size == 2 ? GltfBuilder::kUnsignedShort : GltfBuilder::kUnsignedInt, index_count,
        "SCALAR");
    file.add_node(fmt::format(R"({{"attributes":{{"POSITION":{}}},"indices":{}}})", position, indices));
    return file;
}

/// All triangles as their corners' positions, each beginning at its least corner: the codec may turn them.
std::vector<std::array<float, 9>> sorted_triangles(const core::Mesh& mesh) {
    std::vector<std::array<float, 9>> result;
    for (const glm::uvec3& triangle : mesh.triangles) {
        std::array<std::array<float, 3>, 3> corners;
        for (int c = 0; c < 3; ++c) {
            const glm::vec3& p = mesh.positions[triangle[c]];
            corners[static_cast<std::size_t>(c)] = {p.x, p.y, p.z};
        }
        std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
        std::array<float, 9> flat{};
        for (std::size_t i = 0; i < 9; ++i) flat[i] = corners[i / 3][i % 3];
        result.push_back(flat);
    }
    std::sort(result.begin(), result.end());
    return result;
}

TEST(GltfMeshopt, AttributesAndTrianglesDecodeExactly) {
    GltfBuilder plain;
    const int position = plain.add_floats("VEC3", sheet_positions());
    const std::vector<unsigned> triangles = sheet_triangles();
    const int indices = plain.add_indices({triangles.begin(), triangles.end()});
    plain.add("nodes",
              fmt::format(R"({{"mesh":{}}})",
                          plain.add_mesh(fmt::format(R"({{"attributes":{{"POSITION":{}}},"indices":{}}})",
                                                     position, indices))));
    const auto expected = sorted_triangles(plain.load().meshes.at(0));
    ASSERT_EQ(expected.size(), triangles.size() / 3);
    for (const std::size_t index_size : {2u, 4u}) {
        const core::Scene scene = compressed_sheet(encode_attributes(sheet_positions(), 12),
                                                   encode_triangles(triangles), index_size)
                                      .builder.load();
        EXPECT_EQ(sorted_triangles(scene.meshes.at(0)), expected) << index_size;
        EXPECT_TRUE(scene.warnings.empty());
    }
}

TEST(GltfMeshopt, SequencesOfIndicesKeepTheirOrder) {
    CompressedFile file;
    const std::vector<unsigned> strip = {0, 1, 9, 10, 18, 19, 27};
    const int view = file.add_view(encode_sequence(strip), strip.size(), 4, "INDICES");
    const int indices = file.builder.add_accessor(view, GltfBuilder::kUnsignedInt, strip.size(), "SCALAR");
    const int position = file.add_positions(sheet_positions());
    const int normal = file.builder.add_floats("VEC3", std::vector<float>(sheet_positions().size(), 1.0f));
    file.add_node(fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{}}},"indices":{},"mode":5}})",
                              position, normal, indices));
    const core::Scene scene = file.builder.load();
    const core::Mesh& mesh = scene.meshes.at(0);
    ASSERT_EQ(mesh.triangles.size(), 5u);
    // Vertices keep their order, so their numbers are ranks among the used ones: 0 1 9 10 18 19 27.
    EXPECT_EQ(mesh.triangles[0], glm::uvec3(0, 1, 2));
    EXPECT_EQ(mesh.triangles[1], glm::uvec3(1, 3, 2));
    EXPECT_EQ(mesh.triangles[4], glm::uvec3(4, 5, 6));
}

/// Unit vectors spread over the sphere (a Fibonacci lattice), four floats each.
std::vector<float> unit_vectors(std::size_t count) {
    std::vector<float> result;
    for (std::size_t i = 0; i < count; ++i) {
        const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count);
        const double angle = 2.399963229728653 * static_cast<double>(i);
        const double radius = std::sqrt(1.0 - z * z);
        for (const double v : {radius * std::cos(angle), radius * std::sin(angle), z, 0.0}) {
            result.push_back(static_cast<float>(v));
        }
    }
    return result;
}

Bytes decode(const Bytes& data, core::MeshoptFilter filter, std::size_t count, std::size_t stride) {
    const nlohmann::json object = nlohmann::json::object();
    return core::decode_meshopt({core::MeshoptMode::kAttributes, filter, count, stride}, data,
                                core::JsonElement(object, "test.gltf"));
}

template <typename T>
std::vector<T> as(const Bytes& bytes) {
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

TEST(GltfMeshopt, OctahedralNormalsComeBackWithinTheirBits) {
    constexpr std::size_t kCount = 101;
    const std::vector<float> normals = unit_vectors(kCount);
    const auto worst = [&](auto component, std::size_t stride, int bits) {
        using Component = decltype(component);
        Bytes filtered(kCount * stride);
        meshopt_encodeFilterOct(filtered.data(), kCount, stride, bits, normals.data());
        const std::vector<Component> decoded = as<Component>(
            decode(encode_attributes(filtered, stride), core::MeshoptFilter::kOctahedral, kCount, stride));
        double result = 0.0;
        for (std::size_t i = 0; i < kCount; ++i) {
            for (std::size_t c = 0; c < 3; ++c) {
                const double value =
                    static_cast<double>(decoded[4 * i + c]) / std::numeric_limits<Component>::max();
                result = std::max(result, std::abs(value - static_cast<double>(normals[4 * i + c])));
            }
        }
        return result;
    };
    // A step of the octahedron is 1 / (2^(bits-1) - 1); unfolding stretches it at most by sqrt(3), and the
    // result is rounded to the component once more.
    EXPECT_LT(worst(std::int8_t{}, 4, 8), 1.5 * 1.74 / 127);
    EXPECT_LT(worst(std::int16_t{}, 8, 12), 1.74 / 2047);
    EXPECT_GT(worst(std::int16_t{}, 8, 4), 0.02) << "the measure itself sees coarse normals";
}

TEST(GltfMeshopt, QuaternionsComeBackUpToTheirSign) {
    constexpr std::size_t kCount = 75;
    std::vector<float> rotations = unit_vectors(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
        // Half of each vector's length into w.
        for (std::size_t c = 0; c < 3; ++c) rotations[4 * i + c] *= std::sqrt(0.5f);
        rotations[4 * i + 3] = (i % 2 ? 1.0f : -1.0f) * std::sqrt(0.5f);
    }
    Bytes filtered(kCount * 8);
    meshopt_encodeFilterQuat(filtered.data(), kCount, 8, 16, rotations.data());
    const auto decoded =
        as<std::int16_t>(decode(encode_attributes(filtered, 8), core::MeshoptFilter::kQuaternion, kCount, 8));
    for (std::size_t i = 0; i < kCount; ++i) {
        double dot = 0.0;
        for (std::size_t c = 0; c < 4; ++c) {
            dot += decoded[4 * i + c] / 32767.0 * static_cast<double>(rotations[4 * i + c]);
        }
        // Four components off by half a step of 1 / 32767 each, plus the encoder's.
        EXPECT_NEAR(std::abs(dot), 1.0, 4.0 / 32767) << i;
    }
}

TEST(GltfMeshopt, ExponentialFloatsComeBackWithinTheirMantissa) {
    std::vector<float> values;
    for (int i = 0; i < 67; ++i) values.push_back(std::ldexp(1.0f + 0.013f * static_cast<float>(i), i - 30));
    Bytes filtered(values.size() * 4);
    meshopt_encodeFilterExp(filtered.data(), values.size(), 4, 15, values.data());
    const auto decoded = as<float>(
        decode(encode_attributes(filtered, 4), core::MeshoptFilter::kExponential, values.size(), 4));
    // 15 bits, one of them the sign.
    for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_NEAR(decoded[i] / values[i], 1.0f, 1.0f / 8192) << i;
    }
}

TEST(GltfMeshopt, CompressedNormalsReachTheMesh) {
    CompressedFile file;
    const std::vector<float> wanted = {0, 0, 1, 0, 0, -1, 0, 0, 0.6f, 0, 0.8f, 0};
    Bytes filtered(3 * 4);
    meshopt_encodeFilterOct(filtered.data(), 3, 4, 8, wanted.data());
    const int view =
        file.add_view(encode_attributes(filtered, 4), 3, 4, "ATTRIBUTES", "OCTAHEDRAL", R"(,"byteStride":4)");
    const int normal = file.builder.add_accessor(view, GltfBuilder::kByte, 3, "VEC3", R"("normalized":true)");
    const int position = file.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    file.add_node(fmt::format(R"({{"attributes":{{"POSITION":{},"NORMAL":{}}}}})", position, normal));
    const core::Scene scene = file.builder.load();
    const core::Mesh& mesh = scene.meshes.at(0);
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::vec3 expected(wanted[4 * i], wanted[4 * i + 1], wanted[4 * i + 2]);
        // Two steps of 1 / 127.
        EXPECT_LT(glm::length(mesh.normals[i] - expected), 2.0f / 127) << i;
    }
}

TEST(GltfMeshopt, PlaceholdersNeedNotBeMarked) {
    CompressedFile file("");
    const int position = file.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    file.add_node(fmt::format(R"({{"attributes":{{"POSITION":{}}}}})", position));
    EXPECT_EQ(core::drawn_triangle_count(file.builder.load()), 1u);
}

TEST(GltfMeshopt, PlaceholdersHoldNothingForOtherViews) {
    CompressedFile file;
    file.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    const int view = file.builder.add("bufferViews", R"({"buffer":1,"byteLength":36})");
    const int position = file.builder.add_accessor(view, GltfBuilder::kFloat, 3, "VEC3");
    file.add_node(fmt::format(R"({{"attributes":{{"POSITION":{}}}}})", position));
    EXPECT_NE(file.builder.error().find("bufferViews[2]: buffers[1] is a placeholder"), std::string::npos)
        << file.builder.error();
}

TEST(GltfMeshopt, BuffersWithoutDataAreStillRefusedInOtherFiles) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    builder.add("buffers", R"({"byteLength":36})");
    const int view = builder.add("bufferViews", R"({"buffer":1,"byteLength":36})");
    const int position = builder.add_accessor(view, GltfBuilder::kFloat, 3, "VEC3");
    const int mesh = builder.add_mesh(fmt::format(R"({{"attributes":{{"POSITION":{}}}}})", position));
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    EXPECT_NE(builder.error().find("buffers[1]: has no uri"), std::string::npos) << builder.error();
}

TEST(GltfMeshopt, WhatTheExtensionForbidsIsRefusedByView) {
    struct Case {
        std::size_t count;
        std::size_t stride;
        const char* mode;
        const char* filter;
        const char* view_members;
        const char* message;
    };
    const Case cases[] = {
        {3, 12, "POINTS", "NONE", "", "mode 'POINTS' is none of"},
        {3, 12, "ATTRIBUTES", "SQUARE", "", "filter 'SQUARE' is none of"},
        {3, 6, "ATTRIBUTES", "NONE", "", "multiple of 4 from 4 to 256"},
        {3, 260, "ATTRIBUTES", "NONE", "", "multiple of 4 from 4 to 256"},
        {3, 12, "ATTRIBUTES", "OCTAHEDRAL", "", "filter OCTAHEDRAL needs 4 or 8"},
        {3, 4, "ATTRIBUTES", "QUATERNION", "", "filter QUATERNION needs 8"},
        {3, 12, "TRIANGLES", "NONE", "", "indices have 2 or 4"},
        {3, 1, "INDICES", "NONE", "", "indices have 2 or 4"},
        {4, 2, "TRIANGLES", "NONE", "", "needs a multiple of 3"},
        {3, 2, "TRIANGLES", "EXPONENTIAL", "", "only mode ATTRIBUTES may have a filter"},
        {3, 12, "ATTRIBUTES", "NONE", R"(,"byteStride":16)", "must be equal"},
        {0, 12, "ATTRIBUTES", "NONE", "", "count must be at least 1"},
    };
    for (const Case& bad : cases) {
        CompressedFile file;
        file.add_view(encode_attributes(std::vector<float>(9, 1.0f), 12), bad.count, bad.stride, bad.mode,
                      bad.filter, bad.view_members);
        const std::string error = file.builder.error();
        EXPECT_NE(error.find(bad.message), std::string::npos) << error;
        EXPECT_NE(error.find("'test.gltf': bufferViews[1]"), std::string::npos) << error;
    }
}

TEST(GltfMeshopt, SizesThatDisagreeAreRefused) {
    const Bytes data = encode_attributes(std::vector<float>(9, 1.0f), 12);
    for (const char* length : {"35", "37", "24", "48"}) {
        GltfBuilder builder;
        builder.add_view(data);
        builder.add("bufferViews",
                    fmt::format(R"({{"buffer":0,"byteLength":{},"extensions":{{"EXT_meshopt_compression":)"
                                R"({{"buffer":0,"byteLength":{},"byteStride":12,"count":3,)"
                                R"("mode":"ATTRIBUTES"}}}}}})",
                                length, data.size()));
        EXPECT_NE(builder.error().find("3 elements of 12 bytes are not the"), std::string::npos)
            << builder.error();
    }
}

TEST(GltfMeshopt, CountsAreChargedBeforeMemoryIsTaken) {
    for (const std::uint64_t count : {std::uint64_t{100'000'000}, std::uint64_t{1} << 50}) {
        CompressedFile file;
        file.add_view(encode_attributes(std::vector<float>(9, 1.0f), 12), count, 12, "ATTRIBUTES");
        EXPECT_NE(file.builder.error().find("(kind 71"), std::string::npos) << file.builder.error();
    }
}

TEST(GltfMeshopt, EveryTruncationIsRefused) {
    const Bytes positions = encode_attributes(sheet_positions(), 12);
    const Bytes triangles = encode_triangles(sheet_triangles());
    const Bytes sequence = encode_sequence({0, 1, 2, 3, 4, 5});
    for (std::size_t size = 1; size < positions.size(); size += size < 64 ? 1 : 7) {
        const std::string error =
            compressed_sheet({positions.begin(), positions.begin() + static_cast<long>(size)}, triangles)
                .builder.error();
        EXPECT_NE(error.find("bufferViews[1].extensions.EXT_meshopt_compression: its"), std::string::npos)
            << size << error;
    }
    for (std::size_t size = 1; size < triangles.size(); ++size) {
        const std::string error =
            compressed_sheet(positions, {triangles.begin(), triangles.begin() + static_cast<long>(size)})
                .builder.error();
        EXPECT_NE(error.find("are damaged"), std::string::npos) << size << error;
    }
    for (std::size_t size = 1; size < sequence.size(); ++size) {
        CompressedFile file;
        file.add_view({sequence.begin(), sequence.begin() + static_cast<long>(size)}, 6, 2, "INDICES");
        EXPECT_NE(file.builder.error().find("are damaged"), std::string::npos) << size;
    }
}

TEST(GltfMeshopt, FlippedBitsLoadOrAreRefused) {
    const Bytes positions = encode_attributes(sheet_positions(), 12);
    const Bytes triangles = encode_triangles(sheet_triangles());
    std::size_t refused = 0;
    for (std::size_t bit = 0; bit < 8 * (positions.size() + triangles.size()); bit += 13) {
        Bytes damaged_positions = positions;
        Bytes damaged_triangles = triangles;
        const std::size_t byte = bit / 8;
        std::uint8_t& target =
            byte < positions.size() ? damaged_positions[byte] : damaged_triangles[byte - positions.size()];
        target = static_cast<std::uint8_t>(target ^ 1u << bit % 8);
        const std::string error = compressed_sheet(damaged_positions, damaged_triangles).builder.error();
        if (error != "no error") {
            ++refused;
            EXPECT_NE(error.find("'test.gltf': "), std::string::npos) << error;
        }
    }
    EXPECT_GT(refused, 10u) << "indices out of range, at the least";
}

/// The filters divide and take roots of whatever they are given.
TEST(GltfMeshopt, FiltersTakeAnyBytes) {
    for (const int fill : {0x00, 0x7f, 0x80, 0xff}) {
        const Bytes raw(8 * 33, static_cast<std::uint8_t>(fill));
        const Bytes data = encode_attributes(raw, 8);
        for (const core::MeshoptFilter filter :
             {core::MeshoptFilter::kOctahedral, core::MeshoptFilter::kQuaternion,
              core::MeshoptFilter::kExponential}) {
            EXPECT_EQ(decode(data, filter, 33, 8).size(), raw.size());
        }
        EXPECT_EQ(decode(encode_attributes(raw, 4), core::MeshoptFilter::kOctahedral, 66, 4).size(),
                  raw.size());
    }
}

}  // namespace
