#include "gather/temporal/accumulation.h"

#include <algorithm>
#include <utility>

namespace gather {

namespace {

bool needs_auxiliary(const std::set<std::string>& layers) {
    return std::any_of(layers.begin(), layers.end(), [](const std::string& layer) {
        return layer != "Direct" && layer != "IndirectDiffuse" && layer != "IndirectSpecular";
    });
}

}  // namespace

Accumulation::Accumulation(int width, int height, std::set<std::string> layers, bool controlled)
    : width_(width),
      height_(height),
      layers_(std::move(layers)),
      auxiliary_(needs_auxiliary(layers_)),
      controlled_(controlled) {
    clear();
}

void Accumulation::clear() {
    const std::size_t count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
    sums_.assign(count, Sum{});
    control_sums_.assign(controlled_ ? count : 0, ControlSum{});
    auxiliary_sums_.assign(auxiliary_ ? count : 0, AuxiliarySum{});
}

void Accumulation::add(std::size_t pixel, const FramePixel& value) {
    Sum& sum = sums_[pixel];
    sum.direct += value.direct;
    sum.indirect_diffuse += value.indirect_diffuse;
    sum.indirect_specular += value.indirect_specular;
    sum.count += 1.0f;
    if (value.surface) sum.surface_count += 1.0f;
    if (controlled_) {
        control_sums_[pixel].diffuse += value.diffuse_control;
        control_sums_[pixel].specular += value.specular_control;
    }
    if (!auxiliary_) return;
    AuxiliarySum& more = auxiliary_sums_[pixel];
    more.steps += value.steps;
    if (!value.surface) return;
    more.normal += value.normal;
    more.albedo += value.albedo;
    more.bent_normal += value.bent_normal;
    more.depth += value.depth;
    more.distance += value.distance;
    more.probe_support += value.probe_support;
}

core::Image Accumulation::develop(std::span<const float> control_shares) const {
    core::Image image(width_, height_);
    const std::size_t count = sums_.size();
    std::vector<glm::vec3> colors(count);
    const auto add_color = [&](const char* layer, const auto& color) {
        for (std::size_t i = 0; i < count; ++i) colors[i] = color(i) / sums_[i].count;
        image.add_color(layer, colors);
    };
    // A control variate that leaves less than nothing is noise, and larger than what was found without it.
    const auto controlled = [&](std::size_t i, const glm::vec3& sum, glm::vec3 ControlSum::*control) {
        if (control_sums_.empty()) return sum;
        const glm::vec3 better = sum + control_shares[i] * control_sums_[i].*control;
        return glm::all(glm::greaterThanEqual(better, glm::vec3(0.0f))) ? better : sum;
    };
    const auto direct = [&](std::size_t i) { return sums_[i].direct; };
    const auto diffuse = [&](std::size_t i) {
        return controlled(i, sums_[i].indirect_diffuse, &ControlSum::diffuse);
    };
    const auto specular = [&](std::size_t i) {
        return controlled(i, sums_[i].indirect_specular, &ControlSum::specular);
    };
    add_color("", [&](std::size_t i) { return direct(i) + diffuse(i) + specular(i); });
    std::vector<float>& alpha = image.add_channel("A");
    for (std::size_t i = 0; i < count; ++i) alpha[i] = sums_[i].surface_count / sums_[i].count;
    if (layers_.count("Direct")) add_color("Direct", direct);
    if (layers_.count("IndirectDiffuse")) add_color("IndirectDiffuse", diffuse);
    if (layers_.count("IndirectSpecular")) add_color("IndirectSpecular", specular);
    // Means over the samples that saw a surface.
    const auto share = [&](std::size_t i) {
        return sums_[i].surface_count > 0.0f ? 1.0f / sums_[i].surface_count : 0.0f;
    };
    const auto add_vector = [&](const char* layer, glm::vec3 AuxiliarySum::*member, bool color) {
        if (!layers_.count(layer)) return;
        for (std::size_t i = 0; i < count; ++i) colors[i] = auxiliary_sums_[i].*member * share(i);
        if (color) {
            image.add_color(layer, colors);
        } else {
            image.add_vector(layer, colors);
        }
    };
    const auto add_number = [&](const char* layer, const char* channel, float AuxiliarySum::*member) {
        if (!layers_.count(layer)) return;
        std::vector<float>& values = image.add_channel(channel);
        for (std::size_t i = 0; i < count; ++i) values[i] = auxiliary_sums_[i].*member * share(i);
    };
    add_vector("Normal", &AuxiliarySum::normal, false);
    add_vector("Albedo", &AuxiliarySum::albedo, true);
    add_vector("BentNormal", &AuxiliarySum::bent_normal, false);
    add_number("Depth", "Depth.Z", &AuxiliarySum::depth);
    add_number("HitDistance", "HitDistance.Z", &AuxiliarySum::distance);
    add_number("ProbeWeight", "ProbeWeight.Y", &AuxiliarySum::probe_support);
    if (layers_.count("FilmSamples")) {
        std::vector<float>& values = image.add_channel("FilmSamples.Y");
        for (std::size_t i = 0; i < count; ++i) values[i] = sums_[i].count;
    }
    if (layers_.count("Steps")) {
        std::vector<float>& values = image.add_channel("Steps.Y");
        for (std::size_t i = 0; i < count; ++i) values[i] = auxiliary_sums_[i].steps / sums_[i].count;
    }
    return image;
}

std::uint64_t Accumulation::bytes(int width, int height, const std::set<std::string>& layers) {
    const std::uint64_t channels = 4 + 3 * layers.size();
    return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
           (sizeof(Sum) + (needs_auxiliary(layers) ? sizeof(AuxiliarySum) : 0) + channels * sizeof(float) +
            sizeof(glm::vec3));
}

}  // namespace gather
