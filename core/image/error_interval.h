// core/image/error_interval.h: a measured error and the interval that holds the truth in 95 % of repetitions.
#pragma once

#include <vector>

namespace core {

/// A value and the interval that holds the truth in 95 % of repetitions.
struct ErrorInterval {
    double value = 0.0;
    double low = 0.0;
    double high = 0.0;
};

/// Student's t around `value`; all NaN where an argument is not finite. @pre degrees_of_freedom >= 1
ErrorInterval student_interval(double value, double standard_error, double degrees_of_freedom);

/// Delete-one jackknife: the standard error of an estimate, from estimates that each leave one part out. See
/// Efron, "The Jackknife, the Bootstrap and Other Resampling Plans", SIAM 1982.
double jackknife_error(const std::vector<double>& estimates);

}  // namespace core
