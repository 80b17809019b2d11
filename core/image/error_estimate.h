// core/image/error_estimate.h: errors of noisy pictures against a noisy reference, with 95 % intervals.
//
// The variance that is known is subtracted: a squared difference of two noisy values is too large by the sum
// of their variances. Results are unbiased, so that they are not clamped: near zero they may be negative.
// `Variance.R`, `.G`, `.B` is the variance of the pixel's mean.
#pragma once

#include <optional>
#include <span>

#include "core/image/image.h"

namespace core {

/// A value and the interval that holds the truth in 95 % of repetitions.
struct ErrorInterval {
    double value = 0.0;
    double low = 0.0;
    double high = 0.0;
};

/// MSE(t) = floor + slope / t.
struct ErrorFit {
    ErrorInterval floor;  ///< b^2, in units of the error: what no time removes. Never negative.
    ErrorInterval slope;  ///< v, error x seconds: the time to unit error above the floor. Never negative.
};

/// relMSE of the test against the truth, the test's own noise included: mean over pixels and channels of
/// [(I - R)^2 - s_R^2] / (R^2 + 0.01). All NaN where a value is not finite.
/// @pre equal sizes, both have R, G, B. @throws std::invalid_argument where the reference has no variance
ErrorInterval corrected_rel_mse(const Image& test, const Image& reference);

/// Fits floor and slope to errors (MSE or relMSE, > 0) at times > 0. Nothing for fewer than three distinct
/// times, or where a value is not finite and positive. @pre seconds.size() == errors.size()
std::optional<ErrorFit> fit_error_over_time(std::span<const double> seconds, std::span<const double> errors);

}  // namespace core
