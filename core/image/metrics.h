// core/image/metrics.h: how far a picture is from its reference, in numbers whose definitions stand beside
// them.
//
// I is the picture under test, R the reference, both linear Rec. 709. Sums are doubles in row order. Means
// run over pixels and the three channels; Y is Rec. 709 luminance. Denominators use |R|: radiance is not
// negative, but a file may be.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>

namespace core {

/// Light where the reference has none. Dark pixels: Y_R <= 1e-4 x median of Y_R over pixels with Y_R > 0 (the
/// upper median); where the reference is black everywhere, all pixels are dark.
struct LeakMetric {
    /// Sum of max(Y_I - Y_R, 0) over dark pixels / sum of Y_R over all; NaN beside a black reference.
    double energy_fraction = 0.0;
    double mean = 0.0;   ///< Mean Y_I over dark pixels; 0 where there are none.
    double p99_9 = 0.0;  ///< 99.9th percentile of Y_I over dark pixels.
    std::size_t dark_pixels = 0;
    double lit_bias_percent =
        0.0;  ///< 100 (sum Y_I / sum Y_R - 1) over the other pixels; NaN where there are none.
    /// The lit side is right within 2 %. Otherwise the leak means nothing: darkness leaks nothing.
    bool counts = false;
};

/// Differences of two pictures. With any non-finite pixel all numbers but the counts are NaN: a broken pixel
/// is a failure, never one to skip.
struct ImageMetrics {
    std::size_t nonfinite_pixels = 0;            ///< Pixels with a NaN or infinity in I or in R.
    std::size_t nonfinite_test_pixels = 0;       ///< In I.
    std::size_t nonfinite_reference_pixels = 0;  ///< In R.

    double mse = 0.0;      ///< mean (I - R)^2
    double rel_mse = 0.0;  ///< mean (I - R)^2 / (R^2 + 0.01)
    /// rel_mse without the floor(0.001 n) pixels where its mean over the channels is largest.
    double rel_mse_trimmed = 0.0;
    double mrse = 0.0;   ///< mean (I - R)^2 / (|R| + 0.01)^2, as pbrt
    double mape = 0.0;   ///< mean |I - R| / (|R| + 0.01)
    double smape = 0.0;  ///< mean |I - R| / (|I| + |R| + 0.01)

    /// 100 (sum Y_I / sum Y_R - 1), in percent, signed; NaN where the reference is black and the picture is
    /// not.
    double energy_bias_percent = 0.0;

    /// Percentiles and maximum of the relative error of a pixel, |Y_I - Y_R| / (|Y_R| + 0.01). Nearest rank.
    double p50 = 0.0, p95 = 0.0, p99 = 0.0, p99_9 = 0.0;
    double max = 0.0;

    LeakMetric leak;
};

/// Compares two pictures of equal size. @pre test.size() == reference.size() > 0
ImageMetrics compare_images(std::span<const glm::vec3> test, std::span<const glm::vec3> reference);

}  // namespace core
