#include "cli/report_axis.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "cli/report_markup.h"

namespace cli {

void Range::include(double value) {
    if (!(value > 0.0) || !std::isfinite(value)) return;
    const double kept = std::clamp(value, 1e-30, 1e30);
    low = low > 0.0 ? std::min(low, kept) : kept;
    high = std::max(high, kept);
}

LogAxis::LogAxis(const Range& range, double begin, double end) : begin_(begin), end_(end) {
    const double low = std::log10(range.low > 0.0 ? range.low : 1.0);
    const double high = std::log10(range.high > 0.0 ? range.high : 1.0);
    const double room = std::max(0.05 * (high - low), 0.5 * (1.0 - (high - low)));
    low_ = std::pow(10.0, low - room);
    high_ = std::pow(10.0, high + room);
}

double LogAxis::at(double value) const {
    assert(value > 0.0);
    return begin_ +
           (end_ - begin_) * std::log(std::clamp(value, low_, high_) / low_) / std::log(high_ / low_);
}

std::vector<Tick> LogAxis::ticks() const {
    const double decades = std::log10(high_ / low_);
    // From 5 to 10 it is 0.3 decades: enough for a short number.
    const bool roomy = std::abs(end_ - begin_) >= 110.0 * decades;
    const auto first = static_cast<int>(std::floor(std::log10(low_)));
    const auto last = static_cast<int>(std::floor(std::log10(high_)));
    // Where very many decades must fit, not each bears a number.
    const int stride = 1 + static_cast<int>(decades / 9.0);
    std::vector<Tick> ticks;
    for (int exponent = first; exponent <= last; ++exponent) {
        for (int digit = 1; digit <= 9; ++digit) {
            const double value = digit * std::pow(10.0, exponent);
            if (!contains(value) || (stride > 1 && digit > 1)) continue;
            const bool numbered = digit == 1 ? exponent % stride == 0 : roomy && (digit == 2 || digit == 5);
            ticks.push_back({value, numbered ? fixed(value, std::clamp(-exponent, 0, 6)) : ""});
        }
    }
    return ticks;
}

std::vector<Tick> linear_ticks(double high, int count) {
    assert(high > 0.0 && count > 0);
    const double rough = high / count;
    const int exponent = static_cast<int>(std::floor(std::log10(rough)));
    const double power = std::pow(10.0, exponent);
    double step = 10.0 * power;
    for (const double digit : {5.0, 2.0, 1.0})
        if (digit * power >= rough) step = digit * power;
    const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
    std::vector<Tick> ticks;
    for (int i = 0; i * step <= high * (1.0 + 1e-9); ++i)
        ticks.push_back({i * step, fixed(i * step, std::min(decimals, 6))});
    return ticks;
}

}  // namespace cli
