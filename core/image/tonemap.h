// core/image/tonemap.h: from radiance to what a monitor shows: exposure, tone curve, sRGB, 8 bits.
//
// Exposure is EV100: displayed = radiance / (1.2 x 2^EV), the saturation-based speed of Lagarde and de
// Rousiers, "Moving Frostbite to Physically Based Rendering", SIGGRAPH 2014 course. It touches pictures for
// the eye alone.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/image/image.h"

namespace core {

enum class ToneMap {
    kAces,    ///< Narkowicz's fit of the ACES film curve ("ACES Filmic Tone Mapping Curve", 2015).
    kLinear,  ///< Clamped to [0, 1].
    kHable,   ///< Hable, "Uncharted 2: HDR Lighting", GDC 2010; exposure bias 2, white point 11.2.
};

/// `aces`, `linear` or `hable`; nothing for another name.
std::optional<ToneMap> tone_map_from_name(std::string_view name);

/// What radiance is multiplied with before the tone curve: 1 / (1.2 x 2^ev).
float exposure_scale(float ev);

/// EV100 of a reflected-light meter (K = 12.5) at the log-average luminance: EV = log2(8 average), so that
/// the average is displayed as 1 / 9.6. Averages over pixels with positive finite luminance and alpha > 0.
/// @param alpha empty, or one value a pixel. Returns 0 where no pixel counts: black stays black at any
/// exposure.
float automatic_exposure(std::span<const glm::vec3> radiance, std::span<const float> alpha = {});

/// The same for the beauty (R, G, B and, if there, A) of an image. @pre image has R, G, B
float automatic_exposure(const Image& image);

/// The tone curve, channel by channel, into [0, 1]. @pre color is finite; negative values count as 0
glm::vec3 tone_curve(ToneMap tone_map, const glm::vec3& color);

/// The sRGB transfer function of IEC 61966-2-1. @pre linear in [0, 1]
float srgb_from_linear(float linear);

/// Its inverse. @pre encoded in [0, 1]
float linear_from_srgb(double encoded);

/// 8-bit sRGB of every pixel, 3 bytes each. Pixels with a NaN or an infinity come out magenta (255, 0, 255),
/// so that they are seen.
std::vector<std::uint8_t> display_picture(std::span<const glm::vec3> radiance, float ev, ToneMap tone_map);

/// The same for the beauty of an image. @pre image has R, G, B
std::vector<std::uint8_t> display_picture(const Image& image, float ev, ToneMap tone_map);

}  // namespace core
