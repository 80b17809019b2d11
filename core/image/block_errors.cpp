#include "core/image/block_errors.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace core {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Total {
    double sum = 0.0, pixels = 0.0;

    void add(double block_sum, double block_pixels) {
        sum += block_sum;
        pixels += block_pixels;
    }
};

Total total_of(const BlockErrors& errors) {
    Total total;
    for (std::size_t i = 0; i < errors.sums.size(); ++i) total.add(errors.sums[i], errors.pixels[i]);
    return total;
}

ErrorInterval of_one_block(const Total& total) {
    const double mean = total.sum / total.pixels;
    return std::isfinite(mean) ? ErrorInterval{mean, -kInfinity, kInfinity} : ErrorInterval{kNaN, kNaN, kNaN};
}

/// Asked by assertions alone.
[[maybe_unused]] bool equal_blocks(const BlockErrors& a, const BlockErrors& b) {
    return a.columns == b.columns && a.rows == b.rows && a.pixels == b.pixels;
}

using Values = std::vector<double>;  ///< One a block.

double dot(const Values& a, const Values& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// Takes the part along a unit vector away.
void remove_part(Values& values, const Values& direction) {
    const double part = dot(values, direction);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] -= part * direction[i];
}

/// Orthonormal vectors that span the predictors (Gram and Schmidt); what the others span already is left out.
std::vector<Values> basis_of(const std::vector<Values>& predictors) {
    constexpr double kRounding = 1e-8;  // Of a predictor's length, twice that of what is lost by subtracting.
    std::vector<Values> basis;
    for (const Values& predictor : predictors) {
        const double length = std::sqrt(dot(predictor, predictor));
        if (!(length > 0.0) || !std::isfinite(length)) continue;
        Values rest = predictor;
        for (double& value : rest) value /= length;
        for (int pass = 0; pass < 2; ++pass) {  // The second removes what rounding left in the first.
            for (const Values& direction : basis) remove_part(rest, direction);
        }
        const double rest_length = std::sqrt(dot(rest, rest));
        if (rest_length < kRounding) continue;
        for (double& value : rest) value /= rest_length;
        basis.push_back(std::move(rest));
    }
    return basis;
}

/// How far each value is from what a fit of all others to the predictors says.
Values distances_from_prediction(Values values, const std::vector<Values>& predictors) {
    constexpr double kAlone = 1e-6;  // A block that has a predictor for itself; the others say nothing of it.
    const std::vector<Values> basis = basis_of(predictors);
    const Values before = values;
    for (const Values& direction : basis) remove_part(values, direction);
    for (std::size_t i = 0; i < values.size(); ++i) {
        double leverage = 0.0;
        for (const Values& direction : basis) leverage += direction[i] * direction[i];
        values[i] = 1.0 - leverage > kAlone ? values[i] / (1.0 - leverage) : before[i];
    }
    return values;
}

}  // namespace

PixelBlocks::PixelBlocks(int picture_width, int picture_height) : width_(picture_width) {
    assert(picture_width > 0 && picture_height > 0);
    constexpr int kLargest = 16, kEnough = 32;
    for (size_ = kLargest;; size_ /= 2) {
        columns_ = (picture_width + size_ - 1) / size_;
        rows_ = (picture_height + size_ - 1) / size_;
        if (columns_ * rows_ >= kEnough || size_ == 1) break;
    }
}

std::size_t PixelBlocks::of(std::size_t pixel) const {
    const int x = static_cast<int>(pixel % static_cast<std::size_t>(width_));
    const int y = static_cast<int>(pixel / static_cast<std::size_t>(width_));
    return static_cast<std::size_t>(y / size_ * columns_ + x / size_);
}

BlockErrors::BlockErrors(const PixelBlocks& blocks)
    : columns(blocks.columns()),
      rows(blocks.rows()),
      sums(static_cast<std::size_t>(columns * rows), 0.0),
      pixels(sums.size(), 0.0) {}

BlockErrors mixed(const BlockErrors& a, const BlockErrors& b, double share) {
    assert(equal_blocks(a, b));
    BlockErrors result = a;
    for (std::size_t i = 0; i < a.sums.size(); ++i) {
        result.sums[i] = a.sums[i] + share * (b.sums[i] - a.sums[i]);
    }
    return result;
}

void accumulate(BlockErrors& sum, const BlockErrors& other, double weight) {
    if (sum.sums.empty()) {
        sum = other;
        sum.sums.assign(other.sums.size(), 0.0);
    }
    assert(equal_blocks(sum, other));
    for (std::size_t i = 0; i < sum.sums.size(); ++i) sum.sums[i] += weight * other.sums[i];
}

ErrorInterval mean_error(const BlockErrors& errors) {
    const Total total = total_of(errors);
    const std::size_t count = errors.sums.size();
    if (count == 1) return of_one_block(total);
    std::vector<double> without(count);
    for (std::size_t i = 0; i < count; ++i) {
        without[i] = (total.sum - errors.sums[i]) / (total.pixels - errors.pixels[i]);
    }
    return student_interval(total.sum / total.pixels, jackknife_error(without),
                            static_cast<double>(count - 1));
}

ErrorInterval paired_difference(const BlockErrors& a, const BlockErrors& b,
                                std::span<const BlockErrors> predictors, double hidden_share) {
    BlockErrors difference = a;
    accumulate(difference, b, -1.0);
    const Total total = total_of(difference);
    const std::size_t count = difference.sums.size();
    assert(count > 0);
    if (count == 1) return of_one_block(total);

    std::vector<Values> spanned = {difference.pixels};  // What is alike all over the picture.
    for (const BlockErrors& predictor : predictors) spanned.push_back(predictor.sums);
    double squares = 0.0, fourth_powers = 0.0;
    const Values distances = distances_from_prediction(difference.sums, spanned);
    const double largest = std::abs(*std::max_element(
        distances.begin(), distances.end(), [](double x, double y) { return std::abs(x) < std::abs(y); }));
    const double scale = largest > 0.0 ? largest : 1.0;  // Fourth powers leave the range of a double soon.
    for (const double distance : distances) {
        const double square = distance / scale * (distance / scale);
        squares += square;
        fourth_powers += square * square;
    }
    // The mean fourth power of normal noise is three times its variance squared.
    const double degrees = fourth_powers > 0.0 ? 3.0 * squares * squares / fourth_powers : 1.0;
    return student_interval(total.sum / total.pixels,
                            scale * std::sqrt((1.0 + hidden_share) * squares) / total.pixels,
                            std::clamp(degrees, 1.0, static_cast<double>(count - 1)));
}

}  // namespace core
