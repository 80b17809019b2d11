#include "core/image/ssim.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "core/image/image.h"
#include "core/image/tonemap.h"
#include "core/support/parallel.h"

namespace core {

namespace {

constexpr int kRadius = 5;
constexpr std::size_t kRowsAtOnce = 8;

/// Weighted sums over a window of T, R, T^2, R^2 and T R, T being the test and R the reference.
using Moments = std::array<double, 5>;

std::array<double, 2 * kRadius + 1> window_weights() {
    constexpr double kSigma = 1.5;
    std::array<double, 2 * kRadius + 1> weights{};
    for (int offset = -kRadius; offset <= kRadius; ++offset) {
        weights[static_cast<std::size_t>(offset + kRadius)] =
            std::exp(-offset * offset / (2.0 * kSigma * kSigma));
    }
    return weights;
}

/// Weighted mean over the offsets from `at` that lie in [0, count).
template <typename Value>
Moments windowed(int at, int count, const Value& value) {
    static const auto kWeights = window_weights();
    Moments sums{};
    double total = 0.0;
    for (int i = std::max(at - kRadius, 0); i <= std::min(at + kRadius, count - 1); ++i) {
        const double weight = kWeights[static_cast<std::size_t>(i - at + kRadius)];
        const Moments moments = value(i);
        for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += weight * moments[k];
        total += weight;
    }
    for (double& sum : sums) sum /= total;
    return sums;
}

double similarity(const Moments& moments) {
    constexpr double kLuminance = 0.01 * 0.01, kContrast = 0.03 * 0.03;
    const auto [test, reference, test_square, reference_square, product] = moments;
    const double variances = (test_square - test * test) + (reference_square - reference * reference);
    const double covariance = product - test * reference;
    return (2.0 * test * reference + kLuminance) * (2.0 * covariance + kContrast) /
           ((test * test + reference * reference + kLuminance) * (variances + kContrast));
}

std::vector<double> shown(std::span<const glm::vec3> radiance, float scale) {
    std::vector<double> values;
    values.reserve(radiance.size());
    for (const glm::vec3& color : radiance) {
        const glm::vec3 displayed = tone_curve(ToneMap::kAces, color * scale);
        values.push_back(0.2126 * srgb_from_linear(displayed.r) + 0.7152 * srgb_from_linear(displayed.g) +
                         0.0722 * srgb_from_linear(displayed.b));
    }
    return values;
}

bool is_finite(std::span<const glm::vec3> picture) {
    return std::all_of(picture.begin(), picture.end(), [](const glm::vec3& color) {
        return std::isfinite(color.r) && std::isfinite(color.g) && std::isfinite(color.b);
    });
}

}  // namespace

double ssim(std::span<const glm::vec3> test, std::span<const glm::vec3> reference, int width, int height) {
    const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
    assert(width > 0 && height > 0);
    assert(test.size() == columns * rows && reference.size() == columns * rows);
    if (!is_finite(test) || !is_finite(reference)) return std::numeric_limits<double>::quiet_NaN();
    const float scale = exposure_scale(automatic_exposure(reference));
    const std::vector<double> test_shown = shown(test, scale), reference_shown = shown(reference, scale);

    std::vector<Moments> along_rows(columns * rows);
    parallel_for(rows, kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y) {
            for (int x = 0; x < width; ++x) {
                along_rows[y * columns + static_cast<std::size_t>(x)] = windowed(x, width, [&](int i) {
                    const std::size_t pixel = y * columns + static_cast<std::size_t>(i);
                    const double t = test_shown[pixel], r = reference_shown[pixel];
                    return Moments{t, r, t * t, r * r, t * r};
                });
            }
        }
    });
    std::vector<double> row_sums(rows, 0.0);
    parallel_for(rows, kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y) {
            for (std::size_t x = 0; x < columns; ++x) {
                row_sums[y] += similarity(windowed(static_cast<int>(y), height, [&](int i) -> const Moments& {
                    return along_rows[static_cast<std::size_t>(i) * columns + x];
                }));
            }
        }
    });
    double sum = 0.0;
    for (const double row_sum : row_sums) sum += row_sum;
    return sum / static_cast<double>(test.size());
}

}  // namespace core
