#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/core/scene/gltf_builder.h"

namespace {

using tests::GltfBuilder;

/// Rounding of a few double products of numbers near one.
constexpr double kRounding = 1e-12;

void expect_point(const core::Instance& instance, const glm::dvec3& local, const glm::dvec3& world) {
    const glm::dvec3 mapped(instance.world_from_local * glm::dvec4(local, 1.0));
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(mapped[axis], world[axis], kRounding);
}

/// A triangle under one node.
core::Scene load_node(const std::string& node) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    builder.add("nodes", node);
    return builder.load();
}

std::string error_of_node(const std::string& node) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    builder.add("nodes", node);
    return builder.error();
}

TEST(GltfNodes, ScaleThenRotateThenTranslate) {
    const double half = std::sqrt(0.5);
    const core::Scene scene = load_node(fmt::format(
        R"({{"mesh":0,"translation":[10,0,0],"rotation":[0,0,{},{}],"scale":[2,3,4]}})", half, half));
    // x scaled to 2, then turned by 90 degrees about z onto y.
    expect_point(scene.instances[0], {1, 0, 0}, {10, 2, 0});
    expect_point(scene.instances[0], {0, 1, 0}, {7, 0, 0});
}

TEST(GltfNodes, MatricesAreReadByColumns) {
    const core::Scene scene = load_node(R"({"mesh":0,"matrix":[0,2,0,0, 1,0,0,0, 0,0,1,0, 5,6,7,1]})");
    expect_point(scene.instances[0], {1, 0, 0}, {5, 8, 7});
}

TEST(GltfNodes, ChildrenStandInTheirParents) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    builder.add("nodes", R"({"mesh":0,"translation":[1,0,0],"name":"leaf"})");
    builder.add("nodes", R"({"children":[0],"scale":[-2,2,2]})");
    builder.add("scenes", R"({"nodes":[1]})");
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.instances.size(), 1u);
    EXPECT_EQ(scene.instances[0].name, "leaf");
    expect_point(scene.instances[0], {1, 1, 0}, {-4, 2, 0});
}

TEST(GltfNodes, MirrorsKeepTheFrontOfNormals) {
    const core::Scene scene = load_node(R"({"mesh":0,"scale":[-1,1,1]})");
    EXPECT_EQ(scene.instances[0].normal_from_local * glm::vec3(0, 0, 1), glm::vec3(0, 0, 1));
    EXPECT_EQ(scene.instances[0].normal_from_local * glm::vec3(1, 0, 0), glm::vec3(-1, 0, 0));
}

TEST(GltfNodes, ScenesAreChosenByNameNumberOrTheFile) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    for (int i = 0; i < 3; ++i) builder.add("nodes", R"({"mesh":0})");
    builder.add("scenes", R"({"nodes":[0]})");
    builder.add("scenes", R"({"name":"pair","nodes":[1,2]})");
    EXPECT_EQ(builder.load().instances.size(), 1u) << "without a scene key it is scene 0";
    EXPECT_EQ(builder.load({.scene = "pair"}).instances.size(), 2u);
    EXPECT_EQ(builder.load({.scene = "1"}).instances.size(), 2u);
    builder.set("scene", "1");
    EXPECT_EQ(builder.load().instances.size(), 2u);
    const std::string error = builder.error({.scene = "trio"});
    EXPECT_NE(error.find("no scene 'trio'; the file has 0 '', 1 'pair' (kind 64"), std::string::npos)
        << error;
}

TEST(GltfNodes, CyclesAreRefused) {
    GltfBuilder builder;
    builder.add("nodes", R"({"children":[1]})");
    builder.add("nodes", R"({"children":[0]})");
    builder.add("scenes", R"({"nodes":[]})");
    EXPECT_NE(builder.error().find("is its own ancestor"), std::string::npos) << builder.error();
}

TEST(GltfNodes, ANodeWithTwoParentsIsRefused) {
    GltfBuilder builder;
    builder.add("nodes", "{}");
    builder.add("nodes", R"({"children":[0]})");
    builder.add("nodes", R"({"children":[0]})");
    builder.add("scenes", R"({"nodes":[1,2]})");
    EXPECT_NE(builder.error().find("child 0 is also a child of node 1"), std::string::npos)
        << builder.error();
}

TEST(GltfNodes, ASceneMustNameRoots) {
    GltfBuilder builder;
    builder.add("nodes", "{}");
    builder.add("nodes", R"({"children":[0]})");
    builder.add("scenes", R"({"nodes":[0,1]})");
    EXPECT_NE(builder.error().find("it is a child of node 1"), std::string::npos) << builder.error();
}

TEST(GltfNodes, DeepHierarchiesNeedNoDeepStack) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    constexpr int kDepth = 20000;
    for (int i = 0; i < kDepth; ++i) {
        builder.add("nodes", fmt::format(R"({{"children":[{}],"translation":[1,0,0]}})", i + 1));
    }
    builder.add("nodes", R"({"mesh":0})");
    builder.add("scenes", R"({"nodes":[0]})");
    const core::Scene scene = builder.load();
    expect_point(scene.instances.at(0), {0, 0, 0}, {kDepth, 0, 0});
}

TEST(GltfNodes, SingularTransformsAreRefusedByTheNodesName) {
    const std::string error = error_of_node(R"({"mesh":0,"name":"flat","scale":[1,0,1]})");
    EXPECT_NE(error.find("nodes[0] 'flat'"), std::string::npos) << error;
    EXPECT_NE(error.find("singular"), std::string::npos) << error;
}

TEST(GltfNodes, TransformsThatOverflowAreRefused) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    builder.add("nodes", R"({"children":[1],"scale":[1e300,1,1]})");
    builder.add("nodes", R"({"mesh":0,"scale":[1e300,1,1]})");
    builder.add("scenes", R"({"nodes":[0]})");
    EXPECT_NE(builder.error().find("not finite"), std::string::npos) << builder.error();
}

TEST(GltfNodes, SkinsAreIgnoredWithOneWarning) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    builder.add("skins", R"({"joints":[0]})");
    builder.add("nodes", R"({"mesh":0,"skin":0})");
    builder.add("nodes", R"({"mesh":0,"skin":0})");
    EXPECT_EQ(builder.load().warnings.size(), 1u);
}

TEST(GltfNodes, InstancingMultipliesWithTheNodeAndReplacesItsOwnCopy) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    const int translation = builder.add_floats("VEC3", {0, 0, 0, 1, 0, 0});
    const std::vector<std::int16_t> turns = {0, 0, 0, 32767, 0, 0, 32767, 0};
    const int rotation =
        builder.add_accessor(builder.add_view(turns), GltfBuilder::kShort, 2, "VEC4", R"("normalized":true)");
    const int scale = builder.add_floats("VEC3", {1, 1, 1, 3, 3, 3});
    builder.add("nodes", fmt::format(R"({{"mesh":0,"scale":[2,2,2],"extensions":{{"EXT_mesh_gpu_instancing":)"
                                     R"({{"attributes":{{"TRANSLATION":{},"ROTATION":{},"SCALE":{}}}}}}}}})",
                                     translation, rotation, scale));
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.instances.size(), 2u);
    expect_point(scene.instances[0], {1, 0, 0}, {2, 0, 0});
    // 3 x, turned by 180 degrees about z, moved by 1, and all of it doubled.
    expect_point(scene.instances[1], {1, 0, 0}, {-4, 0, 0});
}

TEST(GltfNodes, InstancingAccessorsMustAgreeInLength) {
    GltfBuilder builder;
    builder.add_triangle_mesh();
    const int translation = builder.add_floats("VEC3", {0, 0, 0, 1, 0, 0});
    const int scale = builder.add_floats("VEC3", {1, 1, 1});
    builder.add("nodes", fmt::format(R"({{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":)"
                                     R"({{"attributes":{{"TRANSLATION":{},"SCALE":{}}}}}}}}})",
                                     translation, scale));
    EXPECT_NE(builder.error().find("differ in length"), std::string::npos) << builder.error();
}

TEST(GltfNodes, PerspectiveCamerasLoseTheirNodesScale) {
    GltfBuilder builder;
    builder.add("cameras", R"({"type":"perspective","perspective":{"yfov":0.5,"znear":0.1,"zfar":9}})");
    builder.add("nodes", R"({"camera":0,"name":"front","scale":[-3,3,3],"translation":[1,2,3]})");
    const core::Scene scene = builder.load();
    const core::Camera& camera = scene.cameras.at(0);
    EXPECT_EQ(camera.name, "front");
    EXPECT_DOUBLE_EQ(camera.vertical_fov, 0.5);
    EXPECT_DOUBLE_EQ(camera.near_distance, 0.1);
    EXPECT_DOUBLE_EQ(camera.far_distance, 9.0);
    EXPECT_FALSE(camera.orthographic);
    EXPECT_NEAR(glm::determinant(glm::dmat3(camera.world_from_camera)), 1.0, kRounding);
    EXPECT_EQ(glm::dvec3(camera.world_from_camera[3]), glm::dvec3(1, 2, 3));
}

TEST(GltfNodes, OrthographicCamerasKeepTheirMagnification) {
    GltfBuilder builder;
    builder.add("cameras",
                R"({"type":"orthographic","orthographic":{"xmag":2,"ymag":3,"znear":0,"zfar":10}})");
    builder.add("nodes", R"({"camera":0})");
    const core::Camera camera = builder.load().cameras.at(0);
    EXPECT_TRUE(camera.orthographic);
    EXPECT_EQ(camera.magnification, glm::dvec2(2, 3));
}

TEST(GltfNodes, LightsShineAlongTheNodesMinusZ) {
    GltfBuilder builder;
    builder.set("extensions",
                R"({"KHR_lights_punctual":{"lights":[{"type":"directional","color":[1,0.5,0],"intensity":4},)"
                R"({"type":"point","intensity":7},{"type":"spot"}]}})");
    const double half = std::sqrt(0.5);
    // -90 degrees about x turns -Z into -Y.
    const std::string members[] = {fmt::format(R"("rotation":[{},0,0,{}],"scale":[2,2,2])", -half, half),
                                   R"("translation":[1,2,3])", R"("name":"torch")"};
    for (int i = 0; i < 3; ++i) {
        builder.add("nodes", fmt::format(R"({{{},"extensions":{{"KHR_lights_punctual":{{"light":{}}}}}}})",
                                         members[i], i));
    }
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.lights.size(), 3u);
    const auto& sun = std::get<core::DirectionalLight>(scene.lights[0]);
    EXPECT_NEAR(sun.direction.y, -1.0f, 1e-6f);
    EXPECT_EQ(sun.illuminance, glm::vec3(4, 2, 0));
    const auto& point = std::get<core::PointLight>(scene.lights[1]);
    EXPECT_EQ(point.position, glm::vec3(1, 2, 3));
    EXPECT_EQ(point.intensity, glm::vec3(7));
    const auto& spot = std::get<core::SpotLight>(scene.lights[2]);
    EXPECT_EQ(spot.name, "torch");
    EXPECT_EQ(spot.intensity, glm::vec3(1)) << "defaults: white, 1 cd, cones of 0 and pi / 4";
    EXPECT_FLOAT_EQ(spot.cos_inner, 1.0f);
    EXPECT_FLOAT_EQ(spot.cos_outer, static_cast<float>(std::cos(std::numbers::pi / 4)));
}

TEST(GltfNodes, ALightOfAnUnknownTypeIsLeftOutWithAWarning) {
    GltfBuilder builder;
    builder.set("extensions", R"({"KHR_lights_punctual":{"lights":[{"type":"sphere"},{"type":"spot"}]}})");
    builder.add("nodes", R"({"extensions":{"KHR_lights_punctual":{"light":0}}})");
    builder.add("nodes", R"({"extensions":{"KHR_lights_punctual":{"light":1}}})");
    const core::Scene scene = builder.load();
    EXPECT_EQ(scene.lights.size(), 1u);
    ASSERT_EQ(scene.warnings.size(), 2u);
    EXPECT_NE(scene.warnings[0].find("type 'sphere' is none of"), std::string::npos);
    EXPECT_NE(scene.warnings[1].find("'spot' is missing"), std::string::npos);
}

TEST(GltfNodes, ALightThatIsNotThereIsRefused) {
    GltfBuilder builder;
    builder.set("extensions", R"({"KHR_lights_punctual":{"lights":[{"type":"point"}]}})");
    builder.add("nodes", R"({"extensions":{"KHR_lights_punctual":{"light":1}}})");
    EXPECT_NE(builder.error().find("is 1, but the file has 1 lights"), std::string::npos) << builder.error();
}

TEST(GltfNodes, AMeshOrCameraThatIsNotThereIsRefused) {
    EXPECT_NE(error_of_node(R"({"mesh":1})").find("is 1, but the file has 1 meshes"), std::string::npos);
    EXPECT_NE(error_of_node(R"({"camera":0})").find("is 0, but the file has 0 cameras"), std::string::npos);
}

}  // namespace
