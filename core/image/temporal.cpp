#include "core/image/temporal.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/image/image.h"
#include "core/image/tonemap.h"

namespace core {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool is_finite(std::span<const Frame> frames) {
    return std::all_of(frames.begin(), frames.end(), [](const Frame& frame) {
        return std::all_of(frame.begin(), frame.end(), [](const glm::vec3& color) {
            return std::isfinite(color.r) && std::isfinite(color.g) && std::isfinite(color.b);
        });
    });
}

double shown(const glm::vec3& radiance, float scale) {
    const glm::vec3 displayed = tone_curve(ToneMap::kAces, radiance * scale);
    return 0.2126 * srgb_from_linear(displayed.r) + 0.7152 * srgb_from_linear(displayed.g) +
           0.0722 * srgb_from_linear(displayed.b);
}

/// Sums of luminance over blocks of pixels; smaller blocks at the border weigh less.
std::vector<double> block_sums(const Frame& frame, int width, int block) {
    const auto columns = static_cast<std::size_t>(width), size = static_cast<std::size_t>(block);
    const std::size_t block_columns = (columns + size - 1) / size;
    const std::size_t block_rows = (frame.size() / columns + size - 1) / size;
    std::vector<double> sums(block_columns * block_rows, 0.0);
    for (std::size_t pixel = 0; pixel < frame.size(); ++pixel) {
        sums[pixel / columns / size * block_columns + pixel % columns / size] += luminance(frame[pixel]);
    }
    return sums;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
    return sum;
}

}  // namespace

double temporal_deviation(std::span<const Frame> frames) {
    assert(frames.size() >= 2);
    if (!is_finite(frames)) return kNaN;
    constexpr double kFloor = 0.01;
    const double count = static_cast<double>(frames.size());
    const std::size_t pixel_count = frames[0].size();
    double sum = 0.0;
    for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
        double mean = 0.0, squares = 0.0;
        for (const Frame& frame : frames) mean += luminance(frame[pixel]) / count;
        for (const Frame& frame : frames) {
            const double difference = luminance(frame[pixel]) - mean;
            squares += difference * difference;
        }
        sum += std::sqrt(squares / (count - 1.0)) / (std::abs(mean) + kFloor);
    }
    return sum / static_cast<double>(pixel_count);
}

double flicker(std::span<const Frame> frames, float ev) {
    assert(frames.size() >= 2);
    if (!is_finite(frames)) return kNaN;
    const float scale = exposure_scale(ev);
    const std::size_t pixel_count = frames[0].size();
    double sum = 0.0;
    for (std::size_t pixel = 0; pixel < pixel_count; ++pixel) {
        double last = shown(frames[0][pixel], scale);
        for (const Frame& frame : frames.subspan(1)) {
            const double value = shown(frame[pixel], scale);
            sum += std::abs(value - last);
            last = value;
        }
    }
    return sum / static_cast<double>(pixel_count) / static_cast<double>(frames.size() - 1);
}

std::optional<std::size_t> reaction_frames(std::span<const Frame> frames, const Frame& before,
                                           const Frame& after, int width, const ReactionOptions& options) {
    assert(!frames.empty() && options.block > 0);
    assert(before.size() == after.size() && frames[0].size() == after.size());
    assert(width > 0 && after.size() % static_cast<std::size_t>(width) == 0);
    const Frame ends[] = {before, after};
    if (!is_finite(frames) || !is_finite(ends)) return std::nullopt;
    const std::vector<double> goal = block_sums(after, width, options.block);
    const double allowed = options.tolerance * distance(block_sums(before, width, options.block), goal);
    if (allowed == 0.0) return std::nullopt;
    std::size_t settled = frames.size();
    while (settled > 0 && distance(block_sums(frames[settled - 1], width, options.block), goal) <= allowed) {
        --settled;
    }
    if (settled == frames.size()) return std::nullopt;
    return settled;
}

}  // namespace core
