#include "core/scene/gltf_animations.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/scene/gltf_loader.h"
#include "tests/core/scene/gltf_builder.h"
#include "tests/support/shared_data.h"

namespace {

using core::AnimatedProperty;
using core::Interpolation;
using tests::GltfBuilder;

/// An animation of node 0, which is added where `node` is given.
void animate(GltfBuilder& builder, const std::string& path, int input, int output,
             const std::string& interpolation = "LINEAR", const std::string& node = "{}") {
    if (!node.empty()) builder.add("nodes", node);
    builder.add("animations",
                fmt::format(R"({{"name":"move","samplers":[{{"input":{},"output":{},"interpolation":"{}"}}],)"
                            R"("channels":[{{"sampler":0,"target":{{"node":0,"path":"{}"}}}}]}})",
                            input, output, interpolation, path));
}

TEST(GltfAnimations, ChannelsAndSamplersAreRead) {
    GltfBuilder builder;
    const int input = builder.add_floats("SCALAR", {0, 2});
    animate(builder, "translation", input, builder.add_floats("VEC3", {0, 0, 0, 2, 4, 6}));
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.animations.size(), 1u);
    const core::Animation& animation = scene.animations[0];
    EXPECT_EQ(animation.name, "move");
    ASSERT_EQ(animation.channels.size(), 1u);
    EXPECT_EQ(animation.channels[0].property, AnimatedProperty::kTranslation);
    EXPECT_EQ(core::duration(animation), 2.0);
    EXPECT_EQ(core::sample(animation, 0.5).at(0).translation, glm::dvec3(0.5, 1, 1.5));
}

TEST(GltfAnimations, NormalisedRotationsAreRead) {
    GltfBuilder builder;
    const int input = builder.add_floats("SCALAR", {0, 1});
    const std::vector<std::int16_t> rotations = {0, 0, 0, 32767, 32767, 0, 0, 0};
    const int output = builder.add_accessor(builder.add_view(rotations), GltfBuilder::kShort, 2, "VEC4",
                                            R"("normalized":true)");
    animate(builder, "rotation", input, output, "STEP");
    const core::Scene scene = builder.load();
    EXPECT_EQ(core::sample(scene.animations[0], 0.0).at(0).rotation, glm::dquat(1, 0, 0, 0));
    EXPECT_EQ(core::sample(scene.animations[0], 1.0).at(0).rotation, glm::dquat(0, 1, 0, 0));
}

TEST(GltfAnimations, CubicSplinesBringThreeValuesAKey) {
    GltfBuilder builder;
    const int input = builder.add_floats("SCALAR", {0, 1});
    const int output = builder.add_floats("VEC3", {0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0, 3, 3, 3, 0, 0, 0});
    animate(builder, "scale", input, output, "CUBICSPLINE");
    const core::Scene scene = builder.load();
    EXPECT_EQ(scene.animations[0].samplers[0].interpolation, Interpolation::kCubicSpline);
    EXPECT_EQ(core::sample(scene.animations[0], 0.5).at(0).scale, glm::dvec3(2));
}

/// A triangle with two morph targets.
int add_morphing_mesh(GltfBuilder& builder) {
    const int zeros = builder.add_floats("VEC3", std::vector<float>(9, 0.0f));
    return builder.add_triangle_mesh(
        fmt::format(R"("targets":[{{"POSITION":{}}},{{"POSITION":{}}}])", zeros, zeros));
}

TEST(GltfAnimations, WeightsHaveOneNumberAMorphTarget) {
    GltfBuilder builder;
    add_morphing_mesh(builder);
    const int input = builder.add_floats("SCALAR", {0, 1});
    const int output = builder.add_floats("SCALAR", {0, 1, 1, 0});
    animate(builder, "weights", input, output, "LINEAR", R"({"mesh":0})");
    const core::Scene scene = builder.load();
    EXPECT_EQ(core::sample(scene.animations[0], 0.25).at(0).weights, (std::vector<double>{0.25, 0.75}));
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("morph targets stand still"), std::string::npos);
}

TEST(GltfAnimations, TargetsOfExtensionsAreLeftOut) {
    GltfBuilder builder;
    builder.add("nodes", "{}");
    builder.add("animations", R"({"samplers":[],"channels":[{"sampler":0,"target":{"path":"pointer",)"
                              R"("extensions":{"KHR_animation_pointer":{"pointer":"/x"}}}}]})");
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.animations.size(), 1u) << "it still counts";
    EXPECT_TRUE(scene.animations[0].channels.empty());
    EXPECT_EQ(core::duration(scene.animations[0]), 0.0);
}

/// Why the one animation of a file was left out.
std::string warning_of(const GltfBuilder& builder) {
    const core::Scene scene = builder.load();
    if (scene.warnings.empty()) return "no warning";
    EXPECT_TRUE(scene.animations.empty());
    EXPECT_EQ(scene.warnings.size(), 1u);
    EXPECT_EQ(scene.warnings[0].find("an animation is left out: "), 0u) << scene.warnings[0];
    return scene.warnings[0];
}

TEST(GltfAnimations, BrokenKeysLeaveTheirAnimationOutByAccessor) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    struct Case {
        std::vector<float> times;
        std::vector<float> values;
        const char* path;
        const char* interpolation;
        const char* message;
    };
    const Case cases[] = {
        {{0, 0}, {0, 0, 0, 0, 0, 0}, "scale", "LINEAR", "accessors[0]: time 1 is 0 after 0"},
        {{1, 0.5f}, {0, 0, 0, 0, 0, 0}, "scale", "LINEAR", "accessors[0]: time 1 is 0.5 after 1"},
        {{-1, 0}, {0, 0, 0, 0, 0, 0}, "scale", "LINEAR", "accessors[0]: time 0 is -1"},
        {{0, nan}, {0, 0, 0, 0, 0, 0}, "scale", "LINEAR", "accessors[0]: time 1 is nan"},
        {{0, 1}, {0, 0, 0, 0, nan, 0}, "translation", "STEP", "accessors[1]: element 1 is not finite"},
        {{0, 1}, {0, 0, 0}, "translation", "STEP", "accessors[1]: has 1 elements; the 2 times of"},
        {{0, 1}, {0, 0, 0, 0, 0, 0}, "translation", "CUBICSPLINE", "need 6"},
        {{0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}, "translation", "CUBICSPLINE", "at least two keys"},
        {{0}, {0, 0, 0}, "rotation", "LINEAR", "accessors[1]: has 3 components"},
        {{0}, {0, 0, 0}, "translation", "SPLINE", "interpolation 'SPLINE' is none of"},
        {{0}, {0, 0, 0}, "color", "LINEAR", "path 'color' is none of"},
        {{0}, {0, 0, 0}, "weights", "LINEAR", "node 0 has no mesh"},
    };
    for (const Case& bad : cases) {
        GltfBuilder builder;
        const int input = builder.add_floats("SCALAR", bad.times);
        animate(builder, bad.path, input, builder.add_floats("VEC3", bad.values), bad.interpolation);
        const std::string warning = warning_of(builder);
        EXPECT_NE(warning.find(bad.message), std::string::npos) << warning;
    }
}

TEST(GltfAnimations, RotationsWithoutDirectionLeaveTheirAnimationOut) {
    GltfBuilder builder;
    const int input = builder.add_floats("SCALAR", {0, 1});
    animate(builder, "rotation", input, builder.add_floats("VEC4", {0, 0, 0, 1, 0, 0, 0, 0}));
    const std::string warning = warning_of(builder);
    EXPECT_NE(warning.find("the rotation of key 1 is zero"), std::string::npos) << warning;
}

TEST(GltfAnimations, TargetsThatCannotMoveLeaveTheirAnimationOut) {
    const auto error = [](const std::string& node, const std::string& channels) {
        GltfBuilder builder;
        const int input = builder.add_floats("SCALAR", {0});
        const int output = builder.add_floats("VEC3", {0, 0, 0});
        builder.add("nodes", node);
        builder.add("animations",
                    fmt::format(R"({{"samplers":[{{"input":{},"output":{}}}],"channels":[{}]}})", input,
                                output, channels));
        return warning_of(builder);
    };
    const std::string channel = R"({"sampler":0,"target":{"node":0,"path":"scale"}})";
    EXPECT_EQ(error("{}", channel), "no warning");
    EXPECT_NE(error(R"({"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]})", channel).find("node 0 has a matrix"),
              std::string::npos);
    EXPECT_NE(error("{}", channel + "," + channel).find("scale of node 0 has two channels"),
              std::string::npos);
    EXPECT_NE(error("{}", R"({"sampler":0,"target":{"node":1,"path":"scale"}})").find("has 1 nodes"),
              std::string::npos);
    EXPECT_NE(error("{}", R"({"sampler":1,"target":{"node":0,"path":"scale"}})").find("has 1 samplers"),
              std::string::npos);
    EXPECT_NE(error("{}", channel + R"(,{"sampler":0,"target":{"node":0,"path":"rotation"}})")
                  .find("needs values of 4 numbers; those of its sampler have 3"),
              std::string::npos);
}

/// Where all that hangs on nodes would stand by the nodes alone.
void expect_rest_pose(const core::Scene& scene) {
    const std::vector<glm::dmat4> world = core::world_from_nodes(scene.nodes);
    for (const core::Instance& instance : scene.instances) {
        ASSERT_LT(instance.node, scene.nodes.size());
        EXPECT_EQ(world[instance.node] * instance.node_from_local, instance.world_from_local);
    }
    for (const core::Camera& camera : scene.cameras) {
        EXPECT_EQ(world.at(camera.node)[3], camera.world_from_camera[3]);
    }
    for (const core::Light& light : scene.lights) {
        std::visit([&](const auto& placed) { EXPECT_LT(placed.node, scene.nodes.size()); }, light);
    }
}

TEST(GltfAnimations, WhatStandsInASceneKnowsItsNode) {
    FIELDLIGHT_NEED_SHARED(scenes, "scenes");
    for (const char* file :
         {"cesium_milk_truck/CesiumMilkTruck.glb", "toy_car/ToyCar.gltf",
          "recursive_skeletons/RecursiveSkeletons.glb", "teapots_galore/TeapotsGalore.gltf",
          "lights_punctual_lamp/LightsPunctualLamp.gltf"}) {
        SCOPED_TRACE(file);
        expect_rest_pose(core::load_gltf(scenes / file));
    }
}

TEST(GltfAnimations, SharedScenesMove) {
    FIELDLIGHT_NEED_SHARED(scenes, "scenes");
    struct Expected {
        const char* file;
        std::size_t animations;
        std::size_t channels;
    };
    // Counted in the files' JSON.
    const Expected expected[] = {{"interpolation_test/InterpolationTest.glb", 9, 9},
                                 {"box_animated/BoxAnimated.glb", 1, 2},
                                 {"cesium_milk_truck/CesiumMilkTruck.glb", 1, 2},
                                 {"recursive_skeletons/RecursiveSkeletons.glb", 1, 840}};
    for (const Expected& scene_file : expected) {
        SCOPED_TRACE(scene_file.file);
        const core::Scene scene = core::load_gltf(scenes / scene_file.file);
        EXPECT_EQ(scene.animations.size(), scene_file.animations);
        std::size_t channels = 0;
        bool moved = false;
        const std::vector<glm::dmat4> rest = core::world_from_nodes(scene.nodes);
        for (const core::Animation& animation : scene.animations) {
            channels += animation.channels.size();
            for (const double part : {0.0, 0.3, 0.7, 1.0}) {
                const auto pose = core::sample(animation, part * core::duration(animation));
                const std::vector<glm::dmat4> world = core::world_from_nodes(scene.nodes, pose);
                for (std::size_t i = 0; i < world.size(); ++i) {
                    for (int column = 0; column < 4; ++column) {
                        for (int row = 0; row < 4; ++row) ASSERT_TRUE(std::isfinite(world[i][column][row]));
                    }
                    moved = moved || world[i] != rest[i];
                }
            }
        }
        EXPECT_EQ(channels, scene_file.channels);
        EXPECT_TRUE(moved);
    }
}

}  // namespace
