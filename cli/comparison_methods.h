// cli/comparison_methods.h: the ways of making a picture that `compare SCENE` sets against each other.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cli/compare_scene.h"
#include "cli/render_job.h"
#include "cli/report.h"
#include "cli/scene_tracers.h"
#include "core/image/image.h"

namespace cli {

/// One method, ready to render, and what is known of it so far.
struct Method {
    ReportSeries series;
    RenderOptions render;                         ///< Of every picture of it, but for samples, seed and file.
    std::shared_ptr<const SceneTracers> tracers;  ///< Shared by the renderers.
    std::vector<double> voxel_of_mesh;            ///< As core::TracerPair wants it; empty for triangles.

    core::Image last;                  ///< The picture of the last rung.
    std::vector<float> last_flip;      ///< Its FLIP map.
    std::uint64_t exhausted_rays = 0;  ///< Over all rungs.

    /// What its files are called: triangles, gather_fields_128.
    std::string file_stem() const;
};

/// Bakes what is missing and builds: renderer by renderer, triangles first, then the fields by ascending
/// resolution. `scene` must outlive the methods. Meshes that cannot be baked end up in `warnings`.
/// @throws core::InputError, core::Interrupted
std::vector<Method> prepare_methods(const Program& program, const CompareSceneOptions& options,
                                    const core::Scene& scene, double load_seconds,
                                    std::vector<std::string>& warnings);

}  // namespace cli
