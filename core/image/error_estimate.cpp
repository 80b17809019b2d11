#include "core/image/error_estimate.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace core {

namespace {

constexpr double kFloor = 0.01;  ///< Added to squares of the reference, as in relMSE.
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

using Colors = std::vector<glm::vec3>;

Colors beauty_of(const Image& image) {
    auto colors = image.color();
    assert(colors);
    return std::move(*colors);
}

Colors variance_of(const Image& image, const char* role) {
    auto variance = image.color("Variance");
    if (!variance) {
        throw std::invalid_argument(std::string("corrected error: the ") + role +
                                    " has no Variance.R, Variance.G, Variance.B");
    }
    return std::move(*variance);
}

/// @param value mean over the channels of a pixel
template <typename Value>
BlockErrors over_blocks(const Image& picture, const Value& value) {
    const PixelBlocks blocks(picture.width(), picture.height());
    BlockErrors errors(blocks);
    for (std::size_t pixel = 0; pixel < picture.pixel_count(); ++pixel) {
        const std::size_t block = blocks.of(pixel);
        errors.sums[block] += value(pixel);
        errors.pixels[block] += 1.0;
    }
    return errors;
}

enum class Scale { kAbsolute, kRelative };

/// A square that depends on a noisy reference, over R^2 + 0.01 where it is relative, without what the
/// reference's noise adds. To second order in the noise, g(R) is too large by s^2 g''(R) / 2; here g is the
/// square times a weight, so that the noise in the denominator is counted, too.
/// @param square with second derivative 2 in R, such as (I - R)^2. @param difference I - R
double without_reference_noise(Scale scale, double square, double difference, double reference,
                               double reference_variance) {
    if (scale == Scale::kAbsolute) return square - reference_variance;
    const double weight = 1.0 / (reference * reference + kFloor);
    const double slope = -2.0 * reference * weight * weight;
    const double curvature = (6.0 * reference * reference - 2.0 * kFloor) * weight * weight * weight;
    return square * weight -
           reference_variance * (weight - 2.0 * difference * slope + 0.5 * square * curvature);
}

/// Mean of (I - R)^2 - s_R^2 (- s_I^2, where `test_variance` is not empty).
BlockErrors corrected(const Image& test, const Image& reference, Scale scale, const Colors& test_variance) {
    assert(test.width() == reference.width() && test.height() == reference.height());
    const Colors values = beauty_of(test), truth = beauty_of(reference),
                 variance = variance_of(reference, "reference");
    return over_blocks(reference, [&](std::size_t pixel) {
        double sum = 0.0;
        for (int i = 0; i < 3; ++i) {
            const double difference = static_cast<double>(values[pixel][i]) - truth[pixel][i];
            double square = difference * difference;
            if (!test_variance.empty()) square -= test_variance[pixel][i];
            sum += without_reference_noise(scale, square, difference, truth[pixel][i], variance[pixel][i]);
        }
        return sum / 3.0;
    });
}

/// Unbiased square of a mean: that of the values, without their variance over their count.
/// @param sum, squares of `count` values
double unbiased_square(double sum, double squares, double count) {
    return (sum * sum - squares) / (count * (count - 1.0));
}

ErrorInterval squared_bias(std::span<const Image> runs, const Image& reference, Scale scale) {
    assert(runs.size() >= 3);
    const Colors truth = beauty_of(reference), variance = variance_of(reference, "reference");
    std::vector<Colors> values;
    for (const Image& run : runs) {
        assert(run.width() == reference.width() && run.height() == reference.height());
        values.push_back(beauty_of(run));
    }
    const double count = static_cast<double>(runs.size());
    std::vector<double> without(runs.size(), 0.0);
    const BlockErrors blocks = over_blocks(reference, [&](std::size_t pixel) {
        double result = 0.0;
        for (int i = 0; i < 3; ++i) {
            double sum = 0.0, squares = 0.0;
            const auto error = [&](std::size_t run) {
                return static_cast<double>(values[run][pixel][i]) - truth[pixel][i];
            };
            const auto estimate = [&](double error_sum, double error_squares, double error_count) {
                return without_reference_noise(scale, unbiased_square(error_sum, error_squares, error_count),
                                               error_sum / error_count, truth[pixel][i], variance[pixel][i]) /
                       3.0;
            };
            for (std::size_t run = 0; run < runs.size(); ++run) {
                sum += error(run);
                squares += error(run) * error(run);
            }
            result += estimate(sum, squares, count);
            for (std::size_t run = 0; run < runs.size(); ++run) {
                const double left_out = error(run);
                without[run] += estimate(sum - left_out, squares - left_out * left_out, count - 1.0);
            }
        }
        return result;
    });
    const ErrorInterval over_pixels = mean_error(blocks);
    for (double& estimate : without) estimate /= static_cast<double>(reference.pixel_count());
    const ErrorInterval over_runs =
        student_interval(over_pixels.value, jackknife_error(without), count - 1.0);
    return {over_pixels.value, std::min(over_pixels.low, over_runs.low),
            std::max(over_pixels.high, over_runs.high)};
}

/// A fitted value that cannot be negative.
ErrorInterval not_negative(const ErrorInterval& interval) {
    return {std::max(interval.value, 0.0), std::max(interval.low, 0.0), std::max(interval.high, 0.0)};
}

/// Weighted least squares of errors = floor + slope x rates, rates being 1 / time.
struct LineFit {
    double floor = 0.0, slope = 0.0;
    double floor_error = 0.0, slope_error = 0.0;  ///< Standard errors.
};

using Terms = std::array<bool, 2>;  ///< Whether floor and slope are fitted; one that is not is 0.

LineFit solve(std::span<const double> rates, std::span<const double> errors, std::span<const double> weights,
              const Terms& terms) {
    double ones = 0.0, sum_rates = 0.0, square_rates = 0.0, sum_errors = 0.0, products = 0.0;
    for (std::size_t i = 0; i < rates.size(); ++i) {
        ones += weights[i];
        sum_rates += weights[i] * rates[i];
        square_rates += weights[i] * rates[i] * rates[i];
        sum_errors += weights[i] * errors[i];
        products += weights[i] * rates[i] * errors[i];
    }
    LineFit fit;
    double floor_variance = 0.0, slope_variance = 0.0;  // Of unit residuals.
    if (terms[0] && terms[1]) {
        const double determinant = ones * square_rates - sum_rates * sum_rates;
        fit.floor = (square_rates * sum_errors - sum_rates * products) / determinant;
        fit.slope = (ones * products - sum_rates * sum_errors) / determinant;
        floor_variance = square_rates / determinant;
        slope_variance = ones / determinant;
    } else if (terms[0]) {
        fit.floor = sum_errors / ones;
        floor_variance = 1.0 / ones;
    } else {
        fit.slope = products / square_rates;
        slope_variance = 1.0 / square_rates;
    }
    double residuals = 0.0;
    for (std::size_t i = 0; i < rates.size(); ++i) {
        const double residual = errors[i] - fit.floor - fit.slope * rates[i];
        residuals += weights[i] * residual * residual;
    }
    const double degrees = static_cast<double>(rates.size()) - (terms[0] && terms[1] ? 2.0 : 1.0);
    fit.floor_error = std::sqrt(floor_variance * residuals / degrees);
    fit.slope_error = std::sqrt(slope_variance * residuals / degrees);
    return fit;
}

/// Repeats the fit with weights from the fit before: weights from the errors themselves would trust the
/// points that came out too small.
LineFit fit_relative(std::span<const double> rates, std::span<const double> errors, const Terms& terms) {
    constexpr int kIterations = 50;
    constexpr double kSmallestShare = 0.1;  // A line with a negative floor crosses zero; weights must not.
    std::vector<double> weights(errors.size());
    for (std::size_t i = 0; i < errors.size(); ++i) weights[i] = 1.0 / (errors[i] * errors[i]);
    LineFit fit = solve(rates, errors, weights, terms);
    for (int iteration = 0; iteration < kIterations; ++iteration) {
        for (std::size_t i = 0; i < errors.size(); ++i) {
            const double fitted = std::max(fit.floor + fit.slope * rates[i], kSmallestShare * errors[i]);
            weights[i] = 1.0 / (fitted * fitted);
        }
        fit = solve(rates, errors, weights, terms);
    }
    return fit;
}

}  // namespace

ErrorInterval corrected_mse(const Image& test, const Image& reference) {
    return mean_error(corrected(test, reference, Scale::kAbsolute, {}));
}

BlockErrors corrected_rel_mse_blocks(const Image& test, const Image& reference) {
    return corrected(test, reference, Scale::kRelative, {});
}

ErrorInterval corrected_rel_mse(const Image& test, const Image& reference) {
    return mean_error(corrected_rel_mse_blocks(test, reference));
}

ErrorInterval corrected_rel_bias(const Image& test, const Image& reference) {
    return mean_error(corrected(test, reference, Scale::kRelative, variance_of(test, "picture under test")));
}

double noise_rel_mse(const Image& picture) {
    const Colors values = beauty_of(picture), variance = variance_of(picture, "picture");
    double sum = 0.0;
    for (std::size_t pixel = 0; pixel < values.size(); ++pixel) {
        for (int i = 0; i < 3; ++i) {
            const double value = values[pixel][i];
            sum += variance[pixel][i] / (value * value + kFloor);
        }
    }
    return std::isfinite(sum) ? sum / (3.0 * static_cast<double>(values.size())) : kNaN;
}

ErrorInterval squared_bias(std::span<const Image> runs, const Image& reference) {
    return squared_bias(runs, reference, Scale::kAbsolute);
}

ErrorInterval squared_rel_bias(std::span<const Image> runs, const Image& reference) {
    return squared_bias(runs, reference, Scale::kRelative);
}

std::optional<ErrorFit> fit_error_over_time(std::span<const double> seconds, std::span<const double> errors) {
    assert(seconds.size() == errors.size());
    const auto usable = [](double value) { return std::isfinite(value) && value > 0.0; };
    if (!std::all_of(seconds.begin(), seconds.end(), usable)) return std::nullopt;
    if (!std::all_of(errors.begin(), errors.end(), usable)) return std::nullopt;
    std::vector<double> times(seconds.begin(), seconds.end());
    std::sort(times.begin(), times.end());
    if (std::unique(times.begin(), times.end()) - times.begin() < 3) return std::nullopt;

    std::vector<double> rates;
    for (const double time : seconds) rates.push_back(1.0 / time);
    const double points = static_cast<double>(rates.size());
    const LineFit free = fit_relative(rates, errors, {true, true});
    ErrorFit fit{not_negative(student_interval(free.floor, free.floor_error, points - 2.0)),
                 not_negative(student_interval(free.slope, free.slope_error, points - 2.0))};
    if (free.floor < 0.0) {
        const LineFit slope_alone = fit_relative(rates, errors, {false, true});
        fit.slope = not_negative(student_interval(slope_alone.slope, slope_alone.slope_error, points - 1.0));
    } else if (free.slope < 0.0) {
        const LineFit floor_alone = fit_relative(rates, errors, {true, false});
        fit.floor = not_negative(student_interval(floor_alone.floor, floor_alone.floor_error, points - 1.0));
    }
    return fit;
}

}  // namespace core
