// core/image/z_test.h: are two noisy pictures of the same thing, given the variance of their pixels?
//
// Subr and Arvo, "Statistical Hypothesis Testing for Assessing Monte Carlo Estimators", Pacific Graphics
// 2007. The variances are estimates from few batches, so that the statistic follows Student's t, not the
// normal distribution.
#pragma once

#include <cstddef>
#include <vector>

#include "core/image/image.h"

namespace core {

/// How sharp a test is.
struct ZTestOptions {
    /// Probability that a pair of equal pictures shows any failing value; each value is tested at Sidak's
    /// 1 - (1 - significance)^(1 / count).
    double significance = 0.01;
    /// Of each variance: batches - 1. Where both pictures carry variance, this is the conservative choice for
    /// a pixel; blocks use the Welch-Satterthwaite value.
    double degrees_of_freedom = 7.0;
    /// The standard error never counts as less than this share of the larger value: float rounding, and
    /// pixels whose batches agree by chance. Raise it for a known difference between two programs.
    double relative_floor = 1e-4;
    double absolute_floor = 1e-6;  ///< The same in radiance, for pixels near black.
};

/// Outcome of a test over pixels or blocks, channel by channel.
struct ZTestResult {
    std::size_t tested = 0;       ///< Pixels or blocks.
    std::size_t passed = 0;       ///< Those of which all three channels pass.
    double smallest_p = 1.0;      ///< Smallest p-value of all channels.
    double p_threshold = 0.0;     ///< What a p-value must reach to pass.
    std::size_t worst_index = 0;  ///< Pixel or block (row-major) of the smallest p-value.
    std::size_t nonfinite = 0;  ///< Pixels with a non-finite value or variance; they (and their block) fail.

    double passing_fraction() const {
        return tested == 0 ? 0.0 : static_cast<double>(passed) / static_cast<double>(tested);
    }
};

/// Tests every pixel of the beauty. `test` carries `Variance.R`, `.G`, `.B`: the variance of the pixel mean;
/// so may `reference`, which otherwise counts as exact.
/// @pre both have R, G, B and equal sizes. @throws std::invalid_argument where `test` has no variance
ZTestResult pixel_z_test(const Image& test, const Image& reference, const ZTestOptions& options = {});

/// The same for means over blocks of `block` x `block` pixels (smaller at the right and lower edge): finds
/// structure that hides below the noise of single pixels. Takes pixels as independent.
/// @pre block > 0
ZTestResult block_z_test(const Image& test, const Image& reference, int block = 8,
                         const ZTestOptions& options = {});

/// Two-sided p-value of Student's t with `degrees_of_freedom` (> 0, not necessarily whole): P(|T| >= |t|).
double student_t_p_value(double t, double degrees_of_freedom);

}  // namespace core
