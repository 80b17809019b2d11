#include "core/scene/animation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {

using core::AnimatedProperty;
using core::Interpolation;

/// Rounding of a few double operations on numbers near one.
constexpr double kRounding = 1e-12;

const double kHalf = std::sqrt(0.5);

core::AnimationSampler sampler_of(Interpolation interpolation, std::vector<float> times,
                                  std::vector<float> values) {
    const std::size_t keys = times.size() * (interpolation == Interpolation::kCubicSpline ? 3 : 1);
    core::AnimationSampler sampler;
    sampler.interpolation = interpolation;
    sampler.component_count = static_cast<std::uint32_t>(values.size() / keys);
    sampler.times = std::move(times);
    sampler.values = std::move(values);
    return sampler;
}

void expect_values(const std::vector<double>& values, const std::vector<double>& expected) {
    ASSERT_EQ(values.size(), expected.size());
    // Keys are floats, so those of sqrt(1/2) are off by 1e-8.
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-7) << i;
}

TEST(Animation, LinearGoesStraightFromKeyToKey) {
    const auto sampler = sampler_of(Interpolation::kLinear, {1, 2, 4}, {0, 0, 0, 10, 20, 30, 10, 0, 50});
    EXPECT_EQ(sample(sampler, false, 1.25), (std::vector<double>{2.5, 5, 7.5}));
    EXPECT_EQ(sample(sampler, false, 3.0), (std::vector<double>{10, 10, 40}));
    EXPECT_EQ(sample(sampler, false, 2.0), (std::vector<double>{10, 20, 30}));
}

TEST(Animation, TimesOutsideTheKeysHoldTheFirstAndTheLast) {
    for (const Interpolation interpolation : {Interpolation::kLinear, Interpolation::kStep}) {
        const auto sampler = sampler_of(interpolation, {1, 2}, {3, 4});
        EXPECT_EQ(sample(sampler, false, -5.0), std::vector<double>{3});
        EXPECT_EQ(sample(sampler, false, 0.5), std::vector<double>{3});
        EXPECT_EQ(sample(sampler, false, 2.0), std::vector<double>{4});
        EXPECT_EQ(sample(sampler, false, 1e9), std::vector<double>{4});
    }
    const auto cubic = sampler_of(Interpolation::kCubicSpline, {1, 2}, {9, 3, 9, 9, 4, 9});
    EXPECT_EQ(sample(cubic, false, 0.0), std::vector<double>{3});
    EXPECT_EQ(sample(cubic, false, 3.0), std::vector<double>{4});
    EXPECT_EQ(sample(sampler_of(Interpolation::kLinear, {1}, {7}), false, 1.0), std::vector<double>{7});
}

TEST(Animation, StepHoldsUntilTheNextKey) {
    const auto sampler = sampler_of(Interpolation::kStep, {0, 1, 2}, {5, 6, 7});
    EXPECT_EQ(sample(sampler, false, 0.999), std::vector<double>{5});
    EXPECT_EQ(sample(sampler, false, 1.0), std::vector<double>{6});
    EXPECT_EQ(sample(sampler, false, 1.999), std::vector<double>{6});
}

TEST(Animation, CubicSplinesAreTheHermitePolynomial) {
    // Over 2 s from 1 with slope 3 / s to 5 with slope -2 / s. At t = 1/4:
    // 27/32 * 1 + 2 * 9/64 * 3 + 5/32 * 5 + 2 * (-3/64) * (-2) = 2.65625.
    const auto sampler = sampler_of(Interpolation::kCubicSpline, {1, 3}, {99, 1, 3, -2, 5, 99});
    EXPECT_NEAR(sample(sampler, false, 1.5).at(0), 2.65625, kRounding);
    // The slope at the first key is the out-tangent: a difference quotient, off by its second order.
    EXPECT_NEAR((sample(sampler, false, 1.0 + 1e-6).at(0) - 1.0) / 1e-6, 3.0, 1e-5);
    EXPECT_NEAR((5.0 - sample(sampler, false, 3.0 - 1e-6).at(0)) / 1e-6, -2.0, 1e-5);
}

TEST(Animation, RotationsTurnEvenlyAlongTheArc) {
    const auto h = static_cast<float>(kHalf);
    // From none to a quarter turn about y.
    const auto sampler = sampler_of(Interpolation::kLinear, {0, 3}, {0, 0, 0, 1, 0, h, 0, h});
    for (const double t : {0.25, 1.0, 2.0, 2.9}) {
        const double half_angle = t / 3.0 * std::numbers::pi / 4.0;
        expect_values(sample(sampler, true, t), {0, std::sin(half_angle), 0, std::cos(half_angle)});
    }
}

TEST(Animation, RotationsTakeTheShorterWay) {
    const auto h = static_cast<float>(kHalf);
    // The same quarter turn, written with the opposite sign.
    const auto sampler = sampler_of(Interpolation::kLinear, {0, 2}, {0, 0, 0, 1, 0, -h, 0, -h});
    const double eighth = std::numbers::pi / 8.0;
    expect_values(sample(sampler, true, 1.0), {0, std::sin(eighth), 0, std::cos(eighth)});
}

TEST(Animation, EqualRotationsStand) {
    const auto h = static_cast<float>(kHalf);
    for (const float sign : {1.0f, -1.0f}) {
        const auto sampler =
            sampler_of(Interpolation::kLinear, {0, 1}, {h, 0, 0, h, sign * h, 0, 0, sign * h});
        expect_values(sample(sampler, true, 0.3), {kHalf, 0, 0, kHalf});
    }
}

TEST(Animation, SampledRotationsAreUnit) {
    // Keys of a length other than one, and a spline that bulges.
    const auto linear = sampler_of(Interpolation::kLinear, {0, 1}, {0, 0, 0, 2, 0, 0.5f, 0, 0});
    const auto cubic =
        sampler_of(Interpolation::kCubicSpline, {0, 1}, {0, 0, 0, 0, 0, 0, 0, 1, 5, 0, 0, 0,  //
                                                         0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0});
    for (const auto* sampler : {&linear, &cubic}) {
        for (const double time : {-1.0, 0.0, 0.2, 0.5, 0.9, 1.0}) {
            double square = 0.0;
            for (const double component : sample(*sampler, true, time)) square += component * component;
            EXPECT_NEAR(square, 1.0, kRounding) << time;
        }
    }
}

TEST(Animation, ASplineThroughZeroKeepsItsLastRotation) {
    const auto sampler =
        sampler_of(Interpolation::kCubicSpline, {0, 1}, {0, 0, 0, 0, 0, 0, 0, 1,  0, 0, 0, 0,  //
                                                         0, 0, 0, 0, 0, 0, 0, -1, 0, 0, 0, 0});
    expect_values(sample(sampler, true, 0.5), {0, 0, 0, 1});
}

TEST(Animation, ChannelsComeTogetherByNode) {
    core::Animation animation;
    animation.samplers = {
        sampler_of(Interpolation::kLinear, {0, 2}, {0, 0, 0, 4, 0, 0}),
        sampler_of(Interpolation::kStep, {0, 3}, {0, 0, 0, 1, 1, 0, 0, 0}),
        sampler_of(Interpolation::kLinear, {0, 1}, {0, 1, 1, 0}),
    };
    animation.channels = {{2, 7, AnimatedProperty::kWeights},
                          {0, 3, AnimatedProperty::kTranslation},
                          {0, 7, AnimatedProperty::kScale},
                          {1, 3, AnimatedProperty::kRotation}};
    EXPECT_EQ(core::duration(animation), 3.0);
    const std::vector<core::NodePose> poses = core::sample(animation, 0.5);
    ASSERT_EQ(poses.size(), 2u);
    EXPECT_EQ(poses[0].node, 3u);
    EXPECT_EQ(poses[0].translation, glm::dvec3(1, 0, 0));
    EXPECT_EQ(poses[0].rotation, glm::dquat(1, 0, 0, 0));
    EXPECT_FALSE(poses[0].scale.has_value());
    EXPECT_TRUE(poses[0].weights.empty());
    EXPECT_EQ(poses[1].node, 7u);
    EXPECT_EQ(poses[1].scale, glm::dvec3(1, 0, 0));
    EXPECT_EQ(poses[1].weights, (std::vector<double>{0.5, 0.5}));
}

TEST(Nodes, StandUnderTheirParentsInAnyOrder) {
    std::vector<core::Node> nodes(3);
    nodes[0].parent = 2;
    nodes[0].translation = {1, 0, 0};
    nodes[1].parent = 0;
    nodes[1].translation = {0, 1, 0};
    nodes[2].rotation = glm::dquat(kHalf, 0, 0, kHalf);  // A quarter turn about z.
    nodes[2].scale = {2, 2, 2};
    const std::vector<glm::dmat4> world = core::world_from_nodes(nodes);
    const glm::dvec3 grandchild(world[1][3]);
    // x turns to y, y to -x, both twice as far.
    EXPECT_NEAR(grandchild.x, -2.0, kRounding);
    EXPECT_NEAR(grandchild.y, 2.0, kRounding);
}

TEST(Nodes, APoseMovesWhatHangsBelow) {
    std::vector<core::Node> nodes(2);
    nodes[0].translation = {5, 5, 5};
    nodes[0].scale = {3, 3, 3};
    nodes[1].parent = 0;
    nodes[1].matrix = glm::dmat4(1.0);
    (*nodes[1].matrix)[3] = glm::dvec4(1, 0, 0, 1);
    core::NodePose pose;
    pose.node = 0;
    pose.translation = glm::dvec3(0, 7, 0);
    const std::vector<glm::dmat4> world = core::world_from_nodes(nodes, std::span(&pose, 1));
    EXPECT_EQ(world[1][3], glm::dvec4(3, 7, 0, 1)) << "the scale stays as at rest";
}

TEST(Nodes, DeepChainsAreWalkedWithoutRecursion) {
    std::vector<core::Node> nodes(200'000);
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
        nodes[i].translation = {1, 0, 0};
        if (i + 1 < nodes.size()) nodes[i].parent = i + 1;
    }
    EXPECT_EQ(core::world_from_nodes(nodes)[0][3].x, 200'000.0);
}

}  // namespace
