// core/scene/animation.h: how nodes move over time, and where they are at one.
//
// Khronos Group, "glTF 2.0 Specification", 2021, section 3.11 and appendix C: step, linear (spherical for
// rotations) and cubic spline interpolation.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/scene/node.h"

namespace core {

enum class Interpolation : std::uint8_t { kLinear, kStep, kCubicSpline };
enum class AnimatedProperty : std::uint8_t { kTranslation, kRotation, kScale, kWeights };

/// Key frames of one value.
struct AnimationSampler {
    Interpolation interpolation = Interpolation::kLinear;
    std::uint32_t component_count = 0;  ///< 3, 4 (rotations: x, y, z, w), or the number of morph targets.
    std::vector<float> times;           ///< Seconds, >= 0, strictly ascending, at least one.
    /// component_count for each time; with cubic splines three times that: in-tangent, value, out-tangent.
    std::vector<float> values;
};

/// Lets a sampler drive a property of a node.
struct AnimationChannel {
    std::uint32_t sampler = 0;  ///< Index into Animation::samplers.
    std::uint32_t node = 0;     ///< Index into Scene::nodes.
    AnimatedProperty property = AnimatedProperty::kTranslation;
};

struct Animation {
    std::string name;
    std::vector<AnimationSampler> samplers;
    std::vector<AnimationChannel> channels;  ///< No two drive the same property of a node.
};

/// The last key's time over all channels, in seconds; 0 without any.
double duration(const Animation& animation);

/// The value at `time`, component_count numbers; before the first key and after the last, those keys' own.
/// @param rotation whether the values are quaternions, whose result is unit. @pre `time` is finite.
std::vector<double> sample(const AnimationSampler& sampler, bool rotation, double time);

/// What the animation makes of each node it drives, by ascending node. @pre `time` (seconds) is finite.
std::vector<NodePose> sample(const Animation& animation, double time);

}  // namespace core
