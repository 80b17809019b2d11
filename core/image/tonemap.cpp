#include "core/image/tonemap.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace core {

namespace {

/// Of a reflected-light meter, over the speed of EV100: EV = log2(luminance x 100 / 12.5).
constexpr double kLuminanceToExposure = 100.0 / 12.5;

bool is_finite(const glm::vec3& color) {
    return std::isfinite(color.r) && std::isfinite(color.g) && std::isfinite(color.b);
}

float aces_curve(float x) {
    return (x * (2.51f * x + 0.03f)) / (x * (2.43f * x + 0.59f) + 0.14f);
}

float hable_filmic(float x) {
    constexpr float kShoulder = 0.15f, kLinear = 0.50f, kLinearAngle = 0.10f, kToe = 0.20f;
    constexpr float kToeNumerator = 0.02f, kToeDenominator = 0.30f;
    return (x * (kShoulder * x + kLinearAngle * kLinear) + kToe * kToeNumerator) /
               (x * (kShoulder * x + kLinear) + kToe * kToeDenominator) -
           kToeNumerator / kToeDenominator;
}

float hable_curve(float x) {
    constexpr float kExposureBias = 2.0f, kWhite = 11.2f;
    return hable_filmic(kExposureBias * x) / hable_filmic(kWhite);
}

float curve(ToneMap tone_map, float value) {
    // Both fits are quotients of squares, which overflow; all curves have reached 1 long before.
    const float x = std::clamp(value, 0.0f, 1e6f);
    switch (tone_map) {
        case ToneMap::kAces:
            return std::clamp(aces_curve(x), 0.0f, 1.0f);
        case ToneMap::kHable:
            return std::clamp(hable_curve(x), 0.0f, 1.0f);
        case ToneMap::kLinear:
            break;
    }
    return std::min(x, 1.0f);
}

}  // namespace

std::optional<ToneMap> tone_map_from_name(std::string_view name) {
    if (name == "aces") return ToneMap::kAces;
    if (name == "linear") return ToneMap::kLinear;
    if (name == "hable") return ToneMap::kHable;
    return std::nullopt;
}

float exposure_scale(float ev) {
    return 1.0f / (1.2f * std::exp2(ev));
}

float automatic_exposure(std::span<const glm::vec3> radiance, std::span<const float> alpha) {
    assert(alpha.empty() || alpha.size() == radiance.size());
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < radiance.size(); ++i) {
        if (!alpha.empty() && !(alpha[i] > 0.0f)) continue;
        const float value = luminance(radiance[i]);
        if (!(value > 0.0f) || !std::isfinite(value)) continue;
        sum += std::log2(static_cast<double>(value));
        ++count;
    }
    if (count == 0) return 0.0f;
    return static_cast<float>(sum / static_cast<double>(count) + std::log2(kLuminanceToExposure));
}

float automatic_exposure(const Image& image) {
    const auto radiance = image.color();
    assert(radiance);
    const std::vector<float>* alpha = image.find("A");
    return automatic_exposure(*radiance, alpha ? std::span<const float>(*alpha) : std::span<const float>());
}

glm::vec3 tone_curve(ToneMap tone_map, const glm::vec3& color) {
    return {curve(tone_map, color.r), curve(tone_map, color.g), curve(tone_map, color.b)};
}

float srgb_from_linear(float linear) {
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float linear_from_srgb(double encoded) {
    return static_cast<float>(encoded <= 0.04045 ? encoded / 12.92
                                                 : std::pow((encoded + 0.055) / 1.055, 2.4));
}

std::vector<std::uint8_t> display_picture(std::span<const glm::vec3> radiance, float ev, ToneMap tone_map) {
    const float scale = exposure_scale(ev);
    std::vector<std::uint8_t> bytes;
    bytes.reserve(3 * radiance.size());
    for (const glm::vec3& color : radiance) {
        if (!is_finite(color)) {
            bytes.insert(bytes.end(), {255, 0, 255});
            continue;
        }
        const glm::vec3 displayed = tone_curve(tone_map, color * scale);
        for (int i = 0; i < 3; ++i) {
            bytes.push_back(static_cast<std::uint8_t>(std::lround(255.0f * srgb_from_linear(displayed[i]))));
        }
    }
    return bytes;
}

std::vector<std::uint8_t> display_picture(const Image& image, float ev, ToneMap tone_map) {
    const auto radiance = image.color();
    assert(radiance);
    return display_picture(*radiance, ev, tone_map);
}

}  // namespace core
