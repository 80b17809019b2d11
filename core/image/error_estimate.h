// core/image/error_estimate.h: errors of noisy pictures against a noisy reference, with 95 % intervals.
//
// A squared difference of two noisy values is too large by the sum of their variances; what is known of them
// is subtracted, and for relative errors the effect of the reference's noise in the denominator, too: for a
// term g(R) that is s^2 g''(R) / 2. What is left is of fourth order in that noise. Results are not clamped:
// near zero they may be negative.
//
// Intervals over pixels are those of core/image/block_errors.h.
//
// I is the picture under test, R the reference, s^2 `Variance.R`, `.G`, `.B`: the variance of a pixel's mean.
// Means run over pixels and channels. All results are NaN where a value is not finite; the interval of a
// single pixel is unbounded.
#pragma once

#include <optional>
#include <span>

#include "core/image/block_errors.h"
#include "core/image/error_interval.h"
#include "core/image/image.h"

namespace core {

/// MSE of the test against the truth, the test's own noise included: mean of (I - R)^2 - s_R^2.
/// @pre equal sizes; both have R, G, B. @throws std::invalid_argument where the reference has no variance
ErrorInterval corrected_mse(const Image& test, const Image& reference);

/// The same for relMSE: mean of [(I - R)^2 - s_R^2] / (R^2 + 0.01), the denominator's noise removed.
ErrorInterval corrected_rel_mse(const Image& test, const Image& reference);

/// What corrected_rel_mse is the mean of, over blocks of pixels: pairs with another picture's against the
/// same reference, see paired_difference.
BlockErrors corrected_rel_mse_blocks(const Image& test, const Image& reference);

/// relMSE of what the test converges to: mean of [(I - R)^2 - s_R^2 - s_I^2] / (R^2 + 0.01).
/// @throws std::invalid_argument where either has no variance
ErrorInterval corrected_rel_bias(const Image& test, const Image& reference);

/// The relMSE that a picture's own noise makes on average: mean of s_R^2 / (R^2 + 0.01). For a reference,
/// what corrected_rel_mse subtracts. @throws std::invalid_argument where it has no variance
double noise_rel_mse(const Image& picture);

/// Squared bias from K runs that differ in their seed alone, caches rebuilt: mean of
/// (mean I - R)^2 - s^2 / K - s_R^2, with s^2 the variance between the runs; 8 or more runs are right. The
/// interval is the wider of that over blocks and a jackknife over runs, which sees noise that is alike all
/// over a run. @pre at least 3 runs; the rest as in corrected_mse
ErrorInterval squared_bias(std::span<const Image> runs, const Image& reference);

/// The same, every term over R^2 + 0.01, the denominator's noise removed.
ErrorInterval squared_rel_bias(std::span<const Image> runs, const Image& reference);

/// MSE(t) = floor + slope / t.
struct ErrorFit {
    ErrorInterval floor;  ///< b^2, in units of the error: what no time removes. Never negative.
    ErrorInterval slope;  ///< v, error x seconds: the time to unit error above the floor. Never negative.
};

/// Fits floor and slope to errors (MSE or relMSE) at times: least squares of (error - fit) / fit, weights
/// iterated, both terms >= 0. Intervals: Student's t from the scatter around the fit, cut off at 0; where a
/// term would be negative it is 0, and the other is fitted alone. Nothing for fewer than three distinct
/// times, or where a time or an error is not finite and positive. @pre seconds.size() == errors.size()
std::optional<ErrorFit> fit_error_over_time(std::span<const double> seconds, std::span<const double> errors);

}  // namespace core
