#include "core/image/error_interval.h"

#include <cmath>
#include <limits>

#include "core/image/z_test.h"

namespace core {

namespace {

/// What |t| exceeds with a probability of 5 %.
double student_t_95(double degrees_of_freedom) {
    double low = 0.0, high = 16.0;  // 12.71 at one degree of freedom, and less beyond.
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (student_t_p_value(middle, degrees_of_freedom) > 0.05 ? low : high) = middle;
    }
    return low;
}

}  // namespace

ErrorInterval student_interval(double value, double standard_error, double degrees_of_freedom) {
    if (!std::isfinite(value) || !std::isfinite(standard_error)) {
        constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
        return {kNaN, kNaN, kNaN};
    }
    const double half_width = student_t_95(degrees_of_freedom) * standard_error;
    return {value, value - half_width, value + half_width};
}

double jackknife_error(const std::vector<double>& estimates) {
    const double count = static_cast<double>(estimates.size());
    double mean = 0.0, squares = 0.0;
    for (const double estimate : estimates) mean += estimate / count;
    for (const double estimate : estimates) squares += (estimate - mean) * (estimate - mean);
    return std::sqrt((count - 1.0) / count * squares);
}

}  // namespace core
