#include "core/image/block_errors.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

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

/// Where the runs of two begin that a row of `count` falls into; the last is of three where `count` is odd.
std::vector<int> run_starts(int count) {
    std::vector<int> starts;
    for (int i = 0; i == 0 || i + 1 < count; i += 2) starts.push_back(i);
    starts.push_back(count);
    return starts;
}

/// The variance of a sum, and its degrees of freedom.
struct Variance {
    double value = 0.0;
    double degrees_of_freedom = 0.0;
};

/// Of the blocks [left, right) x [top, bottom), from how they scatter around what they have in common; a
/// block's variance is taken to grow with its pixels.
Variance variance_of_group(const BlockErrors& errors, int left, int right, int top, int bottom) {
    const auto for_each_block = [&](const auto& visit) {
        for (int row = top; row < bottom; ++row) {
            for (int column = left; column < right; ++column) {
                const auto block = static_cast<std::size_t>(row * errors.columns + column);
                visit(errors.sums[block], errors.pixels[block]);
            }
        }
    };
    Total total;
    for_each_block([&](double sum, double pixels) { total.add(sum, pixels); });
    const double mean = total.sum / total.pixels;
    double squares = 0.0;
    for_each_block([&](double sum, double pixels) {
        const double residual = sum - pixels * mean;
        squares += residual * residual / pixels;
    });
    const double degrees = (right - left) * (bottom - top) - 1.0;
    return {total.pixels * squares / degrees, degrees};
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

ErrorInterval paired_difference(const BlockErrors& a, const BlockErrors& b) {
    assert(equal_blocks(a, b));
    BlockErrors difference = a;
    for (std::size_t i = 0; i < a.sums.size(); ++i) difference.sums[i] -= b.sums[i];
    const Total total = total_of(difference);
    if (difference.sums.size() == 1) return of_one_block(total);

    const std::vector<int> columns = run_starts(difference.columns), rows = run_starts(difference.rows);
    std::vector<Variance> groups;
    double variance = 0.0;
    for (std::size_t y = 0; y + 1 < rows.size(); ++y) {
        for (std::size_t x = 0; x + 1 < columns.size(); ++x) {
            groups.push_back(variance_of_group(difference, columns[x], columns[x + 1], rows[y], rows[y + 1]));
            variance += groups.back().value;
        }
    }
    double inverse_degrees = 0.0;
    for (const Variance& group : groups) {
        const double share = variance > 0.0 ? group.value / variance : 1.0;  // Equal pictures differ nowhere.
        inverse_degrees += share * share / group.degrees_of_freedom;
    }
    return student_interval(total.sum / total.pixels, std::sqrt(variance) / total.pixels,
                            std::max(1.0 / inverse_degrees, 1.0));
}

}  // namespace core
