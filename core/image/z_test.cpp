#include "core/image/z_test.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace core {

namespace {

/// The continued fraction of the incomplete beta function, by Lentz's method; converges fast for
/// x < (a + 1) / (a + b + 2).
double beta_continued_fraction(double a, double b, double x) {
    constexpr int kMaxIterations = 500;
    constexpr double kTiny = 1e-300, kPrecision = 1e-15;
    const auto away_from_zero = [](double value) { return std::abs(value) < kTiny ? kTiny : value; };
    double c = 1.0;
    double d = 1.0 / away_from_zero(1.0 - (a + b) * x / (a + 1.0));
    double fraction = d;
    for (int i = 1; i <= kMaxIterations; ++i) {
        const double m = i;
        const double even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / away_from_zero(1.0 + even * d);
        c = away_from_zero(1.0 + even / c);
        fraction *= d * c;
        const double odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / away_from_zero(1.0 + odd * d);
        c = away_from_zero(1.0 + odd / c);
        fraction *= d * c;
        if (std::abs(d * c - 1.0) < kPrecision) break;
    }
    return fraction;
}

/// I_x(a, b).
double regularized_incomplete_beta(double a, double b, double x) {
    if (x <= 0.0) return 0.0;
    if (x >= 1.0) return 1.0;
    const double front =
        std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x));
    if (x < (a + 1.0) / (a + b + 2.0)) return front * beta_continued_fraction(a, b, x) / a;
    return 1.0 - front * beta_continued_fraction(b, a, 1.0 - x) / b;
}

double sidak_threshold(double significance, std::size_t count) {
    return -std::expm1(std::log1p(-significance) / static_cast<double>(count));
}

/// The planes that a test reads; the reference's variance may be missing.
struct Planes {
    std::array<const std::vector<float>*, 3> test, reference, test_variance, reference_variance;
};

Planes find_planes(const Image& test, const Image& reference) {
    assert(test.width() == reference.width() && test.height() == reference.height());
    Planes planes{};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::string component(1, "RGB"[i]);
        planes.test[i] = test.find(component);
        planes.reference[i] = reference.find(component);
        planes.test_variance[i] = test.find("Variance." + component);
        planes.reference_variance[i] = reference.find("Variance." + component);
        assert(planes.test[i] && planes.reference[i]);
        if (!planes.test_variance[i]) {
            throw std::invalid_argument("z-test: the picture under test has no Variance." + component);
        }
    }
    return planes;
}

/// Sums over one block of one channel.
struct BlockSums {
    double test = 0.0, reference = 0.0;
    double variance = 0.0;          ///< Sum of the variances of both pictures.
    double squared_variance = 0.0;  ///< Sum of their squares, for the degrees of freedom.
    std::size_t pixel_count = 0;
};

void add_variance(BlockSums& sums, double variance) {
    sums.variance += variance;
    sums.squared_variance += variance * variance;
}

BlockSums sum_block(const Planes& planes, std::size_t channel, std::size_t width, std::size_t x_begin,
                    std::size_t x_end, std::size_t y_begin, std::size_t y_end) {
    BlockSums sums;
    for (std::size_t y = y_begin; y < y_end; ++y) {
        for (std::size_t x = x_begin; x < x_end; ++x) {
            const std::size_t pixel = y * width + x;
            sums.test += (*planes.test[channel])[pixel];
            sums.reference += (*planes.reference[channel])[pixel];
            add_variance(sums, (*planes.test_variance[channel])[pixel]);
            if (planes.reference_variance[channel]) {
                add_variance(sums, (*planes.reference_variance[channel])[pixel]);
            }
            ++sums.pixel_count;
        }
    }
    return sums;
}

/// p-value of a block's mean difference; NaN where something in it is not finite.
double block_p_value(const BlockSums& sums, const ZTestOptions& options) {
    const double count = static_cast<double>(sums.pixel_count);
    const double test = sums.test / count, reference = sums.reference / count;
    const double floor = std::max(options.absolute_floor,
                                  options.relative_floor * std::max(std::abs(test), std::abs(reference)));
    const double standard_error = std::max(std::sqrt(sums.variance) / count, floor);
    if (!std::isfinite(standard_error)) return std::numeric_limits<double>::quiet_NaN();
    // Welch and Satterthwaite: between the degrees of one variance, where one dominates, and the sum of all.
    // A single pixel keeps those of one: its two variances are too few to be told apart by their estimates.
    const bool welch = sums.pixel_count > 1 && sums.squared_variance > 0.0;
    const double degrees_of_freedom =
        welch ? options.degrees_of_freedom * sums.variance * sums.variance / sums.squared_variance
              : options.degrees_of_freedom;
    return student_t_p_value((test - reference) / standard_error, degrees_of_freedom);
}

bool is_finite_pixel(const Planes& planes, std::size_t pixel) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
        for (const auto& group :
             {planes.test, planes.reference, planes.test_variance, planes.reference_variance}) {
            if (group[channel] && !std::isfinite((*group[channel])[pixel])) return false;
        }
    }
    return true;
}

}  // namespace

double student_t_p_value(double t, double degrees_of_freedom) {
    assert(degrees_of_freedom > 0.0);
    if (std::isnan(t)) return std::numeric_limits<double>::quiet_NaN();
    if (std::isinf(t)) return 0.0;
    return regularized_incomplete_beta(0.5 * degrees_of_freedom, 0.5,
                                       degrees_of_freedom / (degrees_of_freedom + t * t));
}

ZTestResult pixel_z_test(const Image& test, const Image& reference, const ZTestOptions& options) {
    return block_z_test(test, reference, 1, options);
}

ZTestResult block_z_test(const Image& test, const Image& reference, int block, const ZTestOptions& options) {
    assert(block > 0);
    const Planes planes = find_planes(test, reference);
    const auto width = static_cast<std::size_t>(test.width()),
               height = static_cast<std::size_t>(test.height());
    const auto size = static_cast<std::size_t>(block);
    const std::size_t columns = (width + size - 1) / size, rows = (height + size - 1) / size;
    ZTestResult result;
    result.tested = columns * rows;
    if (result.tested == 0) return result;
    result.p_threshold = sidak_threshold(options.significance, 3 * result.tested);
    for (std::size_t pixel = 0; pixel < width * height; ++pixel) {
        result.nonfinite += !is_finite_pixel(planes, pixel);
    }
    for (std::size_t index = 0; index < result.tested; ++index) {
        const std::size_t x = index % columns * size, y = index / columns * size;
        bool passes = true;
        for (std::size_t channel = 0; channel < 3; ++channel) {
            const double p = block_p_value(sum_block(planes, channel, width, x, std::min(x + size, width), y,
                                                     std::min(y + size, height)),
                                           options);
            // A NaN passes nothing.
            passes = passes && p >= result.p_threshold;
            const double comparable = std::isnan(p) ? 0.0 : p;
            if (comparable < result.smallest_p) {
                result.smallest_p = comparable;
                result.worst_index = index;
            }
        }
        result.passed += passes;
    }
    return result;
}

}  // namespace core
