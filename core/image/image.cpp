#include "core/image/image.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace core {

namespace {

std::string channel_name(std::string_view layer, char component) {
    std::string name(layer);
    if (!name.empty()) name += '.';
    return name + component;
}

void add_planes(Image& image, std::string_view layer, const char (&components)[4],
                const std::vector<glm::vec3>& vectors) {
    assert(vectors.size() == image.pixel_count());
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<float> plane(vectors.size());
        std::transform(vectors.begin(), vectors.end(), plane.begin(),
                       [axis](const glm::vec3& vector) { return vector[axis]; });
        image.add_channel(channel_name(layer, components[axis]), std::move(plane));
    }
}

}  // namespace

std::vector<float>& Image::add_channel(std::string name, float fill) {
    add_channel(std::move(name), std::vector<float>(pixel_count(), fill));
    return channels_.back().values;
}

void Image::add_channel(std::string name, std::vector<float> values) {
    assert(values.size() == pixel_count());
    assert(find(name) == nullptr);
    channels_.push_back({std::move(name), std::move(values)});
}

void Image::add_color(std::string_view layer, const std::vector<glm::vec3>& colors) {
    add_planes(*this, layer, "RGB", colors);
}

void Image::add_vector(std::string_view layer, const std::vector<glm::vec3>& vectors) {
    add_planes(*this, layer, "XYZ", vectors);
}

const std::vector<float>* Image::find(std::string_view name) const {
    const auto found = std::find_if(channels_.begin(), channels_.end(),
                                    [name](const Channel& channel) { return channel.name == name; });
    return found == channels_.end() ? nullptr : &found->values;
}

std::vector<float>* Image::find(std::string_view name) {
    return const_cast<std::vector<float>*>(std::as_const(*this).find(name));
}

std::optional<std::vector<glm::vec3>> Image::color(std::string_view layer) const {
    const std::vector<float>* red = find(channel_name(layer, 'R'));
    const std::vector<float>* green = find(channel_name(layer, 'G'));
    const std::vector<float>* blue = find(channel_name(layer, 'B'));
    if (!red || !green || !blue) return std::nullopt;
    std::vector<glm::vec3> colors(pixel_count());
    for (std::size_t i = 0; i < colors.size(); ++i) colors[i] = {(*red)[i], (*green)[i], (*blue)[i]};
    return colors;
}

std::size_t count_nonfinite(const Image& image) {
    std::size_t count = 0;
    for (const Channel& channel : image.channels()) {
        count += static_cast<std::size_t>(std::count_if(channel.values.begin(), channel.values.end(),
                                                        [](float value) { return !std::isfinite(value); }));
    }
    return count;
}

}  // namespace core
