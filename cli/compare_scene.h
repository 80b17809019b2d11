// cli/compare_scene.h: `fieldlight compare SCENE`: fields against triangles, the gather against the path
// tracer, accuracy against time.
//
// A reference with its variance, path-traced on triangles; then every method (each renderer over triangles,
// and over fields at each resolution) at 1, 2, 4, ... samples a pixel, which are frames of the gather,
// interleaved, every rung a fresh picture with its own seed; then the fields' rays against the triangles'
// rays. What comes out is a cli::Report.
#pragma once

#include <filesystem>
#include <vector>

#include "cli/options.h"
#include "cli/render_job.h"
#include "cli/scene_setup.h"
#include "sdf/field_kernel.h"

namespace cli {

/// What is compared, and how far the ladder goes. By default a few minutes on two cores.
struct CompareSceneOptions {
    SceneOptions scene;
    std::filesystem::path folder;       ///< Everything is written here.
    std::filesystem::path bake_folder;  ///< Holds a folder a resolution; empty: `fields` in `folder`.
    int width = 400, height = 225;
    std::vector<RendererKind> renderers = {RendererKind::kPath};  ///< None twice.
    gather::Settings gather;                        ///< Of the gather's methods; the ladder sets `frames`.
    int bounces = -1;                               ///< Of all methods; -1: no limit.
    std::vector<int> resolutions = {64, 128, 256};  ///< Voxels on the longest side; ascending, none twice.
    sdf::HitMode hit_mode = sdf::HitMode::kCubic;   ///< Of all fields.
    sdf::SampleBits sample_bits = sdf::SampleBits::k16;
    int max_samples = 64;              ///< The ladder's last rung; powers of two before it.
    int reference_samples = 1024;      ///< At least 8, one a batch of the variance.
    double time_budget_seconds = 0.0;  ///< Ends the ladder before a rung that would pass it; 0: no limit.
};

/// Measures and writes `report.json`, `report.csv`, `report.html` and `pictures/`; keeps `reference/` and the
/// fields for the next run. Prints a table, or the object of report.json under --json. Sets the exit code to
/// 1 where the report warns.
/// @throws core::InputError, core::Interrupted; std::runtime_error if a pixel is not finite
void compare_scene(Program& program, const CompareSceneOptions& options);

}  // namespace cli
