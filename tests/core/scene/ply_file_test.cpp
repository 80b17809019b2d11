#include "core/scene/ply_file.h"

#include <gtest/gtest.h>

#include "core/image/tonemap.h"
#include "tests/core/scene/mesh_text.h"

namespace {

core::Scene read(const std::string& text) {
    return core::read_ply(tests::bytes_of(text), "scan.ply");
}

std::string error(const std::string& text) {
    return tests::input_error_of([&] { read(text); });
}

std::string replaced(std::string text, const std::string& old, const std::string& with) {
    text.replace(text.find(old), old.size(), with);
    return text;
}

/// One triangle, whose vertices have more columns than x y z.
std::string triangle(const std::string& properties, const std::string& values) {
    return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" +
           properties + "element face 1\nproperty list uchar uint vertex_index\nend_header\n0 0 0 " + values +
           "\n1 0 0 " + values + "\n0 1 0 " + values + "\n3 0 1 2\n";
}

const std::string kXyz = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";

TEST(PlyFile, TextAndBothByteOrdersHoldTheSameCube) {
    const core::Scene text = read(tests::cube_ply_text());
    EXPECT_EQ(text.meshes.at(0).name, "scan");
    EXPECT_EQ(tests::triangles_of(text).size(), 12u);
    EXPECT_EQ(core::scene_hash(text), core::scene_hash(read(tests::cube_ply_binary(false))));
    EXPECT_EQ(core::scene_hash(text), core::scene_hash(read(tests::cube_ply_binary(true))));
    EXPECT_TRUE(tests::is_consistent(text));
    EXPECT_TRUE(text.warnings.empty());
    std::string windows;
    for (const char c : tests::cube_ply_text()) windows += c == '\n' ? "\r\n" : std::string(1, c);
    EXPECT_EQ(core::scene_hash(read(windows)), core::scene_hash(text));
}

TEST(PlyFile, EveryTypeOfNumberIsRead) {
    for (const char* type : {"char", "int8", "uchar", "uint8", "short", "int16", "ushort", "uint16", "int",
                             "int32", "uint", "uint32", "float", "float32", "double", "float64"}) {
        const std::string cube = replaced(tests::cube_ply_text(), "float y", std::string(type) + " y");
        EXPECT_EQ(tests::triangles_of(read(cube)), tests::triangles_of(read(tests::cube_ply_text()))) << type;
        const bool integer = std::string(type).find("int") != std::string::npos ||
                             std::string(type).find("char") != std::string::npos ||
                             std::string(type).find("short") != std::string::npos;
        const std::string list = replaced(tests::cube_ply_text(), "uchar int", "uchar " + std::string(type));
        EXPECT_EQ(error(list) == "no error", integer) << type << ": " << error(list);
    }
    // The bytes of each type, in both orders: -2 where it has a sign, else 2, as x of the third vertex.
    for (const bool big : {false, true}) {
        const std::string head = std::string("ply\nformat ") +
                                 (big ? "binary_big_endian" : "binary_little_endian") +
                                 " 1.0\nelement vertex 3\nproperty ";
        const std::string tail =
            " x\nproperty char y\nproperty char z\nelement face 1\nproperty list char char vertex_indices\n"
            "end_header\n";
        const std::pair<const char*, std::string> types[] = {
            {"char", "\xfe"},
            {"uchar", "\x02"},
            {"short", "\xff\xfe"},
            {"ushort", std::string("\0\x02", 2)},
            {"int", "\xff\xff\xff\xfe"},
            {"uint", std::string("\0\0\0\x02", 4)},
            {"float", std::string("\xc0\0\0\0", 4)},
            {"double", std::string("\xc0\0\0\0\0\0\0\0", 8)}};
        for (auto [type, value] : types) {
            const float expected = type[0] == 'u' ? 2.0f : -2.0f;
            const std::string zero(value.size(), '\0');
            if (!big) std::reverse(value.begin(), value.end());
            const core::Scene scene =
                read(head + type + tail + zero + std::string("\0\0", 2) + zero + std::string("\x01\0", 2) +
                     value + std::string("\0\x01", 2) + std::string("\x03\0\x01\x02", 4));
            EXPECT_EQ(scene.meshes.at(0).positions.at(2), glm::vec3(expected, 0, 1)) << type << big;
        }
    }
}

TEST(PlyFile, IntegerColoursAreDecodedAndFloatingOnesAreLinear) {
    const core::Scene bytes =
        read(triangle("property uchar red\nproperty uchar green\nproperty uchar blue\n", "255 128 0"));
    const glm::vec4 color = bytes.meshes.at(0).colors.at(1);
    EXPECT_EQ(color, glm::vec4(1.0f, core::linear_from_srgb(128 / 255.0), 0.0f, 1.0f));
    // The figure of IEC 61966-2-1 for code 128.
    EXPECT_NEAR(color.g, 0.2158605f, 1e-6f);
    EXPECT_EQ(bytes.materials.at(0).base_color, glm::vec4(1.0f)) << "the vertices bring the colour";
    EXPECT_EQ(bytes.materials.at(0).specular, 0.0f);
    EXPECT_EQ(bytes.materials.at(0).alpha_mode, core::AlphaMode::kOpaque);
    const core::Scene floats =
        read(triangle("property float red\nproperty float green\nproperty float blue\n", "1.5 0.5 -1"));
    EXPECT_EQ(floats.meshes.at(0).colors.at(0), glm::vec4(1.0f, 0.5f, 0.0f, 1.0f));
    const core::Scene words = read(
        triangle("property ushort red\nproperty ushort green\nproperty ushort blue\nproperty uchar alpha\n",
                 "65535 0 0 51"));
    EXPECT_EQ(words.meshes.at(0).colors.at(0), glm::vec4(1.0f, 0.0f, 0.0f, 0.2f));
    EXPECT_EQ(words.materials.at(0).alpha_mode, core::AlphaMode::kBlend);
    EXPECT_EQ(words.warnings.size(), 1u);
    EXPECT_EQ(read(triangle("", "")).materials.at(0).base_color, glm::vec4(0.8f, 0.8f, 0.8f, 1.0f));
}

TEST(PlyFile, NormalsAndTextureCoordinatesAreRead) {
    const core::Scene scene = read(triangle(
        "property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n",
        "0 3 4 0.25 0.75"));
    EXPECT_EQ(scene.meshes.at(0).normals.at(2), glm::vec3(0.0f, 0.6f, 0.8f));
    EXPECT_EQ(scene.meshes.at(0).uvs[0].at(2), glm::vec2(0.25f, 0.25f));
    const core::Scene flat = read(triangle("", ""));
    EXPECT_EQ(flat.meshes.at(0).normals.at(0), glm::vec3(0, 0, 1));
    const core::Scene mended =
        read(triangle("property float nx\nproperty float ny\nproperty float nz\n", "0 0 0"));
    EXPECT_EQ(mended.meshes.at(0).normals.at(0), glm::vec3(0, 0, 1));
    EXPECT_EQ(mended.warnings.size(), 1u);
}

TEST(PlyFile, OtherElementsAndPropertiesAreSkipped) {
    std::string text = triangle("property list uchar float weights\nproperty int id\n", "2 0.5 0.5 7");
    text = replaced(text, "element face 1\n",
                    "element camera 2\nproperty float view\nproperty list uchar int "
                    "seen\nelement face 1\nproperty uchar flags\n");
    text = replaced(text, "3 0 1 2\n", "1.5 3 1 2 3\n2.5 0\n9 3 0 1 2\n");
    EXPECT_EQ(tests::triangles_of(read(text)), tests::triangles_of(read(triangle("", ""))));
}

TEST(PlyFile, UnusedVerticesMayBeAnything) {
    std::string text = replaced(triangle("", ""), "vertex 3", "vertex 4");
    text = replaced(text, "0 0 0 \n", "nan inf 1e99\n0 0 0\n");
    text = replaced(text, "3 0 1 2\n", "3 1 2 3\n");
    const core::Scene scene = read(text);
    EXPECT_EQ(tests::triangles_of(scene), tests::triangles_of(read(triangle("", ""))));
    EXPECT_EQ(scene.meshes.at(0).positions.size(), 3u);
}

TEST(PlyFile, StripsAlternateAndStartAnew) {
    const std::string text =
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n10 0 1 2 3 4 -1 2 3 4 5\n";
    const core::Scene scene = read(text);
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 5u);
    for (const glm::vec3& normal : scene.meshes[0].normals) EXPECT_EQ(normal, glm::vec3(0, 0, 1));
    EXPECT_EQ(read(replaced(text, "10 0 1 2 3 4 -1 2 3 4 5", "6 0 1 1 2 3 3")).meshes.at(0).triangles.size(),
              1u)
        << "a corner twice makes no triangle";
}

TEST(PlyFile, WhatIsWrongIsNamed) {
    const std::string text = tests::cube_ply_text();
    const std::string binary = tests::cube_ply_binary(false);
    const std::pair<std::string, const char*> cases[] = {
        {"", "line 1: a PLY file begins with the line 'ply'"},
        {"plyx\n", "line 1: a PLY file begins"},
        {"ply\nformat ascii 1.0\n", "the file ends within its header"},
        {"ply\nelement vertex 0\nend_header\n", "line 3: the header ends without a line 'format'"},
        {replaced(text, "ascii", "utf8"), "line 2: 'utf8' is no format"},
        {replaced(text, "1.0", "2.0"), "line 2: version '2.0' is not read"},
        {replaced(text, "element vertex 8", "element vertex -8"),
         "line 4: an element needs a name and a count"},
        {replaced(text, "element vertex 8", "element vertex 9223372036854775808"),
         "line 4: an element needs"},
        {replaced(text, "element face 6", "element vertex 6"), "line 8: there are two elements 'vertex'"},
        {replaced(text, "float y", "float x"), "line 6: element 'vertex' has two properties 'x'"},
        {replaced(text, "float y", "half y"), "line 6: 'half' is no type"},
        {replaced(text, "list uchar", "list float"),
         "line 9: the length of a list must be of an integer type"},
        {replaced(text, "comment a cube", "property float x"),
         "line 3: a property stands before any element"},
        {replaced(text, "comment a cube", "color red"), "line 3: 'color' is none of format, comment"},
        {replaced(text, "float y", "float w"), "its rows lack x, y or z"},
        {replaced(text, "vertex_indices", "corners"), "its rows lack a list of integers 'vertex_indices'"},
        {replaced(text, "element vertex 8", "element vertex 4611686018427387904"),
         "there are 4611686018427387904 of it by the header, but the"},
        {replaced(binary, "element vertex 8", "element vertex 4000000000"), "there are 4000000000 of it"},
        {replaced(text, "element face 6", "element face 7"), "face 6: the file ends before 'vertex_indices'"},
        {replaced(text, "1 0 0\n", "1 0 zero\n"), "line 12: vertex 1: 'z' is 'zero', not a number"},
        {replaced(text, "4 0 3 2 1", "4 0 3 8 1"),
         "line 19: face 0: refers to vertex 8; there are 8, from 0"},
        {replaced(text, "4 0 3 2 1", "4 0 3 -1 1"), "face 0: refers to vertex -1"},
        {replaced(text, "4 0 3 2 1", "4 0 3 0.5 1"), "face 0: 'vertex_indices' is 0.5, but its type holds"},
        {replaced(text, "4 0 3 2 1", "400 0 3 2 1"), "face 0: 'vertex_indices' is 400, but its type holds"},
        {replaced(text, "4 0 3 2 1", "200 0 3 2 1"), "face 0: 'vertex_indices' has 200 entries, but"},
        {replaced(text, "4 0 3 2 1", "2 0 3"), "face 0: has 2 corners; a face needs 3"},
        {replaced(text, "1 0 0\n", "1 0 inf\n"), "face 0: vertex 1 is not finite"},
        {binary.substr(0, binary.size() - 1), "face 5: the file ends before or within 'vertex_indices'"},
        {"ply\nformat ascii 1.0\n" + kXyz + "end_header\n0 0 0\n1 0 0\n0 1 0\n",
         "holds 3 vertices and no faces; a surface is needed"},
        {"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\n" + kXyz +
             "end_header\n3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n",
         "stands before any vertex"},
        {"ply\nformat ascii 1.0\nelement nothing 5\nend_header\n1 2 3 4 5 6 7 8 9\n", "have no properties"},
    };
    for (const auto& [file, message] : cases) {
        EXPECT_NE(error(file).find(message), std::string::npos) << message << "\n" << error(file);
        EXPECT_NE(error(file).find("'scan.ply'"), std::string::npos) << error(file);
        EXPECT_NE(error(file).find("(kind 65)"), std::string::npos) << error(file);
    }
}

TEST(PlyFile, AByteThatBecomesATriangleIsLimited) {
    const std::size_t count = 1'000'000;
    const std::string text =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar "
        "y\nproperty "
        "uchar z\nelement face 1\nproperty list uint uchar vertex_indices\nend_header\n" +
        std::string("\0\0\0\1\0\0\0\1\0\x40\x42\x0f\0", 13) + std::string(count, '\1');
    EXPECT_NE(error(text).find("face 0: with it, the polygons take more time or memory"), std::string::npos)
        << error(text);
}

}  // namespace
