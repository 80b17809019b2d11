#include "cli/picture_metrics.h"

#include <cmath>

namespace cli {

namespace {

using Metrics = PictureMetrics;

constexpr const char* kBlackReference = "the reference is black";

const PictureMetric kMetrics[] = {
    {"mse", "--fail-mse", "MSE", "mean (I - R)^2", [](const Metrics& m) { return m.image.mse; }},
    {"rel_mse", "--fail-rel-mse", "relMSE", "mean (I - R)^2 / (R^2 + 0.01)",
     [](const Metrics& m) { return m.image.rel_mse; }},
    {"rel_mse_trimmed", "--fail-rel-mse-trimmed", "relMSE, trimmed", "without the worst 0.1 % of the pixels",
     [](const Metrics& m) { return m.image.rel_mse_trimmed; }},
    {"mrse", "--fail-mrse", "MRSE", "mean (I - R)^2 / (R + 0.01)^2, as pbrt",
     [](const Metrics& m) { return m.image.mrse; }},
    {"mape", "--fail-mape", "MAPE", "mean |I - R| / (R + 0.01)",
     [](const Metrics& m) { return m.image.mape; }},
    {"smape", "--fail-smape", "SMAPE", "mean |I - R| / (|I| + |R| + 0.01)",
     [](const Metrics& m) { return m.image.smape; }},
    {"50", "--fail-p50", "relative error P50", "of |Y_I - Y_R| / (Y_R + 0.01) over the pixels",
     [](const Metrics& m) { return m.image.p50; }, JsonPlace::kPercentiles},
    {"95", "--fail-p95", "relative error P95", "", [](const Metrics& m) { return m.image.p95; },
     JsonPlace::kPercentiles},
    {"99", "--fail-p99", "relative error P99", "", [](const Metrics& m) { return m.image.p99; },
     JsonPlace::kPercentiles},
    {"99.9", "--fail-p99.9", "relative error P99.9", "", [](const Metrics& m) { return m.image.p99_9; },
     JsonPlace::kPercentiles},
    {"max", "--fail-max", "relative error, max", "", [](const Metrics& m) { return m.image.max; }},
    {"energy_bias", "--fail-energy-bias", "energy bias, %", "100 (sum Y_I / sum Y_R - 1)",
     [](const Metrics& m) { return m.image.energy_bias_percent; }, JsonPlace::kBoth, Limit::kSize,
     kBlackReference},
    {"leak", "--fail-leak", "leak", "sum max(Y_I - Y_R, 0) where R is dark / sum Y_R",
     [](const Metrics& m) { return m.image.leak.energy_fraction; }, JsonPlace::kBoth, Limit::kSize,
     kBlackReference},
    {"flip", "--fail-flip", "FLIP", "mean HDR FLIP, ACES, 67 pixels a degree",
     [](const Metrics& m) { return m.flip; }},
    {"flip_ldr", "--fail-flip-ldr", "FLIP, LDR", "mean LDR FLIP of linear values in [0, 1]",
     [](const Metrics& m) { return m.flip_ldr; }, JsonPlace::kTwoPictures, Limit::kSize,
     "a value lies outside [0, 1]"},
    {"ssim", "--fail-ssim", "SSIM", "mean, 11 x 11, sigma 1.5; R's automatic exposure, ACES, sRGB luma",
     [](const Metrics& m) { return m.ssim; }, JsonPlace::kTwoPictures, Limit::kSmallest},
    {"rel_mse_corrected", "--fail-rel-mse-corrected", "relMSE, corrected",
     "without the reference's own noise", [](const Metrics& m) { return m.corrected.value; },
     JsonPlace::kTwoPictures, Limit::kUpperEnd, "the reference has no Variance.R, .G, .B"},
};

}  // namespace

std::span<const PictureMetric> picture_metrics() {
    return kMetrics;
}

nlohmann::json metrics_json(const PictureMetrics& metrics, bool all) {
    nlohmann::json object = {{"percentiles", nlohmann::json::object()}};
    for (const PictureMetric& metric : kMetrics) {
        if (metric.place == JsonPlace::kTwoPictures && !all) continue;
        nlohmann::json& parent = metric.place == JsonPlace::kPercentiles ? object.at("percentiles") : object;
        const double value = metric.value(metrics);
        parent[metric.key] = std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
    }
    object["nonfinite_pixels"] = metrics.image.nonfinite_pixels;
    return object;
}

}  // namespace cli
