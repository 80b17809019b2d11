// OBJ, PLY and STL through the program: inspect, bake and render, as typed.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

struct Outcome {
    int exit_code = -1;
    std::string out;
};

/// @param arguments with what the shell should do with stderr.
Outcome run(const std::string& arguments) {
    Outcome outcome;
    FILE* pipe = popen((std::string(FIELDLIGHT_BINARY) + " " + arguments).c_str(), "r");
    std::array<char, 4096> buffer;
    while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
        outcome.out.append(buffer.data(), count);
    }
    const int status = pclose(pipe);
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return outcome;
}

std::set<std::string> keys_of(const nlohmann::json& object) {
    std::set<std::string> keys;
    for (const auto& [key, value] : object.items()) keys.insert(key);
    return keys;
}

const char* const kObj = "v -1 -1 -1\nv 1 -1 -1\nv 0 1 -1\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
const char* const kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "-1 -1 -1\n1 -1 -1\n0 1 -1\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";

std::string tetrahedron_stl() {
    const char* const corners[] = {"-1 -1 -1", "1 -1 -1", "0 1 -1", "0 0 1"};
    std::string text = "solid\n";
    for (const auto& face :
         {std::array{0, 2, 1}, std::array{0, 1, 3}, std::array{1, 2, 3}, std::array{2, 0, 3}}) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const int corner : face) text += std::string("vertex ") + corners[corner] + "\n";
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid\n";
}

/// The same tetrahedron three times.
class MeshFiles : public testing::Test {
protected:
    MeshFiles() {
        write("thing.obj", kObj);
        write("thing.ply", kPly);
        write("thing.STL", tetrahedron_stl());
    }
    void write(const std::string& name, const std::string& contents) {
        std::ofstream(folder_.path() / name, std::ios::binary) << contents;
    }
    std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

    static constexpr const char* kNames[] = {"thing.obj", "thing.ply", "thing.STL"};
    tests::TemporaryFolder folder_;
};

TEST_F(MeshFiles, InspectTellsTheSameKeysAsOfGltf) {
    const std::string gltf = (tests::assets_folder() / "cornell_box.glb").string();
    const std::set<std::string> keys = keys_of(nlohmann::json::parse(run("inspect --json " + gltf).out));
    EXPECT_EQ(keys.count("triangles"), 1u);
    for (const char* name : kNames) {
        const Outcome outcome = run("inspect --json " + path(name));
        ASSERT_EQ(outcome.exit_code, 0) << name;
        const nlohmann::json json = nlohmann::json::parse(outcome.out);
        EXPECT_EQ(keys_of(json), keys) << name;
        EXPECT_EQ(json["meshes"], 1) << name;
        EXPECT_EQ(json["triangles"], 4) << name;
        EXPECT_EQ(json["bounds"], nlohmann::json({{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}})) << name;
        EXPECT_TRUE(json["warnings"].empty()) << name;
    }
}

TEST_F(MeshFiles, BakeMakesTheSameClosedFieldOfEach) {
    std::set<std::string> fields;
    for (const char* name : kNames) {
        const Outcome outcome = run("bake --json --quiet --resolution 24 " + path(name) + " -o " +
                                    path(std::string(name) + ".bake"));
        ASSERT_EQ(outcome.exit_code, 0) << name;
        nlohmann::json mesh = nlohmann::json::parse(outcome.out)["meshes"].at(0);
        EXPECT_EQ(mesh["class"], "solid") << name << ": flat faces must still close";
        for (const char* changing : {"seconds", "file", "reused"}) mesh.erase(changing);
        fields.insert(mesh.dump());
    }
    EXPECT_EQ(fields.size(), 1u) << *fields.begin() << "\n" << *fields.rbegin();
}

TEST_F(MeshFiles, RenderMakesTheSamePictureOfEach) {
    const std::string flags = " --size 24x24 --accumulate 4 --resolution 24 --quiet --sky 1,1,1 -o ";
    for (const char* name : kNames) {
        ASSERT_EQ(run("render " + path(name) + flags + path(std::string(name) + ".exr")).exit_code, 0)
            << name;
    }
    for (const char* name : {"thing.ply", "thing.STL"}) {
        EXPECT_EQ(run("compare --quiet " + path(std::string(name) + ".exr") + " " + path("thing.obj.exr") +
                      " --fail-max 0 > /dev/null")
                      .exit_code,
                  0)
            << name;
    }
}

TEST_F(MeshFiles, WhatCannotBeReadIsRefusedWithItsCode) {
    write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    write("points.ply", std::string(kPly).replace(std::string(kPly).find("face 4"), 6, "face 0"));
    write("notes.txt", "hello");
    for (const char* verb : {"inspect ", "bake -o out ", "render -o out.exr "}) {
        const Outcome bad = run(verb + path("bad.obj") + " 2>&1");
        EXPECT_EQ(bad.exit_code, 65) << verb;
        EXPECT_NE(bad.out.find("'bad.obj': line 2: refers to vertex 2, but only 1"), std::string::npos)
            << bad.out;
        const Outcome points = run(verb + path("points.ply") + " 2>&1");
        EXPECT_EQ(points.exit_code, 65) << verb;
        EXPECT_NE(points.out.find("points must be meshed first"), std::string::npos) << points.out;
        EXPECT_EQ(run(verb + path("notes.txt") + " 2>&1").exit_code, 64) << verb;
        EXPECT_EQ(run(verb + path("absent.stl") + " 2>&1").exit_code, 66) << verb;
    }
    EXPECT_EQ(run("render --scene 1 -o out.exr " + path("thing.obj") + " 2>&1").exit_code, 64);
}

TEST_F(MeshFiles, WarningsOfTheReaderReachThePerson) {
    write("thing.obj", std::string("mtllib gone.mtl\nusemtl red\n") + kObj);
    EXPECT_NE(run("inspect " + path("thing.obj")).out.find("'gone.mtl' does not exist"), std::string::npos);
    EXPECT_NE(run("bake --resolution 16 " + path("thing.obj") + " -o " + path("b") + " 2>&1")
                  .out.find("'gone.mtl' does not exist"),
              std::string::npos);
}

}  // namespace
