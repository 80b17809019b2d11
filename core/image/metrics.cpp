#include "core/image/metrics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

namespace core {

namespace {

constexpr double kFloor = 0.01;          ///< Added to every denominator.
constexpr double kTrimmedShare = 0.001;  ///< Of the pixels, in rel_mse_trimmed.
constexpr double kDarkShare = 1e-4;      ///< Of the median luminance, below which a pixel is dark.
constexpr double kLitTolerancePercent = 2.0;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool is_finite(const glm::vec3& color) {
    return std::isfinite(color.r) && std::isfinite(color.g) && std::isfinite(color.b);
}

double luminance_of(const glm::vec3& color) {
    return 0.2126 * color.r + 0.7152 * color.g + 0.0722 * color.b;
}

/// Nearest rank. @pre sorted is not empty
double percentile(const std::vector<double>& sorted, double percent) {
    // The margin keeps 99.9 % of 1,000 values at the 999th: 99.9 / 100 is not exact.
    const double rank = std::ceil(percent / 100.0 * static_cast<double>(sorted.size()) - 1e-9);
    return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

double percent_beyond(double sum, double reference_sum) {
    if (reference_sum == 0.0) return sum == 0.0 ? 0.0 : kNaN;
    return 100.0 * (sum / reference_sum - 1.0);
}

LeakMetric measure_leak(std::span<const glm::vec3> test, std::span<const glm::vec3> reference) {
    std::vector<double> positive;
    double reference_sum = 0.0;
    for (const glm::vec3& color : reference) {
        const double y = luminance_of(color);
        reference_sum += y;
        if (y > 0.0) positive.push_back(y);
    }
    double threshold = 0.0;
    if (!positive.empty()) {
        const auto middle = positive.begin() + static_cast<std::ptrdiff_t>(positive.size() / 2);
        std::nth_element(positive.begin(), middle, positive.end());
        threshold = kDarkShare * *middle;
    }
    LeakMetric leak;
    std::vector<double> dark;
    double leaked_sum = 0.0, dark_sum = 0.0, lit_sum = 0.0, lit_reference_sum = 0.0;
    for (std::size_t i = 0; i < test.size(); ++i) {
        const double y = luminance_of(test[i]), y_reference = luminance_of(reference[i]);
        if (y_reference <= threshold) {
            dark.push_back(y);
            dark_sum += y;
            leaked_sum += std::max(y - y_reference, 0.0);
        } else {
            lit_sum += y;
            lit_reference_sum += y_reference;
        }
    }
    leak.dark_pixels = dark.size();
    leak.energy_fraction = reference_sum == 0.0 ? kNaN : leaked_sum / reference_sum;
    if (!dark.empty()) {
        leak.mean = dark_sum / static_cast<double>(dark.size());
        std::sort(dark.begin(), dark.end());
        leak.p99_9 = percentile(dark, 99.9);
    }
    leak.lit_bias_percent = dark.size() == test.size() ? kNaN : percent_beyond(lit_sum, lit_reference_sum);
    leak.counts = std::abs(leak.lit_bias_percent) <= kLitTolerancePercent;
    return leak;
}

/// Sums over pixels and channels of every mean that has the same shape.
struct Sums {
    double mse = 0.0, rel_mse = 0.0, mrse = 0.0, mape = 0.0, smape = 0.0;
};

/// Adds one pixel and returns its relative squared error, averaged over the channels.
double add_pixel(Sums& sums, const glm::vec3& test, const glm::vec3& reference) {
    double pixel_rel_mse = 0.0;
    for (int i = 0; i < 3; ++i) {
        const double value = test[i], truth = reference[i];
        const double difference = std::abs(value - truth), size = std::abs(truth);
        const double relative = difference * difference / (size * size + kFloor);
        sums.mse += difference * difference;
        sums.rel_mse += relative;
        sums.mrse += difference * difference / ((size + kFloor) * (size + kFloor));
        sums.mape += difference / (size + kFloor);
        sums.smape += difference / (std::abs(value) + size + kFloor);
        pixel_rel_mse += relative / 3.0;
    }
    return pixel_rel_mse;
}

double trimmed_mean(std::vector<double>& values) {
    const auto dropped = static_cast<std::size_t>(kTrimmedShare * static_cast<double>(values.size()) + 1e-9);
    const std::size_t kept = values.size() - dropped;
    std::sort(values.begin(), values.end());
    double sum = 0.0;
    for (std::size_t i = 0; i < kept; ++i) sum += values[i];
    return sum / static_cast<double>(kept);
}

/// Counts broken pixels; true where there is one.
bool count_nonfinite(ImageMetrics& metrics, std::span<const glm::vec3> test,
                     std::span<const glm::vec3> reference) {
    for (std::size_t i = 0; i < test.size(); ++i) {
        const bool test_broken = !is_finite(test[i]), reference_broken = !is_finite(reference[i]);
        metrics.nonfinite_test_pixels += test_broken;
        metrics.nonfinite_reference_pixels += reference_broken;
        metrics.nonfinite_pixels += test_broken || reference_broken;
    }
    return metrics.nonfinite_pixels > 0;
}

void spoil(ImageMetrics& metrics) {
    for (double* value :
         {&metrics.mse, &metrics.rel_mse, &metrics.rel_mse_trimmed, &metrics.mrse, &metrics.mape,
          &metrics.smape, &metrics.energy_bias_percent, &metrics.p50, &metrics.p95, &metrics.p99,
          &metrics.p99_9, &metrics.max, &metrics.leak.energy_fraction, &metrics.leak.mean,
          &metrics.leak.p99_9, &metrics.leak.lit_bias_percent}) {
        *value = kNaN;
    }
}

}  // namespace

ImageMetrics compare_images(std::span<const glm::vec3> test, std::span<const glm::vec3> reference) {
    assert(test.size() == reference.size() && !test.empty());
    ImageMetrics metrics;
    if (count_nonfinite(metrics, test, reference)) {
        spoil(metrics);
        return metrics;
    }
    Sums sums;
    double energy = 0.0, reference_energy = 0.0;
    std::vector<double> relative_squares(test.size()), relative_errors(test.size());
    for (std::size_t i = 0; i < test.size(); ++i) {
        relative_squares[i] = add_pixel(sums, test[i], reference[i]);
        const double y = luminance_of(test[i]), y_reference = luminance_of(reference[i]);
        energy += y;
        reference_energy += y_reference;
        relative_errors[i] = std::abs(y - y_reference) / (std::abs(y_reference) + kFloor);
    }
    const double count = 3.0 * static_cast<double>(test.size());
    metrics.mse = sums.mse / count;
    metrics.rel_mse = sums.rel_mse / count;
    metrics.rel_mse_trimmed = trimmed_mean(relative_squares);
    metrics.mrse = sums.mrse / count;
    metrics.mape = sums.mape / count;
    metrics.smape = sums.smape / count;
    metrics.energy_bias_percent = percent_beyond(energy, reference_energy);
    std::sort(relative_errors.begin(), relative_errors.end());
    metrics.p50 = percentile(relative_errors, 50.0);
    metrics.p95 = percentile(relative_errors, 95.0);
    metrics.p99 = percentile(relative_errors, 99.0);
    metrics.p99_9 = percentile(relative_errors, 99.9);
    metrics.max = relative_errors.back();
    metrics.leak = measure_leak(test, reference);
    return metrics;
}

}  // namespace core
