#include "cli/report_colors.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/glm.hpp>

#include "core/image/tonemap.h"

namespace cli {

namespace {

constexpr std::size_t kAnchors = 11;
using Anchors = std::array<std::uint32_t, kAnchors>;

/// Samples of the published maps at even steps; between them colours are mixed in sRGB.
constexpr Anchors kMagmaAnchors = {0x000004, 0x150E37, 0x3B0F70, 0x641A80, 0x8C2981, 0xB63679,
                                   0xDE4968, 0xF76F5C, 0xFE9F6D, 0xFECE91, 0xFCFDBF};
constexpr Anchors kViridisAnchors = {0x440154, 0x482576, 0x414487, 0x35608D, 0x2A788E, 0x21908C,
                                     0x22A884, 0x43BF71, 0x7AD151, 0xBBDF27, 0xFDE725};

const Anchors& anchors_of(HeatMap map) {
    return map == HeatMap::kMagma ? kMagmaAnchors : kViridisAnchors;
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `value`. @pre value > 0
float round_up(float value) {
    const float power = std::pow(10.0f, std::floor(std::log10(value)));
    for (const float digit : {1.0f, 2.0f, 5.0f})
        if (digit * power >= value) return digit * power;
    return 10.0f * power;
}

int displayed_level(float linear) {
    const glm::vec3 displayed = core::tone_curve(core::ToneMap::kAces, glm::vec3(linear));
    return static_cast<int>(std::lround(255.0f * core::srgb_from_linear(displayed.r)));
}

}  // namespace

std::array<std::uint8_t, 3> heat_color(HeatMap map, float value) {
    if (std::isnan(value)) return {255, 0, 255};
    const Anchors& anchors = anchors_of(map);
    const float at = std::clamp(value, 0.0f, 1.0f) * static_cast<float>(kAnchors - 1);
    const auto first = std::min(static_cast<std::size_t>(at), kAnchors - 2);
    const float part = at - static_cast<float>(first);
    std::array<std::uint8_t, 3> color{};
    for (unsigned i = 0; i < 3; ++i) {
        const auto level = [&](std::size_t anchor) {
            return static_cast<float>(anchors[anchor] >> (16 - 8 * i) & 0xFFu);
        };
        color[i] =
            static_cast<std::uint8_t>(std::lround(level(first) + part * (level(first + 1) - level(first))));
    }
    return color;
}

float HeatScale::at(float value) const {
    if (!std::isfinite(value)) return std::nanf("");
    if (!logarithmic) return std::clamp((value - low) / (high - low), 0.0f, 1.0f);
    return std::clamp(std::log(std::max(value, low) / low) / std::log(high / low), 0.0f, 1.0f);
}

HeatScale steps_scale(std::vector<float> steps) {
    std::erase_if(steps, [](float value) { return !std::isfinite(value); });
    if (steps.empty()) return {HeatMap::kViridis, 0.0f, 1.0f, false};
    const std::size_t rank = steps.size() - 1 - steps.size() / 1000;
    const auto nth = steps.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(steps.begin(), nth, steps.end());
    return {HeatMap::kViridis, 0.0f, round_up(std::max(*nth, 1.0f)), false};
}

std::vector<std::uint8_t> heat_picture(std::span<const float> values, const HeatScale& scale) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(3 * values.size());
    for (const float value : values) {
        const auto color = heat_color(scale.map, scale.at(value));
        bytes.insert(bytes.end(), color.begin(), color.end());
    }
    return bytes;
}

std::string css_gradient(HeatMap map) {
    std::string css = "linear-gradient(to right";
    for (const std::uint32_t color : anchors_of(map)) css += fmt::format(",#{:06x}", color);
    return css + ")";
}

std::string color_table(HeatMap map) {
    std::string table;
    for (int i = 0; i < 256; ++i)
        for (const std::uint8_t level : heat_color(map, static_cast<float>(i) / 255.0f))
            table += static_cast<char>(level);
    return table;
}

std::array<float, 255> tone_thresholds() {
    std::array<float, 255> thresholds{};
    for (int level = 1; level <= 255; ++level) {
        // Bits of positive floats are in the order of the floats.
        std::uint32_t below = std::bit_cast<std::uint32_t>(0.0f),
                      reached = std::bit_cast<std::uint32_t>(1e6f);
        while (reached - below > 1) {
            const std::uint32_t middle = below + (reached - below) / 2;
            (displayed_level(std::bit_cast<float>(middle)) >= level ? reached : below) = middle;
        }
        thresholds[static_cast<std::size_t>(level - 1)] = std::bit_cast<float>(reached);
    }
    return thresholds;
}

}  // namespace cli
