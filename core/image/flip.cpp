#include "core/image/flip.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/image/flip_map.h"
#include "core/image/tonemap.h"
#include "core/support/parallel.h"

namespace core {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t kPixelsAtOnce = 4096;

using Colors = std::vector<glm::vec3>;

bool is_finite(const glm::vec3& color) {
    return std::isfinite(color.r) && std::isfinite(color.g) && std::isfinite(color.b);
}

/// Two pictures that are black where either was broken.
struct Pair {
    Colors test, reference;
    std::vector<std::size_t> broken;  ///< Ascending indices.

    Pair(std::span<const glm::vec3> test_picture, std::span<const glm::vec3> reference_picture)
        : test(test_picture.begin(), test_picture.end()),
          reference(reference_picture.begin(), reference_picture.end()) {
        for (std::size_t i = 0; i < test.size(); ++i) {
            if (is_finite(test[i]) && is_finite(reference[i])) continue;
            broken.push_back(i);
            test[i] = reference[i] = glm::vec3(0.0f);
        }
    }
};

/// The smallest error of which the pixels up to it hold `share` of the sum. @pre sorted ascending, not empty
double weighted_percentile(const std::vector<float>& sorted, double share) {
    double total = 0.0;
    for (const float error : sorted) total += error;
    double sum = 0.0;
    for (const float error : sorted) {
        sum += error;
        if (sum >= share * total) return error;
    }
    return sorted.back();
}

/// Fills in everything that follows from the map and the broken pixels.
void summarize(FlipResult& result, const Pair& pair) {
    result.nonfinite_pixels = pair.broken.size();
    if (!pair.broken.empty()) {
        for (const std::size_t pixel : pair.broken) result.map[pixel] = kNaN;
        result.mean = result.weighted_median = result.first_quartile = result.third_quartile = result.min =
            result.max = kNaN;
        return;
    }
    double sum = 0.0;
    for (const float error : result.map) sum += error;
    result.mean = sum / static_cast<double>(result.map.size());
    std::vector<float> sorted = result.map;
    std::sort(sorted.begin(), sorted.end());
    result.weighted_median = weighted_percentile(sorted, 0.5);
    result.first_quartile = weighted_percentile(sorted, 0.25);
    result.third_quartile = weighted_percentile(sorted, 0.75);
    result.min = sorted.front();
    result.max = sorted.back();
}

/// Colour by colour, in parallel.
template <typename Function>
Colors transformed(const Colors& colors, const Function& function) {
    Colors result(colors.size());
    parallel_for(colors.size(), kPixelsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) result[i] = function(colors[i]);
    });
    return result;
}

/// The published tone map is Narkowicz's curve of 0.6 x.
constexpr double kAcesScale = 0.6;

/// What ACES shows of radiance x 2^exposure, in [0, 1].
Colors shown_at(const Colors& radiance, double exposure) {
    const double scale = kAcesScale * std::exp2(exposure);
    return transformed(radiance, [scale](const glm::vec3& color) {
        constexpr double kWhite = 1e6;  // The curve has reached 1 long before; a float may overflow.
        const glm::dvec3 scaled = glm::min(glm::dvec3(color) * scale, glm::dvec3(kWhite));
        return tone_curve(ToneMap::kAces, glm::vec3(scaled));
    });
}

/// The radiance that ACES shows as 0.85: the positive root of its quotient of squares.
double radiance_shown_bright() {
    constexpr double kBright = 0.85;
    constexpr double kSquare = kAcesScale * kAcesScale * (2.51 - kBright * 2.43);
    constexpr double kLinear = kAcesScale * (0.03 - kBright * 0.59);
    constexpr double kConstant = -kBright * 0.14;
    return (-kLinear + std::sqrt(kLinear * kLinear - 4.0 * kSquare * kConstant)) / (2.0 * kSquare);
}

/// Exposures from where the brightest pixel is shown as 0.85 to where the median of the lit ones is; empty
/// for a picture without light.
std::vector<double> choose_exposures(const Colors& radiance) {
    std::vector<double> positive;
    for (const glm::vec3& color : radiance) {
        // Rec. 709, with the digits that the rest of FLIP has.
        const double y = (2613072.0 * color.r + 8788810.0 * color.g + 887015.0 * color.b) / 12288897.0;
        if (y > 0.0) positive.push_back(y);
    }
    if (positive.empty()) return {};
    const auto middle = positive.begin() + static_cast<std::ptrdiff_t>(positive.size() / 2);
    std::nth_element(positive.begin(), middle, positive.end());
    const double brightest = *std::max_element(middle, positive.end());
    const double bright = radiance_shown_bright();
    const double first = std::log2(bright / brightest), last = std::log2(bright / *middle);
    if (first == last) return {first};
    const int count = std::max(2, static_cast<int>(std::ceil(last - first)));
    std::vector<double> exposures;
    for (int i = 0; i < count; ++i) exposures.push_back(first + i * (last - first) / (count - 1));
    return exposures;
}

}  // namespace

bool is_low_dynamic_range(std::span<const glm::vec3> picture) {
    return std::all_of(picture.begin(), picture.end(), [](const glm::vec3& color) {
        return color.r >= 0.0f && color.r <= 1.0f && color.g >= 0.0f && color.g <= 1.0f && color.b >= 0.0f &&
               color.b <= 1.0f;
    });
}

FlipResult flip_ldr(std::span<const glm::vec3> test, std::span<const glm::vec3> reference, int width,
                    int height, double pixels_per_degree) {
    const Pair pair(test, reference);
    const auto clamped = [](const glm::vec3& color) {
        return glm::clamp(color, glm::vec3(0.0f), glm::vec3(1.0f));
    };
    FlipResult result;
    result.map.assign(test.size(), 0.0f);
    FlipMapper(width, height, pixels_per_degree)
        .raise(transformed(pair.test, clamped), transformed(pair.reference, clamped), result.map);
    summarize(result, pair);
    return result;
}

FlipResult flip_hdr(std::span<const glm::vec3> test, std::span<const glm::vec3> reference, int width,
                    int height, double pixels_per_degree) {
    const Pair pair(test, reference);
    FlipResult result;
    result.map.assign(test.size(), 0.0f);
    result.exposures = choose_exposures(pair.reference);
    if (result.exposures.empty()) result.exposures = choose_exposures(pair.test);
    FlipMapper mapper(width, height, pixels_per_degree);
    for (const double exposure : result.exposures) {
        mapper.raise(shown_at(pair.test, exposure), shown_at(pair.reference, exposure), result.map);
    }
    summarize(result, pair);
    return result;
}

glm::vec3 magma(float value) {
    // At k / 15; straight lines between them stay within 2.2 / 255 of all 256 published colours.
    static constexpr float kColors[][3] = {
        {0.001f, 0.000f, 0.014f}, {0.044f, 0.034f, 0.142f}, {0.124f, 0.067f, 0.296f},
        {0.232f, 0.060f, 0.438f}, {0.341f, 0.081f, 0.493f}, {0.445f, 0.123f, 0.507f},
        {0.550f, 0.161f, 0.506f}, {0.658f, 0.196f, 0.490f}, {0.767f, 0.234f, 0.458f},
        {0.869f, 0.288f, 0.409f}, {0.944f, 0.378f, 0.365f}, {0.981f, 0.498f, 0.370f},
        {0.995f, 0.624f, 0.427f}, {0.997f, 0.748f, 0.517f}, {0.993f, 0.870f, 0.626f},
        {0.987f, 0.991f, 0.750f}};
    constexpr std::size_t kLast = std::size(kColors) - 1;
    if (std::isnan(value)) return {1.0f, 0.0f, 1.0f};
    const float position = std::clamp(value, 0.0f, 1.0f) * static_cast<float>(kLast);
    const std::size_t below = std::min(static_cast<std::size_t>(position), kLast - 1);
    const float weight = position - static_cast<float>(below);
    glm::vec3 color;
    for (int i = 0; i < 3; ++i) {
        color[i] = (1.0f - weight) * kColors[below][i] + weight * kColors[below + 1][i];
    }
    return color;
}

}  // namespace core
