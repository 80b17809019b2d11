#include "core/scene/obj_file.h"

#include <gtest/gtest.h>

#include "core/image/tonemap.h"
#include "tests/core/scene/gltf_builder.h"
#include "tests/core/scene/mesh_text.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

/// Reads OBJ text that lies in a folder of its own.
class ObjFile : public testing::Test {
protected:
    core::Scene read(const std::string& text, bool allow_external = false) {
        return core::read_obj(tests::bytes_of(text), folder() / "thing.obj", {"", allow_external});
    }
    std::string error(const std::string& text, bool allow_external = false) {
        return tests::input_error_of([&] { read(text, allow_external); });
    }
    /// Reads a triangle with the material `m` of a library that has these lines.
    core::Scene read_with(const std::string& mtl, const std::string& faces = kTriangle + "f 1 2 3\n") {
        tests::write_text(folder() / "thing.mtl", mtl);
        return read("mtllib thing.mtl\nusemtl m\n" + faces);
    }
    core::Material material(const std::string& lines) {
        return read_with("newmtl m\n" + lines).materials.at(0);
    }
    std::string material_error(const std::string& mtl) {
        return tests::input_error_of([&] { read_with(mtl); });
    }
    void write_png(const std::string& name, const std::vector<std::uint8_t>& rgba) {
        const std::vector<std::uint8_t> png = tests::encode_png(static_cast<int>(rgba.size() / 4), 1, rgba);
        tests::write_text(folder() / name, {png.begin(), png.end()});
    }
    fs::path folder() const {
        fs::create_directories(temporary_.path() / "inside");
        return temporary_.path() / "inside";
    }

    static inline const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    tests::TemporaryFolder temporary_;
};

TEST_F(ObjFile, ACubeIsAMeshWithFlatNormals) {
    const core::Scene scene = read(tests::cube_obj());
    EXPECT_TRUE(tests::is_consistent(scene));
    EXPECT_TRUE(scene.warnings.empty());
    ASSERT_EQ(scene.meshes.size(), 1u);
    EXPECT_EQ(scene.meshes[0].name, "thing");
    EXPECT_EQ(scene.meshes[0].triangles.size(), 12u);
    EXPECT_EQ(scene.meshes[0].normals.at(0), glm::vec3(0, 0, -1));
    EXPECT_EQ(scene.materials.at(0).base_color, glm::vec4(0.8f, 0.8f, 0.8f, 1.0f));
    EXPECT_EQ(scene.materials.at(0).specular, 0.0f);
}

TEST_F(ObjFile, NegativeIndicesCountBackwards) {
    const core::Scene positive = read(kTriangle + "vt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n");
    const core::Scene negative =
        read(kTriangle + "vt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf -3/-3/-1 -2/-2/-1 -1/-1/-1\n");
    EXPECT_EQ(core::scene_hash(positive), core::scene_hash(negative));
    EXPECT_EQ(positive.meshes.at(0).uvs[0].at(2), glm::vec2(0.0f, 0.0f)) << "v runs downwards here";
    EXPECT_EQ(positive.meshes.at(0).positions.size(), 3u);
}

TEST_F(ObjFile, LinesMayBeContinuedAndCommented) {
    EXPECT_EQ(
        core::scene_hash(read("# C:\\models\\\nv 0 0 \\\n0\nv 1 0 0 # one\nv 0 1 0\r\nf 1 2 \\\r\n 3 # end")),
        core::scene_hash(read(kTriangle + "f 1 2 3\n")));
}

TEST_F(ObjFile, CornersThatAreAlikeAreOneVertex) {
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvn 0 0 1\n";
    EXPECT_EQ(read(square + "f 1//1 2//1 3//1\nf 1//1 3//1 4//1\n").meshes.at(0).positions.size(), 4u);
    EXPECT_EQ(read(square + "f 1//1 2//1 3//1\nf 1//2 3//2 4//2\n").meshes.at(0).positions.size(), 6u);
}

TEST_F(ObjFile, FacesWithoutNormalsAreFlatBesideSmoothOnes) {
    const core::Scene scene = read(kTriangle + "vn 0 1 0\nf 1//1 2//1 3//1\nf 1 2 3\n");
    ASSERT_EQ(scene.meshes.size(), 1u);
    ASSERT_EQ(scene.meshes[0].parts.size(), 2u);
    EXPECT_EQ(scene.meshes[0].normals.at(0), glm::vec3(0, 1, 0));
    EXPECT_EQ(scene.meshes[0].normals.at(3), glm::vec3(0, 0, 1));
    EXPECT_TRUE(tests::is_consistent(scene));
}

TEST_F(ObjFile, NormalsWithoutDirectionAreMendedAndSaid) {
    const core::Scene scene = read(kTriangle + "vn 0 0 0\nvn nan 0 0\nf 1//1 2//1 3//2\n");
    EXPECT_EQ(scene.meshes.at(0).normals.at(2), glm::vec3(0, 0, 1));
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("3 normals have no direction"), std::string::npos) << scene.warnings[0];
}

TEST_F(ObjFile, ObjectsAreMeshesAndMaterialsAreParts) {
    tests::write_text(folder() / "two words.mtl", "newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n");
    const core::Scene scene =
        read("mtllib two words.mtl\n" + kTriangle +
             "o first\ng group\nusemtl red\nf 1 2 3\nusemtl green\nf 1 2 3\ng other\nusemtl red\nf 1 2 3\n"
             "o empty\no second thing\nf 1 2 3\n");
    ASSERT_EQ(scene.meshes.size(), 2u);
    EXPECT_EQ(scene.meshes[0].name, "first");
    EXPECT_EQ(scene.meshes[1].name, "second thing");
    ASSERT_EQ(scene.meshes[0].parts.size(), 2u) << "faces of one material are one part";
    EXPECT_EQ(scene.meshes[0].parts[0].triangle_count, 2u);
    EXPECT_EQ(scene.material_of(0, 0).base_color, glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(scene.material_of(0, 2).base_color, glm::vec4(0, 1, 0, 1));
    EXPECT_EQ(scene.material_of(1, 0).name, "red") << "a material lasts until the next";
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
}

TEST_F(ObjFile, ConcavePolygonsAreCovered) {
    const core::Scene scene = read("v 0 0 0\nv 2 0 0\nv 0.5 0.5 0\nv 0 2 0\nf 2 3 4 1\n");
    double area = 0.0;
    for (const tests::Triangle& t : tests::triangles_of(scene)) {
        area += 0.5 * ((t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[2][0] - t[0][0]) * (t[1][1] - t[0][1]));
    }
    EXPECT_DOUBLE_EQ(area, 1.0);
}

TEST_F(ObjFile, ColoursOfVerticesAreDecoded) {
    const core::Scene scene = read("v 0 0 0\nv 1 0 0 0.5 0 2\nv 0 1 0 1 1 1 1\nf 1 2 3\n");
    const std::vector<glm::vec4>& colors = scene.meshes.at(0).colors;
    ASSERT_EQ(colors.size(), 3u);
    EXPECT_EQ(colors[0], glm::vec4(1.0f)) << "a vertex without a colour leaves the material's";
    EXPECT_EQ(colors[1], glm::vec4(core::linear_from_srgb(0.5), 0.0f, 1.0f, 1.0f));
    EXPECT_EQ(scene.materials.at(0).base_color, glm::vec4(1.0f));
    ASSERT_EQ(scene.warnings.size(), 1u) << "2 is clamped";
    const core::Scene late = read("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    EXPECT_EQ(late.meshes.at(0).colors.at(2), glm::vec4(1.0f));
    EXPECT_TRUE(read("v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 1\nf 1 2 3\n").meshes.at(0).colors.empty())
        << "that is w";
}

TEST_F(ObjFile, WhatIsSkippedIsSaidOnce) {
    const core::Scene scene = read(kTriangle + "s 1\ng a b\nf 1 2 3\nl 1 2\np 1\ncurv 0 1 1 2\nface 1 2 3\n");
    ASSERT_EQ(scene.warnings.size(), 3u);
    EXPECT_NE(scene.warnings[0].find("2 statements for lines and points are skipped, 'l' in line 7 first"),
              std::string::npos)
        << scene.warnings[0];
    EXPECT_NE(scene.warnings[1].find("free-form"), std::string::npos);
    EXPECT_NE(scene.warnings[2].find("'face' in line 10"), std::string::npos) << scene.warnings[2];
}

TEST_F(ObjFile, WhatIsWrongIsNamed) {
    const std::pair<std::string, const char*> cases[] = {
        {"", "holds 0 vertices and no faces"},
        {kTriangle, "holds 3 vertices and no faces; a surface is needed"},
        {"v 0 0\n", "line 1: 'v' has 2 numbers; it needs 3"},
        {"v 0 0 0 0 0\n", "line 1: 'v' has 5 numbers"},
        {"v 0 0 0 0 0 0 0 0\n", "line 1: 'v' has more than 7 numbers"},
        {"v 0 x 0\n", "line 1: 'v' is followed by 'x', not a number"},
        {"v 0 inf 0\n", "line 1: 'v' is followed by 'inf', which no float holds"},
        {"v 0 1e39 0\n", "line 1: 'v' is followed by '1e39', which no float holds"},
        {"vt\n", "line 1: 'vt' has 0 numbers; it needs 1"},
        {"vn 0 0\n", "line 1: 'vn' has 2 numbers; it needs 3"},
        {kTriangle + "f 1 2\n", "line 4: the face has 2 corners; it needs 3 or more"},
        {kTriangle + "f 1 2 4\n", "line 4: refers to vertex 4, but only 3 are defined above"},
        {kTriangle + "f 1 2 -4\n", "line 4: refers to vertex -4, but only 3"},
        {kTriangle + "f 1 2 0\n", "line 4: '0' is no vertex index; they count from 1"},
        {kTriangle + "f 1 2 9223372036854775808\n", "line 4: '9223372036854775808' is no vertex index"},
        {kTriangle + "f 1 2 -9223372036854775808\n", "line 4: refers to vertex -9223372036854775808"},
        {kTriangle + "f 1/1 2/1 3/1\n", "line 4: refers to texture coordinate 1, but only 0"},
        {kTriangle + "f 1//1 2//1 3//1\n", "line 4: refers to normal 1, but only 0"},
        {kTriangle + "f 1/x 2 3\n", "line 4: 'x' is no texture coordinate index"},
        {kTriangle + "f 1///1 2 3\n", "line 4: a corner has more than v/vt/vn"},
        {kTriangle + "f / 2 3\n", "line 4: '' is no vertex index"},
        {kTriangle + "f 1 2 three\n", "line 4: 'three' is no vertex index"},
        {"mtllib\n", "line 1: mtllib names no file"},
    };
    for (const auto& [file, message] : cases) {
        EXPECT_NE(error(file).find(message), std::string::npos) << message << "\n" << error(file);
        EXPECT_NE(error(file).find("'thing.obj'"), std::string::npos) << error(file);
        EXPECT_NE(error(file).find("(kind 65)"), std::string::npos) << error(file);
    }
}

TEST_F(ObjFile, DiffuseMaterialsAreLambert) {
    const core::Material plain = material("Kd 0.5 0.25 0.125\n");
    EXPECT_EQ(plain.name, "m");
    EXPECT_EQ(plain.base_color, glm::vec4(0.5f, 0.25f, 0.125f, 1.0f));
    EXPECT_EQ(plain.metallic, 0.0f);
    EXPECT_EQ(plain.specular, 0.0f);
    EXPECT_TRUE(plain.double_sided);
    EXPECT_EQ(material("Kd 0.5\n").base_color, glm::vec4(0.5f, 0.5f, 0.5f, 1.0f));
    EXPECT_EQ(material("Ks 0.5 0.5 0.5\nNs 100\nillum 1\n").specular, 0.0f) << "illum 1 has no highlight";
    EXPECT_EQ(material("Ks 0 0 0\nNs 100\n").specular, 0.0f);
}

TEST_F(ObjFile, HighlightsAreApproximatedAsDocumented) {
    const core::Material plastic = material("Ks 0.5 0.5 0.5\nNs 198\nillum 2\n");
    EXPECT_EQ(plastic.specular, 1.0f);
    EXPECT_EQ(plastic.specular_color, glm::vec3(1.0f));
    // alpha^2 = 2 / 200, alpha = 0.1, roughness = sqrt(0.1).
    EXPECT_FLOAT_EQ(plastic.roughness, std::sqrt(0.1f));
    const core::Material bright = material("Ks 1 0.5 0\n");
    EXPECT_EQ(bright.specular, 1.0f);
    EXPECT_EQ(bright.specular_color, glm::vec3(2.0f, 1.0f, 0.0f));
    EXPECT_EQ(bright.roughness, 1.0f);
    const core::Material weak = material("Ks 0.1 0.1 0.1\n");
    // Head on, 0.04 x colour x strength = 0.08 Ks.
    EXPECT_FLOAT_EQ(0.04f * weak.specular * weak.specular_color.x, 0.008f);
    const core::Material metal = material("Kd 0.9 0.6 0.3\nPr 0.25\nPm 1\n");
    EXPECT_EQ(metal.metallic, 1.0f);
    EXPECT_EQ(metal.roughness, 0.25f);
    EXPECT_EQ(metal.specular, 1.0f);
}

TEST_F(ObjFile, EmissionAndAlphaAreRead) {
    EXPECT_EQ(material("Ke 10 20 30\n").emission, glm::vec3(10, 20, 30));
    for (const char* lines : {"d 0.25\n", "Tr 0.75\n", "d 0.25\nTr 0.1\n", "d -halo 0.25\n"}) {
        const core::Material glass = material(lines);
        EXPECT_EQ(glass.base_color.a, 0.25f) << lines;
        EXPECT_EQ(glass.alpha_mode, core::AlphaMode::kBlend) << lines;
    }
    EXPECT_EQ(material("d 1\n").alpha_mode, core::AlphaMode::kOpaque);
    EXPECT_EQ(read_with("newmtl m\nd 0\n").warnings.size(), 1u);
    EXPECT_EQ(read_with("newmtl m\nKd 2 0 0\nKs -1 0 0\n").warnings.size(), 2u);
}

TEST_F(ObjFile, TexturesAreFoundBesideTheLibraryAndSharedByPath) {
    write_png("bricks 1.png", {10, 20, 30, 255, 40, 50, 60, 255});
    const std::string faces = kTriangle + "vt 0.5 0.25\nf 1/1 2/1 3/1\nusemtl n\nf 1/1 2/1 3/1\n";
    const core::Scene scene = read_with(
        "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd bricks 1.png\nmap_Ke .\\bricks 1.png\nnorm -bm 2 ./bricks 1.png\n"
        "newmtl n\nmap_Kd -clamp on -s 2 4 1 -o 0.5 0.125 -mm 0 1 bricks 1.png\n",
        faces);
    EXPECT_EQ(scene.images.size(), 1u);
    ASSERT_EQ(scene.textures.size(), 2u);
    const core::Material& first = scene.material_of(0, 0);
    EXPECT_TRUE(first.base_color_texture.present());
    EXPECT_EQ(first.emission, glm::vec3(1.0f));
    EXPECT_TRUE(first.normal_texture.present());
    EXPECT_EQ(scene.meshes.at(0).tangents.size(), 6u);
    EXPECT_EQ(scene.meshes.at(0).uvs[0].at(0), glm::vec2(0.5f, 0.75f));
    const core::Material& second = scene.material_of(0, 1);
    EXPECT_EQ(second.base_color, glm::vec4(1.0f)) << "without Kd, the picture alone";
    EXPECT_EQ(scene.textures[1].wrap_u, core::TextureWrap::kClampToEdge);
    // The file's (0.5, 0.25) becomes (0.5 * 2 + 0.5, 0.25 * 4 + 0.125), counted from the bottom.
    EXPECT_EQ(second.base_color_texture.uv_from_mesh_uv * glm::vec3(0.5f, 0.75f, 1.0f),
              glm::vec2(1.5f, 1.0f - 1.125f));
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
}

TEST_F(ObjFile, AnOpacityMapCountsWhereItIsTheColourMapsAlpha) {
    write_png("leaf.png", {10, 20, 30, 0});
    EXPECT_EQ(material("map_Kd leaf.png\nmap_d leaf.png\n").alpha_mode, core::AlphaMode::kBlend);
    const core::Scene other = read_with("newmtl m\nmap_Kd leaf.png\nmap_d mask.png\nmap_Bump b.png\n");
    EXPECT_EQ(other.materials.at(0).alpha_mode, core::AlphaMode::kOpaque);
    ASSERT_EQ(other.warnings.size(), 1u);
    EXPECT_NE(other.warnings[0].find("map_Bump, map_d are not read"), std::string::npos) << other.warnings[0];
}

TEST_F(ObjFile, MissingAndForeignFilesAreWarnedAbout) {
    const core::Scene no_library = read("mtllib absent.mtl\nusemtl m\n" + kTriangle + "f 1 2 3\n");
    ASSERT_EQ(no_library.warnings.size(), 1u);
    EXPECT_NE(no_library.warnings[0].find("line 1: material library 'absent.mtl' does not exist"),
              std::string::npos);
    EXPECT_EQ(no_library.materials.at(0).name, "m");
    tests::write_text(folder() / "old.tga", "not a picture that is read");
    const core::Scene scene = read_with("newmtl m\nmap_Kd old.tga\nmap_Ke gone.png\n");
    ASSERT_EQ(scene.warnings.size(), 2u);
    EXPECT_NE(scene.warnings[0].find("'thing.mtl': line 2: texture 'old.tga' is neither PNG nor JPEG"),
              std::string::npos)
        << scene.warnings[0];
    EXPECT_NE(scene.warnings[1].find("'gone.png' does not exist"), std::string::npos) << scene.warnings[1];
    EXPECT_EQ(scene.materials.at(0).emission, glm::vec3(0.0f)) << "nothing shines without its picture";
    const core::Scene unknown = read_with("newmtl other\n");
    ASSERT_EQ(unknown.warnings.size(), 1u);
    EXPECT_NE(unknown.warnings[0].find("material 'm' is in no library"), std::string::npos);
}

TEST_F(ObjFile, PathsThatLeaveTheFolderNeedAllowExternal) {
    const fs::path outside = temporary_.path() / "outside.mtl";
    tests::write_text(outside, "newmtl m\nKd 1 0 0\n");
    const std::string faces = "usemtl m\n" + kTriangle + "f 1 2 3\n";
    fs::create_symlink(outside, folder() / "link.mtl");
    for (const std::string& name : {std::string("../outside.mtl"), std::string("..\\outside.mtl"),
                                    outside.string(), std::string("link.mtl")}) {
        const std::string text = "mtllib " + name + "\n" + faces;
        EXPECT_NE(error(text).find("--allow-external"), std::string::npos) << name << ": " << error(text);
        EXPECT_EQ(error(text, true), "no error") << name;
        EXPECT_EQ(read(text, true).materials.at(0).base_color, glm::vec4(1, 0, 0, 1)) << name;
    }
    EXPECT_NE(material_error("newmtl m\nmap_Kd ../x.png\n").find("'thing.mtl': line 2: texture"),
              std::string::npos)
        << material_error("newmtl m\nmap_Kd ../x.png\n");
    EXPECT_NE(error("mtllib /dev/zero\n" + faces, true).find("not a regular file"), std::string::npos);
    // Names are no URIs.
    tests::write_text(folder() / "100%41.mtl", "newmtl m\nKd 0 1 0\n");
    EXPECT_EQ(read("mtllib 100%41.mtl\n" + faces).materials.at(0).base_color, glm::vec4(0, 1, 0, 1));
}

TEST_F(ObjFile, WhatIsWrongInALibraryIsNamed) {
    const std::pair<std::string, const char*> cases[] = {
        {"Kd 1 1 1\n", "line 1: 'Kd' stands before any newmtl"},
        {"newmtl\n", "line 1: newmtl needs a name"},
        {"newmtl m\nKd 1 1\n", "line 2: Kd must be followed by a number, not ''"},
        {"newmtl m\nKd red\n", "line 2: Kd must be followed by a number, not 'red'"},
        {"newmtl m\nNs nan\n", "line 2: Ns must be followed by a number, not 'nan'"},
        {"newmtl m\nKe 1e300 0 0\n", "Ke of the material above is too large"},
        {"newmtl m\nmap_Kd\n", "line 2: map_Kd names no file"},
        {"newmtl m\nmap_Kd -s 1e300 1 1 x.png\n", "line 2: -s or -o is too large"},
    };
    for (const auto& [mtl, message] : cases) {
        EXPECT_NE(material_error(mtl).find(message), std::string::npos) << message << "\n"
                                                                        << material_error(mtl);
        EXPECT_NE(material_error(mtl).find("'thing.mtl'"), std::string::npos) << material_error(mtl);
    }
    write_png("cut.png", {1, 2, 3, 4});
    fs::resize_file(folder() / "cut.png", 40);
    EXPECT_NE(material_error("newmtl m\nmap_Kd cut.png\n").find("texture 'cut.png'"), std::string::npos);
}

TEST_F(ObjFile, WarningsComeToAnEnd) {
    std::string text = kTriangle + "mtllib thing.mtl\n";
    for (int i = 0; i < 500; ++i) text += fmt::format("usemtl unknown{}\nf 1 2 3\n", i);
    tests::write_text(folder() / "thing.mtl", "newmtl m\n");
    const core::Scene scene = read(text);
    EXPECT_EQ(scene.warnings.size(), 51u);
    EXPECT_EQ(scene.warnings.back(), "and 450 more warnings");
    std::string libraries = "mtllib";
    for (int i = 0; i < 1001; ++i) libraries += fmt::format(" {}.mtl", i);
    EXPECT_NE(error(libraries + "\n" + text).find("more than 1000 material libraries"), std::string::npos);
    const std::string several =
        "mtllib " + std::string(300, 'x') + " thing.mtl\nusemtl m\n" + kTriangle + "f 1 2 3\n";
    EXPECT_NE(error(several).find("File name too long"), std::string::npos) << error(several);
    std::string names = "mtllib";
    for (int i = 0; i < 40; ++i) names += fmt::format(" library{}.mtl", i);
    EXPECT_EQ(read(names + " thing.mtl\nusemtl m\n" + kTriangle + "f 1 2 3\n").materials.at(0).name, "m");
}

}  // namespace
