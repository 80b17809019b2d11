#include "cli/report_colors.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/glm.hpp>

#include "core/image/flip.h"
#include "core/image/tonemap.h"

namespace cli {

namespace {

/// Samples of the published viridis at even steps; between them colours are mixed in sRGB.
constexpr std::array<std::uint32_t, 11> kViridis = {0x440154, 0x482576, 0x414487, 0x35608D,
                                                    0x2A788E, 0x21908C, 0x22A884, 0x43BF71,
                                                    0x7AD151, 0xBBDF27, 0xFDE725};

glm::vec3 viridis(float value) {
    const float at = std::clamp(value, 0.0f, 1.0f) * static_cast<float>(kViridis.size() - 1);
    const auto first = std::min(static_cast<std::size_t>(at), kViridis.size() - 2);
    const auto color = [](std::uint32_t rgb) {
        return glm::vec3(rgb >> 16, rgb >> 8 & 0xFFu, rgb & 0xFFu) / 255.0f;
    };
    return glm::mix(color(kViridis[first]), color(kViridis[first + 1]), at - static_cast<float>(first));
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
    const glm::vec3 color = map == HeatMap::kMagma ? core::magma(value) : viridis(value);
    std::array<std::uint8_t, 3> levels{};
    for (int i = 0; i < 3; ++i)
        levels[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::lround(255.0f * color[i]));
    return levels;
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
    for (int i = 0; i <= 16; ++i) {
        const auto color = heat_color(map, static_cast<float>(i) / 16.0f);
        css += fmt::format(",#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
    }
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
