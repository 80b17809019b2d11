#include "core/scene/animation.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

namespace core {

namespace {

using Values = std::vector<double>;

/// A key's numbers. @param part of the triple of a cubic spline: 0 in-tangent, 1 value, 2 out-tangent.
Values key_values(const AnimationSampler& sampler, std::size_t key, std::size_t part = 1) {
    const std::size_t count = sampler.component_count;
    const bool cubic = sampler.interpolation == Interpolation::kCubicSpline;
    const auto first =
        sampler.values.begin() + static_cast<std::ptrdiff_t>(count * (cubic ? 3 * key + part : key));
    return {first, first + static_cast<std::ptrdiff_t>(count)};
}

void add_scaled(Values& sum, double weight, const Values& values) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += weight * values[i];
}

double dot(const Values& a, const Values& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

/// A spline may pass through zero, where no rotation is closer than another; then `fallback` holds.
Values normalized(Values quaternion, const Values& fallback) {
    const double length = std::sqrt(dot(quaternion, quaternion));
    if (!(length > 0.0) || !std::isfinite(length)) return fallback;
    for (double& component : quaternion) component /= length;
    return quaternion;
}

Values linear(const Values& from, const Values& to, double t) {
    Values result(from.size(), 0.0);
    add_scaled(result, 1.0 - t, from);
    add_scaled(result, t, to);
    return result;
}

/// Along the shorter arc: q and -q turn alike. @pre both are unit
Values spherical(const Values& from, const Values& to, double t) {
    const double cosine = dot(from, to);
    const double sign = cosine < 0.0 ? -1.0 : 1.0;
    const double angle = std::acos(std::min(std::abs(cosine), 1.0));
    const double sine = std::sin(angle);
    Values result(4, 0.0);
    // Under this the ratio of sines is that of the angles, to all digits of a double.
    const bool close = angle < 1e-8;
    add_scaled(result, close ? 1.0 - t : std::sin((1.0 - t) * angle) / sine, from);
    add_scaled(result, sign * (close ? t : std::sin(t * angle) / sine), to);
    return result;
}

/// Hermite between two keys, whose tangents are per second.
Values cubic(const AnimationSampler& sampler, std::size_t key, double t, double seconds) {
    const double t2 = t * t;
    const double t3 = t2 * t;
    Values result(sampler.component_count, 0.0);
    add_scaled(result, 2.0 * t3 - 3.0 * t2 + 1.0, key_values(sampler, key));
    add_scaled(result, seconds * (t3 - 2.0 * t2 + t), key_values(sampler, key, 2));
    add_scaled(result, -2.0 * t3 + 3.0 * t2, key_values(sampler, key + 1));
    add_scaled(result, seconds * (t3 - t2), key_values(sampler, key + 1, 0));
    return result;
}

NodePose& pose_of(std::vector<NodePose>& poses, std::uint32_t node) {
    const auto place =
        std::lower_bound(poses.begin(), poses.end(), node,
                         [](const NodePose& pose, std::uint32_t wanted) { return pose.node < wanted; });
    if (place != poses.end() && place->node == node) return *place;
    NodePose pose;
    pose.node = node;
    return *poses.insert(place, std::move(pose));
}

}  // namespace

double duration(const Animation& animation) {
    double result = 0.0;
    for (const AnimationChannel& channel : animation.channels) {
        result = std::max(result, double{animation.samplers[channel.sampler].times.back()});
    }
    return result;
}

std::vector<double> sample(const AnimationSampler& sampler, bool rotation, double time) {
    const std::vector<float>& times = sampler.times;
    assert(!times.empty() && std::isfinite(time));
    const auto unit_if_rotation = [&](Values values, const Values& fallback) {
        return rotation ? normalized(std::move(values), fallback) : std::move(values);
    };
    const auto next = std::upper_bound(times.begin(), times.end(), time,
                                       [](double wanted, float key) { return wanted < double{key}; });
    const std::size_t key = next == times.begin() ? 0 : static_cast<std::size_t>(next - times.begin()) - 1;
    const Values identity = {0.0, 0.0, 0.0, 1.0};
    Values from = unit_if_rotation(key_values(sampler, key), identity);
    if (next == times.begin() || next == times.end() || sampler.interpolation == Interpolation::kStep) {
        return from;
    }
    const double seconds = double{times[key + 1]} - double{times[key]};
    const double t = (time - double{times[key]}) / seconds;
    if (sampler.interpolation == Interpolation::kCubicSpline) {
        return unit_if_rotation(cubic(sampler, key, t, seconds), from);
    }
    const Values to = unit_if_rotation(key_values(sampler, key + 1), identity);
    return rotation ? normalized(spherical(from, to, t), from) : linear(from, to, t);
}

std::vector<NodePose> sample(const Animation& animation, double time) {
    std::vector<NodePose> poses;
    for (const AnimationChannel& channel : animation.channels) {
        const bool rotation = channel.property == AnimatedProperty::kRotation;
        Values value = sample(animation.samplers[channel.sampler], rotation, time);
        NodePose& pose = pose_of(poses, channel.node);
        switch (channel.property) {
            case AnimatedProperty::kTranslation:
                pose.translation = glm::dvec3(value[0], value[1], value[2]);
                break;
            case AnimatedProperty::kRotation:
                pose.rotation = glm::dquat(value[3], value[0], value[1], value[2]);
                break;
            case AnimatedProperty::kScale:
                pose.scale = glm::dvec3(value[0], value[1], value[2]);
                break;
            case AnimatedProperty::kWeights:
                pose.weights = std::move(value);
                break;
        }
    }
    return poses;
}

}  // namespace core
