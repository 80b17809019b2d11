#include <cmath>

#include "cli/picture_metrics.h"
#include "cli/report.h"

namespace cli {

namespace {

using nlohmann::json;

/// JSON knows no infinity and no NaN.
json number(double value) {
    return std::isfinite(value) ? json(value) : json(nullptr);
}

json as_json(const Estimate& estimate) {
    return {
        {"value", number(estimate.value)}, {"low", number(estimate.low)}, {"high", number(estimate.high)}};
}

json as_json(const std::optional<Estimate>& estimate) {
    return estimate ? as_json(*estimate) : json(nullptr);
}

json as_json(const ReportPoint& point) {
    json metrics = metrics_json({.image = point.metrics, .flip = point.flip}, false);
    metrics["leak_counts"] = point.metrics.leak.counts;
    return {{"samples_per_pixel", point.samples_per_pixel},
            {"seed", point.seed},
            {"seconds", point.seconds},
            {"cpu_seconds", point.cpu_seconds},
            {"rays", point.rays},
            {"rel_mse", as_json(point.rel_mse)},
            {"pareto", point.pareto},
            {"metrics", metrics},
            {"command", point.command}};
}

json as_json(const ReportSeries& series) {
    json stages = json::array(), points = json::array();
    for (const StageCost& stage : series.stages) {
        stages.push_back({{"name", stage.name}, {"seconds", stage.seconds}, {"rays", stage.rays}});
    }
    for (const ReportPoint& point : series.points) points.push_back(as_json(point));
    return {{"method", series.method},
            {"settings",
             {{"renderer", series.renderer},
              {"tracer", series.tracer},
              {"resolution", series.resolution},
              {"hit_mode", series.hit_mode.empty() ? json(nullptr) : json(series.hit_mode)},
              {"median_voxel", series.median_voxel}}},
            {"seconds",
             {{"load", series.load_seconds}, {"bake", series.bake_seconds}, {"build", series.build_seconds}}},
            {"bake_reused", series.bake_reused},
            {"bake_recorded", series.bake_recorded},
            {"bytes", series.bytes},
            {"floor", as_json(series.floor)},
            {"variance_seconds", as_json(series.variance_seconds)},
            {"seconds_to_5_percent", as_json(series.seconds_to_5_percent)},
            {"rel_mse_at_equal_time", as_json(series.rel_mse_at_equal_time)},
            {"stages", stages},
            {"points", points}};
}

json as_json(const PairedComparison& pair) {
    return {{"better", pair.better},
            {"worse", pair.worse},
            {"rel_mse_difference", as_json(pair.difference)},
            {"decided", pair.decided}};
}

json as_json(const ReportGeometry& geometry) {
    return {{"method", geometry.method},
            {"resolution", geometry.resolution},
            {"rays", geometry.rays},
            {"hit_in_either", geometry.either},
            {"miss_percent", geometry.miss_percent},
            {"false_hit_percent", geometry.false_hit_percent},
            {"disagree_beyond_silhouettes_percent", geometry.disagree_beyond_percent},
            {"shadow_disagree_percent", geometry.shadow_disagree_percent},
            {"voxels",
             {{"p50", geometry.p50_voxels}, {"p99", geometry.p99_voxels}, {"max", geometry.max_voxels}}},
            {"beyond_silhouettes_voxels", {{"p99", geometry.p99_beyond_voxels}}},
            {"normal_degrees", geometry.normal_degrees},
            {"steps_per_ray", geometry.steps_per_ray},
            {"exhausted_percent", geometry.exhausted_percent},
            {"triangle_mrays", number(geometry.triangle_mrays)},
            {"field_mrays", number(geometry.field_mrays)}};
}

}  // namespace

json report_json(const Report& report) {
    json series = json::array(), pareto = json::array(), paired = json::array(), geometry = json::array(),
         pictures = json::array();
    for (const ReportSeries& one : report.series) {
        series.push_back(as_json(one));
        for (const ReportPoint& point : one.points) {
            if (!point.pareto) continue;
            pareto.push_back({{"method", one.method},
                              {"samples_per_pixel", point.samples_per_pixel},
                              {"seconds", point.seconds},
                              {"rel_mse", number(point.rel_mse.value)}});
        }
    }
    for (const PairedComparison& one : report.paired) paired.push_back(as_json(one));
    for (const ReportGeometry& one : report.geometry) geometry.push_back(as_json(one));
    for (const ReportPicture& one : report.pictures) {
        pictures.push_back({{"name", one.name}, {"exr", one.exr}});
    }
    return {{"schema", 1},
            {"scene", report.scene},
            {"scene_hash", report.scene_hash},
            {"command", report.command},
            {"version", report.version},
            {"date", report.date},
            {"seed", report.seed},
            {"width", report.width},
            {"height", report.height},
            {"bounces", report.bounces < 0 ? json(nullptr) : json(report.bounces)},
            {"camera", report.camera},
            {"sky", report.sky},
            {"sun", report.sun},
            {"threads", report.threads},
            {"peak_bytes", report.peak_bytes},
            {"machine",
             {{"processor", report.processor},
              {"cores", report.cores},
              {"isa", report.isa},
              {"system", report.system},
              {"compiler", report.compiler},
              {"flags", report.flags},
              {"commit", report.commit}}},
            {"reference",
             {{"samples_per_pixel", report.reference_samples},
              {"seed", report.reference_seed},
              {"reused", report.reference_reused},
              {"seconds", report.reference_seconds},
              {"render_seconds",
               report.reference_render_seconds ? number(*report.reference_render_seconds) : json(nullptr)},
              {"rel_variance", number(report.reference_rel_variance)},
              {"command", report.reference_command}}},
            {"equal_seconds", report.equal_seconds},
            {"verdict", report.verdict},
            {"winner", report.winner.empty() ? json(nullptr) : json(report.winner)},
            {"paired", paired},
            {"warnings", report.warnings},
            {"series", series},
            {"pareto", pareto},
            {"geometry_rays", report.geometry_rays},
            {"geometry", geometry},
            {"pictures", pictures}};
}

}  // namespace cli
