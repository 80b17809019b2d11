// cli/report.h: what `fieldlight compare SCENE` found, as plain data, and the three files it is told in.
//
// The measuring (cli/compare_scene) fills it; report_json, report_csv and report_html only tell it, so that
// the three files cannot disagree.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/image/block_errors.h"
#include "core/image/metrics.h"

namespace cli {

/// A measured value with its 95 % interval.
struct Estimate {
    double value = 0.0;
    double low = 0.0;
    double high = 0.0;
};

/// Time and rays of one part of the work: load, bake, build, or a pass of the renderer.
struct StageCost {
    std::string name;
    double seconds = 0.0;
    std::uint64_t rays = 0;
};

/// One rung of a ladder: one method at one number of samples.
struct ReportPoint {
    int samples_per_pixel = 0;  ///< Frames, where the gather made it.
    std::uint64_t seed = 0;     ///< Every rung has its own, the same for all methods.
    double seconds = 0.0;       ///< Wall time of the rendering alone (warm).
    double cpu_seconds = 0.0;   ///< Processor time of the same, over all threads.
    std::uint64_t rays = 0;
    core::ImageMetrics metrics;  ///< Against the reference, as measured: its noise included.
    Estimate rel_mse;            ///< metrics.rel_mse without the reference's variance.
    core::BlockErrors blocks;    ///< What rel_mse is the mean of; not told, but compared in pairs.
    double flip = 0.0;           ///< Mean HDR FLIP; NaN where it is not defined.
    bool pareto = false;         ///< No point of any series has less error in no more time (warm).
    std::string command;         ///< Renders this picture.
};

/// One way of making the picture, with everything but the samples fixed.
struct ReportSeries {
    std::string method;         ///< Shown and unique: "triangles", "fields 128", "gather fields 128".
    std::string renderer;       ///< path or gather
    std::string tracer;         ///< triangle or sdf
    int resolution = 0;         ///< Voxels on the longest side of a mesh; 0 for triangles.
    std::string hit_mode;       ///< eps, secant or cubic; empty for triangles.
    double median_voxel = 0.0;  ///< World size, median over instances; 0 for triangles.
    double load_seconds = 0.0, bake_seconds = 0.0, build_seconds = 0.0;  ///< What cold adds to warm.
    bool bake_reused = false;  ///< Some field came from an earlier run: bake_seconds is not the whole price.
    bool bake_recorded = false;  ///< All fields did, and bake_seconds is what that run recorded beside them.
    std::uint64_t bytes = 0;     ///< Of the acceleration structure.
    std::vector<ReportPoint> points;  ///< Ascending samples.

    /// relMSE(t) = floor + variance_seconds / t in warm wall time: what no time removes, and the time to unit
    /// error above it. Fitted over samples, which the last rung's time turns into seconds. Empty where fewer
    /// than three points allow no fit.
    std::optional<Estimate> floor;
    std::optional<Estimate> variance_seconds;
    std::optional<Estimate>
        seconds_to_5_percent;  ///< Warm time to relMSE 0.05^2; empty if the floor forbids.
    std::optional<Estimate> rel_mse_at_equal_time;  ///< At Report::equal_seconds.

    std::vector<StageCost> stages;  ///< Of the last rung.

    /// One of its rungs, for a person: "4 spp", or of the gather "4 frames".
    std::string rung_name(int samples) const;
};

/// Two methods at equal time, block by block against the one reference, so that its noise cancels.
struct PairedComparison {
    std::string better, worse;  ///< Methods; `better` has the smaller error.
    Estimate difference;        ///< Of relMSE: what `worse` has more; see core::paired_difference.
    bool decided = false;       ///< The interval leaves 0 out.
};

/// A scene's fields against its triangles on the same rays; definitions in core/trace/tracer_difference.h.
struct ReportGeometry {
    std::string method;  ///< Of the first series that traces these fields.
    int resolution = 0;
    std::uint64_t rays = 0;
    std::uint64_t either = 0;              ///< Rays that hit in either tracer.
    double miss_percent = 0.0;             ///< Of `either`: hit by triangles alone.
    double false_hit_percent = 0.0;        ///< Of `either`: hit by fields alone.
    double disagree_beyond_percent = 0.0;  ///< Both kinds, beyond one voxel from silhouettes.
    double shadow_disagree_percent = 0.0;  ///< Of occlusion queries from the hits.
    double p50_voxels = 0.0, p99_voxels = 0.0, max_voxels = 0.0;  ///< |dt| (n.d), raw.
    double p99_beyond_voxels = 0.0;  ///< The same beyond one voxel from silhouettes.
    double normal_degrees = 0.0;     ///< Mean angle, beyond silhouettes.
    double steps_per_ray = 0.0;
    double exhausted_percent = 0.0;
    double triangle_mrays = 0.0, field_mrays = 0.0;  ///< Millions of rays a second, one thread, same rays.
};

/// A picture for the viewer. All have the size of the report.
struct ReportPicture {
    std::string name;                   ///< "reference", or the method of a series (its last rung).
    std::string exr;                    ///< File name in the report's folder that holds the same values.
    std::vector<glm::vec3> radiance;    ///< Row-major, top row first.
    std::vector<float> flip;            ///< Against the reference, [0, 1]; empty for the reference.
    std::vector<float> relative_error;  ///< |Y_I - Y_R| / (|Y_R| + 0.01); empty for the reference.
    std::vector<float> steps;           ///< Mean tracer steps of the camera rays; empty where not asked for.
};

/// The whole report.
struct Report {
    std::string scene;  ///< File name.
    std::string scene_hash;
    std::string command;  ///< As typed.
    std::string version;
    std::string commit;  ///< Of the build; "unknown" outside a checkout.
    std::string compiler, flags, processor, isa, system;
    int cores = 0, threads = 0;
    std::string date;  ///< ISO 8601, UTC.
    std::uint64_t seed = 0;
    int width = 0, height = 0;
    int bounces = -1;  ///< -1: no limit.
    std::string camera, sky, sun;

    std::uint64_t peak_bytes = 0;  ///< Most memory that the comparison held.

    int reference_samples = 0;
    std::uint64_t reference_seed = 0;
    bool reference_reused = false;
    double reference_seconds = 0.0;                  ///< Of this run; 0 where it was reused.
    std::optional<double> reference_render_seconds;  ///< In whichever run; empty where none recorded it.
    double reference_rel_variance = 0.0;             ///< Its own relMSE against the truth, from its variance.
    std::string reference_command;

    double equal_seconds = 0.0;            ///< The time at which the methods are compared at equal time.
    std::vector<PairedComparison> paired;  ///< At that time: every pair of methods that reached it.
    std::string winner;   ///< The method that is decided to be better than all others, or empty.
    std::string verdict;  ///< One sentence.
    std::vector<std::string> warnings;

    std::vector<ReportSeries> series;
    std::vector<ReportGeometry> geometry;
    std::string geometry_rays;            ///< Which rays these are, in words.
    std::vector<ReportPicture> pictures;  ///< The reference first.
};

/// The object of report.json (schema 1): `geometry`, `series` (method, settings, seconds, cpu_seconds, rays,
/// metrics, command), `pareto` and everything else but the values of pictures and blocks.
nlohmann::json report_json(const Report& report);

/// What a person reads on the terminal: a line a rung, the geometry, the verdict.
std::string report_text(const Report& report);

/// One line a point, with a header line; RFC 4180.
std::string report_csv(const Report& report);

/// One self-contained page, under 10 MB: no request, usable without scripts. Pictures that do not fit are
/// shown as thumbnails only, and the page says so.
std::string report_html(const Report& report);

}  // namespace cli
