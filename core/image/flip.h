// core/image/flip.h: how different two pictures look when one flips between them, in [0, 1].
//
// LDR: Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom and Fairchild, "FLIP: A Difference Evaluator for
// Alternating Images", HPG 2020. HDR: Andersson, Nilsson, Shirley and Akenine-Moller, "Visualizing Errors in
// Rendered High Dynamic Range Images", Eurographics 2021.
//
// Where we differ from the published code: the exposures of HDR FLIP come from the median of the *positive*
// luminances, so that a dark room is not "identical" to everything; a non-finite pixel spoils the numbers
// instead of counting as black.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <numbers>
#include <span>
#include <vector>

namespace core {

/// Of a 4K monitor, 0.7 m wide and 0.7 m away.
inline constexpr double kFlipPixelsPerDegree = 0.7 * 3840 / 0.7 * std::numbers::pi / 180;

/// A map of errors and what it comes to. With any non-finite pixel all numbers are NaN: a broken pixel is a
/// failure, never one to skip.
struct FlipResult {
    /// Error of each pixel, row-major, [0, 1]. NaN at pixels with a NaN or infinity in either picture; both
    /// pictures count as black there for the pixels around.
    std::vector<float> map;

    double mean = 0.0;
    /// Half of the sum of all errors lies in pixels with at most this error (the smallest such value); the
    /// quartiles are the same for a quarter and three. 0 for equal pictures.
    double weighted_median = 0.0;
    double first_quartile = 0.0, third_quartile = 0.0;
    double min = 0.0, max = 0.0;

    /// Exposures of the HDR form, ascending, in stops: radiance is multiplied with 2^exposure, tone-mapped
    /// and compared; the map is the maximum. Empty for LDR and for two black pictures.
    std::vector<double> exposures;
    std::size_t nonfinite_pixels = 0;  ///< With a NaN or infinity in either picture.
};

/// True where every value lies in [0, 1], so that LDR FLIP is defined.
bool is_low_dynamic_range(std::span<const glm::vec3> picture);

/// LDR FLIP of linear RGB in [0, 1]; other values are clamped. Same bits at any thread count.
/// @pre test.size() == reference.size() == width * height > 0 and pixels_per_degree >= 1
FlipResult flip_ldr(std::span<const glm::vec3> test, std::span<const glm::vec3> reference, int width,
                    int height, double pixels_per_degree = kFlipPixelsPerDegree);

/// HDR FLIP of linear radiance: the largest LDR error of each pixel over N exposures, each tone-mapped with
/// ACES (Narkowicz's fit of 0.6 x). Asymmetric: exposures come from the reference's Rec. 709 luminance Y.
/// With x_max the radiance shown as 0.85, they run evenly from log2(x_max / max Y) to log2(x_max / median Y
/// over Y > 0), the upper median, and N = max(2, ceil(last - first)); N = 1 where both are equal, as in a
/// constant picture. Where the reference has no positive luminance, the test's is taken, so that light in
/// darkness is judged as bright as it is shown; two pictures without any are equal. Negative values are 0.
/// @pre as flip_ldr
FlipResult flip_hdr(std::span<const glm::vec3> test, std::span<const glm::vec3> reference, int width,
                    int height, double pixels_per_degree = kFlipPixelsPerDegree);

/// The magma colour map of Smith and van der Walt (matplotlib, 2015) as display sRGB in [0, 1], black at 0 to
/// pale yellow at 1; clamps. NaN is magenta (1, 0, 1), as broken pixels are everywhere.
glm::vec3 magma(float value);

}  // namespace core
