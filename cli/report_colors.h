// cli/report_colors.h: the colours in which the report's maps are drawn, by the program and by the viewer.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace cli {

/// Colour maps whose lightness rises evenly, of Smith and van der Walt (matplotlib, 2015).
enum class HeatMap {
    kMagma,    ///< For errors: FLIP is published in it.
    kViridis,  ///< For counts.
};

/// Display sRGB of `value`, clamped to [0, 1]; magenta (255, 0, 255) for NaN, as in tone-mapped pictures.
std::array<std::uint8_t, 3> heat_color(HeatMap map, float value);

/// What value a map shows as its darkest and its brightest colour.
struct HeatScale {
    HeatMap map = HeatMap::kMagma;
    float low = 0.0f, high = 1.0f;
    bool logarithmic = false;

    /// Where a value lies between them, [0, 1]; NaN where it is not finite.
    float at(float value) const;
};

inline constexpr HeatScale kFlipScale = {HeatMap::kMagma, 0.0f, 1.0f, false};
inline constexpr HeatScale kErrorScale = {HeatMap::kMagma, 0.001f, 1.0f, true};

/// Steps up to a round number that at most 0.1 % of `steps` exceed. At least 1.
HeatScale steps_scale(std::vector<float> steps);

/// 8-bit sRGB of a map, 3 bytes a value.
std::vector<std::uint8_t> heat_picture(std::span<const float> values, const HeatScale& scale);

/// A CSS gradient from low to high, for a legend.
std::string css_gradient(HeatMap map);

/// 256 colours, 3 bytes each: heat_color of i / 255.
std::string color_table(HeatMap map);

/// The radiance at which the ACES preview changes: entry k - 1 is the smallest float32 that, times the
/// exposure scale, is shown as 8-bit level k or more. A viewer that counts the entries not above a value
/// shows the very level that core::display_picture writes.
std::array<float, 255> tone_thresholds();

}  // namespace cli
