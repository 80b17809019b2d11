#include "core/scene/stl_file.h"

#include <gtest/gtest.h>

#include "tests/core/scene/mesh_text.h"

namespace {

core::Scene read(const std::string& text) {
    return core::read_stl(tests::bytes_of(text), "part.stl");
}

std::string error(const std::string& text) {
    return tests::input_error_of([&] { read(text); });
}

std::string replaced(std::string text, const std::string& old, const std::string& with) {
    text.replace(text.find(old), old.size(), with);
    return text;
}

TEST(StlFile, TextAndBinaryHoldTheSameCube) {
    const core::Scene text = read(tests::cube_stl_text());
    const core::Scene binary = read(tests::cube_stl_binary());
    EXPECT_EQ(text.meshes.at(0).name, "cube");
    EXPECT_EQ(binary.meshes.at(0).name, "part") << "a binary file has no name but its own";
    EXPECT_EQ(tests::triangles_of(text).size(), 12u);
    EXPECT_EQ(tests::triangles_of(text), tests::triangles_of(binary));
    EXPECT_TRUE(tests::is_consistent(text));
    EXPECT_TRUE(text.warnings.empty());
}

TEST(StlFile, ABinaryFileMayBeginWithSolid) {
    for (const char* header : {"solid", "solid cube made by a program", "solid\nfacet normal 0 0 1\n"}) {
        EXPECT_EQ(tests::triangles_of(read(tests::cube_stl_binary(header))).size(), 12u) << header;
    }
    EXPECT_NE(error(tests::cube_stl_binary("solid cube").substr(0, 600)).find("cut short"),
              std::string::npos);
}

TEST(StlFile, NormalsFollowFromTheOrderOfTheCorners) {
    const core::Scene scene = read(replaced(tests::cube_stl_text(), "normal 0 0 0", "normal 0 0 1"));
    EXPECT_EQ(scene.meshes.at(0).normals.at(0), glm::vec3(0, 0, -1));
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("1 of 12 facets"), std::string::npos) << scene.warnings[0];
    EXPECT_TRUE(
        read(replaced(tests::cube_stl_text(), "normal 0 0 0", "normal nan nan nan")).warnings.empty());
}

TEST(StlFile, KeywordsAreReadInAnyCaseAndBlanks) {
    std::string text = tests::cube_stl_text();
    for (char& c : text)
        c = c == '\n' ? '\r' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    EXPECT_EQ(tests::triangles_of(read("  \n" + text)).size(), 12u);
}

TEST(StlFile, EverySolidIsAMesh) {
    const std::string cube = tests::cube_stl_text();
    const core::Scene scene =
        read(cube + "solid none\nendsolid none\n" + replaced(cube, "solid cube", "solid"));
    ASSERT_EQ(scene.meshes.size(), 2u);
    EXPECT_EQ(scene.meshes[0].name, "cube");
    EXPECT_EQ(scene.meshes[1].name, "part");
    EXPECT_EQ(scene.instances.size(), 2u);
}

TEST(StlFile, BytesAfterTheLastFacetAreWarnedAbout) {
    const core::Scene scene = read(tests::cube_stl_binary("solid cube") + "tail");
    EXPECT_EQ(tests::triangles_of(scene).size(), 12u);
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("4 bytes after the last of 12 facets"), std::string::npos);
}

TEST(StlFile, WhatIsWrongIsNamed) {
    const std::string text = tests::cube_stl_text();
    const std::pair<std::string, const char*> cases[] = {
        {"", "has 0 bytes; binary STL begins with a header of 80"},
        {std::string(84, '\0'), "holds no facets"},
        {"solid empty\nendsolid empty\n", "holds no facets"},
        {"solid cube\nfacet", "line 2: the file ends where normal must stand"},
        {replaced(text, "vertex 0 0 0", "vertex 0 zero 0"),
         "line 4: 'zero' stands where a number must stand"},
        {replaced(text, "outer loop", "inner loop"), "line 3: 'inner' stands where outer must stand"},
        {replaced(text, "    endloop", "    vertex 0 0 1\n    endloop"),
         "line 7: 'vertex' stands where endloop"},
        {replaced(text, "vertex 1 1 0", "vertex 1e39 1 0"), "line 2: facet 1: vertex 3 is not finite"},
        {replaced(text, "vertex 1 1 0", "vertex nan 1 0"), "line 2: facet 1: vertex 3 is not finite"},
        {replaced(text, "endsolid", "facetend"), "'facetend' stands where facet or endsolid must stand"},
        {text + "more", "'more' stands where solid must stand"},
        {std::string(80, 'x') + "\xff\xff\xff\xff", "count of 4294967295 facets takes 214748364834 bytes"},
        {tests::cube_stl_binary().substr(0, 683), "takes 684 bytes, but it has 683"},
    };
    for (const auto& [file, message] : cases) {
        EXPECT_NE(error(file).find(message), std::string::npos) << message << "\n" << error(file);
        EXPECT_NE(error(file).find("'part.stl'"), std::string::npos) << error(file);
        EXPECT_NE(error(file).find("(kind 65)"), std::string::npos) << error(file);
    }
    std::string binary = tests::cube_stl_binary();
    binary.replace(84 + 50 + 12, 4, "\xff\xff\xff\xff");
    EXPECT_NE(error(binary).find("facet 2: vertex 1 is not finite"), std::string::npos) << error(binary);
}

}  // namespace
