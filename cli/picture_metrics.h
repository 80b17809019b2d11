// cli/picture_metrics.h: the numbers that `compare` gives of a picture against its reference, listed once:
// for two pictures and for the points of a scene's report, in tables, thresholds and JSON.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <span>

#include "core/image/error_interval.h"
#include "core/image/metrics.h"

namespace cli {

/// What is measured. What is not defined, or not asked for, is NaN.
struct PictureMetrics {
    static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

    core::ImageMetrics image;
    double flip = kNaN;      ///< Mean HDR FLIP.
    double flip_ldr = kNaN;  ///< Mean LDR FLIP; only where all values lie in [0, 1].
    double ssim = kNaN;
    core::ErrorInterval corrected{kNaN, kNaN, kNaN};  ///< Only where the reference brings its variance.
};

/// When a number is beyond its threshold.
enum class Limit {
    kSize,      ///< Where its absolute value is larger.
    kUpperEnd,  ///< Where the upper end of its interval is larger.
    kSmallest,  ///< Where it is smaller.
};

/// Which JSON objects hold a number, and where.
enum class JsonPlace {
    kBoth,         ///< Of two pictures, and of a report's points.
    kPercentiles,  ///< Of both, in their object `percentiles`.
    kTwoPictures,  ///< Of two pictures alone.
};

/// One number: where it stands in the JSON, how it is shown, and the flag that limits it.
struct PictureMetric {
    const char* key;   ///< Of the JSON.
    const char* flag;  ///< Its threshold.
    const char* label;
    const char* definition;
    double (*value)(const PictureMetrics&);
    JsonPlace place = JsonPlace::kBoth;
    Limit limit = Limit::kSize;
    const char* undefined = nullptr;  ///< Why there may be none, in finite pictures.
};

/// All of them, in the order of the tables.
std::span<const PictureMetric> picture_metrics();

/// The keys that two pictures and a report's points share, `nonfinite_pixels` included; with `all` those of
/// two pictures alone, too. What is not finite is null.
nlohmann::json metrics_json(const PictureMetrics& metrics, bool all);

}  // namespace cli
