// cli/report_axis.h: axes of the report's figures: ranges, positions and ticks.
#pragma once

#include <string>
#include <vector>

namespace cli {

/// Smallest and largest of the positive finite values that were included, kept between 1e-30 and 1e30.
struct Range {
    double low = 0.0, high = 0.0;  ///< Both 0 until a value is included.

    /// Widens the range; ignores values that have no logarithm.
    void include(double value);
};

/// A line of the grid.
struct Tick {
    double value = 0.0;
    std::string label;  ///< Empty for a line without a number.
};

/// A logarithmic axis between two positions of the drawing.
class LogAxis {
public:
    /// Covers the range with some room, at least one decade in all. An empty range is that around 1.
    LogAxis(const Range& range, double begin, double end);

    double low() const { return low_; }
    double high() const { return high_; }
    bool contains(double value) const { return value >= low_ && value <= high_; }

    /// Where a value lies; at the nearer end if it lies outside. @pre value > 0
    double at(double value) const;

    /// Every 1 to 9 times a power of ten inside. Powers of ten bear numbers, where there is
    /// room also 2 and 5.
    std::vector<Tick> ticks() const;

private:
    double low_, high_, begin_, end_;
};

/// Positions of a linear axis from 0 to `high`: at most `count` steps of 1, 2 or 5 times a power of ten.
/// @pre high > 0
std::vector<Tick> linear_ticks(double high, int count);

}  // namespace cli
