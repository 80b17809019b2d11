#include "core/scene/gltf_animations.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "core/scene/gltf_accessors.h"
#include "core/support/error.h"

namespace core {

namespace {

std::optional<AnimatedProperty> property_of(const std::string& path) {
    if (path == "translation") return AnimatedProperty::kTranslation;
    if (path == "rotation") return AnimatedProperty::kRotation;
    if (path == "scale") return AnimatedProperty::kScale;
    if (path == "weights") return AnimatedProperty::kWeights;
    return std::nullopt;
}

Interpolation read_interpolation(const JsonElement& sampler) {
    const std::string name = sampler.text_or("interpolation", "LINEAR");
    if (name == "LINEAR") return Interpolation::kLinear;
    if (name == "STEP") return Interpolation::kStep;
    if (name == "CUBICSPLINE") return Interpolation::kCubicSpline;
    sampler.fail(fmt::format("interpolation '{}' is none of LINEAR, STEP, CUBICSPLINE", name));
}

GltfAccessor open_accessor(const GltfDocument& document, const JsonElement& sampler, const char* key) {
    return {document, sampler.require(key).index(document.count("accessors"), "accessors")};
}

std::vector<float> read_times(GltfDocument& document, const JsonElement& sampler) {
    const GltfAccessor accessor = open_accessor(document, sampler, "input");
    if (accessor.component_count() != 1 || !accessor.is_float()) {
        accessor.element().fail("times of an animation must be SCALAR and float");
    }
    document.charge_memory(accessor.count(), sizeof(float), accessor.element());
    std::vector<float> times;
    times.reserve(accessor.count());
    for (std::size_t i = 0; i < accessor.count(); ++i) {
        const float time = accessor.read(i).x;
        if (!(time >= 0.0f) || !std::isfinite(time)) {
            accessor.element().fail(
                fmt::format("time {} is {}; it must be finite and not negative", i, time));
        }
        if (!times.empty() && time <= times.back()) {
            accessor.element().fail(
                fmt::format("time {} is {} after {}; times must ascend", i, time, times.back()));
        }
        times.push_back(time);
    }
    return times;
}

std::vector<float> read_values(GltfDocument& document, const GltfAccessor& accessor) {
    if (!accessor.is_float() && !accessor.is_normalized()) {
        accessor.element().fail("values of an animation must be float or normalized");
    }
    const auto component_count = static_cast<std::size_t>(accessor.component_count());
    document.charge_memory(accessor.count(), component_count * sizeof(float), accessor.element());
    std::vector<float> values;
    values.reserve(accessor.count() * component_count);
    for (std::size_t i = 0; i < accessor.count(); ++i) {
        const glm::vec4 element = accessor.read(i);
        for (std::size_t c = 0; c < component_count; ++c) {
            const float value = element[static_cast<int>(c)];
            if (!std::isfinite(value)) accessor.element().fail(fmt::format("element {} is not finite", i));
            values.push_back(value);
        }
    }
    return values;
}

/// A key that turns nowhere has no direction to interpolate towards.
void check_rotations(const AnimationSampler& sampler, const JsonElement& output) {
    const bool cubic = sampler.interpolation == Interpolation::kCubicSpline;
    for (std::size_t key = 0; key < sampler.times.size(); ++key) {
        const std::size_t first = 4 * (cubic ? 3 * key + 1 : key);
        bool zero = true;
        for (std::size_t c = 0; c < 4; ++c) zero = zero && sampler.values[first + c] == 0.0f;
        if (zero)
            output.fail(fmt::format("the rotation of key {} is zero; it must be a unit quaternion", key));
    }
}

class AnimationReader {
public:
    AnimationReader(GltfDocument& document, const std::vector<Node>& nodes, const JsonElement& element)
        : document_(document), nodes_(nodes), element_(element) {}

    Animation read() {
        result_.name = element_.text_or("name", "");
        const JsonElement channels = element_.require("channels");
        for (std::size_t i = 0; i < channels.size(); ++i) read_channel(channels.at(i));
        return std::move(result_);
    }

private:
    void read_channel(const JsonElement& channel) {
        const JsonElement target = channel.require("target");
        const std::string path = target.require("path").text();
        const auto node = target.find("node");
        // KHR_animation_pointer names its target in an extension; document-wide warnings tell of it.
        if (!node || path == "pointer") return;
        const std::optional<AnimatedProperty> property = property_of(path);
        if (!property) {
            target.fail(fmt::format("path '{}' is none of translation, rotation, scale, weights", path));
        }
        AnimationChannel result;
        result.property = *property;
        result.node = static_cast<std::uint32_t>(node->index(nodes_.size(), "nodes"));
        if (nodes_[result.node].matrix && *property != AnimatedProperty::kWeights) {
            target.fail(
                fmt::format("node {} has a matrix; an animated node needs translation, rotation and "
                            "scale instead",
                            result.node));
        }
        if (!targets_.emplace(result.node, *property).second) {
            target.fail(fmt::format("{} of node {} has two channels", path, result.node));
        }
        result.sampler = used_sampler(channel, result);
        result_.channels.push_back(result);
    }

    /// Components that the channel's values have.
    std::size_t component_count(const AnimationChannel& channel, const JsonElement& element) const {
        if (channel.property == AnimatedProperty::kRotation) return 4;
        if (channel.property != AnimatedProperty::kWeights) return 3;
        const auto mesh = document_.element("nodes", channel.node).find("mesh");
        if (!mesh) element.fail(fmt::format("animates weights, but node {} has no mesh", channel.node));
        const JsonElement primitives =
            document_.element("meshes", mesh->index(document_.count("meshes"), "meshes"))
                .require("primitives");
        const auto targets = primitives.at(0).find("targets");
        if (!targets || targets->size() == 0) {
            element.fail(fmt::format("animates weights, but {} has no morph targets", primitives.path()));
        }
        return targets->size();
    }

    std::uint32_t used_sampler(const JsonElement& channel, const AnimationChannel& target) {
        const JsonElement samplers = element_.require("samplers");
        const std::size_t index = channel.require("sampler").index(samplers.size(), "samplers");
        const std::size_t wanted = component_count(target, channel);
        const auto known = sampler_of_gltf_.find(index);
        if (known != sampler_of_gltf_.end()) {
            const AnimationSampler& sampler = result_.samplers[known->second];
            if (sampler.component_count != wanted) {
                channel.fail(fmt::format("needs values of {} numbers; those of its sampler have {}", wanted,
                                         sampler.component_count));
            }
            return known->second;
        }
        result_.samplers.push_back(read_sampler(samplers.at(index), target.property, wanted));
        const auto result = static_cast<std::uint32_t>(result_.samplers.size() - 1);
        sampler_of_gltf_.emplace(index, result);
        return result;
    }

    AnimationSampler read_sampler(const JsonElement& element, AnimatedProperty property,
                                  std::size_t components) {
        AnimationSampler sampler;
        sampler.interpolation = read_interpolation(element);
        sampler.component_count = static_cast<std::uint32_t>(components);
        sampler.times = read_times(document_, element);
        const bool cubic = sampler.interpolation == Interpolation::kCubicSpline;
        if (cubic && sampler.times.size() < 2) element.fail("CUBICSPLINE needs at least two keys");
        const GltfAccessor output = open_accessor(document_, element, "output");
        // Weights are single numbers, however many make up a key.
        const bool weights = property == AnimatedProperty::kWeights;
        const std::size_t element_components = weights ? 1 : components;
        if (static_cast<std::size_t>(output.component_count()) != element_components) {
            output.element().fail(fmt::format("has {} components; {} needs {}", output.component_count(),
                                              element.path(), element_components));
        }
        const std::size_t expected =
            sampler.times.size() * (cubic ? 3 : 1) * (weights ? components : std::size_t{1});
        if (output.count() != expected) {
            output.element().fail(fmt::format("has {} elements; the {} times of {} need {}", output.count(),
                                              sampler.times.size(), element.path(), expected));
        }
        sampler.values = read_values(document_, output);
        if (property == AnimatedProperty::kRotation) check_rotations(sampler, output.element());
        return sampler;
    }

    GltfDocument& document_;
    const std::vector<Node>& nodes_;
    const JsonElement& element_;
    Animation result_;
    std::map<std::size_t, std::uint32_t> sampler_of_gltf_;
    std::set<std::pair<std::uint32_t, AnimatedProperty>> targets_;
};

}  // namespace

std::vector<Animation> load_animations(GltfDocument& document, const std::vector<Node>& nodes) {
    std::vector<Animation> animations;
    for (std::size_t i = 0; i < document.count("animations"); ++i) {
        try {
            animations.push_back(AnimationReader(document, nodes, document.element("animations", i)).read());
        } catch (const InputError& error) {
            if (error.kind() == ErrorKind::kOutOfMemory) throw;
            // The scene at rest does not need it, as it does not need a broken buffer that nothing drawn
            // uses.
            document.warn_once(fmt::format("an animation is left out: {}", error.what()));
        }
    }
    return animations;
}

}  // namespace core
