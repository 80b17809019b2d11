#include "cli/comparison_methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "cli/recorded_seconds.h"
#include "cli/stage_clock.h"
#include "core/support/hash.h"
#include "sdf/transform_scale.h"

namespace cli {

namespace {

namespace fs = std::filesystem;

/// Beside the fields: what baking all of them took, which the files themselves must not depend on.
constexpr const char* kPriceFile = "bake_seconds.json";

/// Hash of what the fields were baked from and how.
std::string price_key(const sdf::BakeResult& baked) {
    core::Hasher hasher;
    hasher.add_text(FIELDLIGHT_VERSION);
    for (const sdf::MeshBake& mesh : baked.meshes) {
        if (!mesh.grid) continue;
        hasher.add_text(mesh.info().source_hash);
        hasher.add_text(mesh.info().settings_hash);
    }
    return hasher.hex();
}

void set_bake_price(const fs::path& folder, const sdf::BakeResult& baked, ReportSeries& series) {
    const auto is_reused = [](const sdf::MeshBake& mesh) { return mesh.reused; };
    series.bake_seconds = baked.seconds;
    if (std::none_of(baked.meshes.begin(), baked.meshes.end(), is_reused)) {
        record_seconds(folder / kPriceFile, price_key(baked), baked.seconds);
        return;
    }
    series.bake_reused = true;
    if (!std::all_of(baked.meshes.begin(), baked.meshes.end(), is_reused)) return;
    if (const std::optional<double> seconds = recorded_seconds(folder / kPriceFile, price_key(baked))) {
        series.bake_seconds = *seconds;
        series.bake_reused = false;
        series.bake_recorded = true;
    }
}

double median_voxel(const core::Scene& scene, const std::vector<double>& voxel_of_mesh) {
    std::vector<double> voxels;
    for (const core::Instance& instance : scene.instances) {
        const double voxel = voxel_of_mesh[instance.mesh];
        if (voxel > 0.0) {
            voxels.push_back(voxel * sdf::largest_singular_value(glm::dmat3(instance.world_from_local)));
        }
    }
    if (voxels.empty()) return 0.0;
    const auto middle = voxels.begin() + static_cast<std::ptrdiff_t>(voxels.size() / 2);
    std::nth_element(voxels.begin(), middle, voxels.end());
    return *middle;
}

RenderOptions render_options(const CompareSceneOptions& options, TracerKind kind) {
    RenderOptions render;
    render.scene = options.scene;
    render.tracer = render.primary = kind;
    render.width = options.width;
    render.height = options.height;
    render.bounces = options.bounces;
    render.gather = options.gather;
    return render;
}

Method triangles(const CompareSceneOptions& options, const core::Scene& scene) {
    Method method;
    method.render = render_options(options, TracerKind::kTriangle);
    StageClock clock;
    SceneTracers tracers;
    tracers.triangle = std::make_unique<core::TriangleTracer>(scene);
    method.series.build_seconds = clock.lap();
    method.series.method = "triangles";
    method.series.bytes = tracers.triangle->bytes();
    method.tracers = std::make_shared<const SceneTracers>(std::move(tracers));
    return method;
}

Method fields(const Program& program, const CompareSceneOptions& options, const core::Scene& scene,
              int resolution, std::vector<std::string>& warnings) {
    Method method;
    method.render = render_options(options, TracerKind::kSdf);
    method.render.bake.resolution = resolution;
    method.render.bake.sample_bits = options.sample_bits;
    method.render.hit_mode = options.hit_mode;
    const fs::path folder = options.bake_folder.empty() ? options.folder / "fields" : options.bake_folder;
    method.render.bake_folder = folder / std::to_string(resolution);
    method.series.method = fmt::format("fields {}", resolution);
    method.series.resolution = resolution;
    method.series.hit_mode = name_of(options.hit_mode);

    const sdf::BakeResult baked = bake_fields(program, scene, method.render.bake, method.render.bake_folder);
    set_bake_price(method.render.bake_folder, baked, method.series);
    for (const std::string& missing : missing_meshes(baked)) {
        warnings.push_back(fmt::format("{}: {}", method.series.method, missing));
    }
    StageClock clock;
    const auto grids = sdf::grids_by_mesh(scene, baked);
    SceneTracers tracers;
    tracers.sdf = std::make_unique<sdf::SdfTracer>(scene, grids, options.hit_mode);
    method.series.build_seconds = clock.lap();
    for (const auto& grid : grids) method.voxel_of_mesh.push_back(grid ? grid->voxel_size() : 0.0);
    method.series.median_voxel = median_voxel(scene, method.voxel_of_mesh);
    method.series.bytes = tracers.sdf->bytes();
    method.tracers = std::make_shared<const SceneTracers>(std::move(tracers));
    return method;
}

}  // namespace

std::string Method::file_stem() const {
    std::string stem = series.method;
    std::replace(stem.begin(), stem.end(), ' ', '_');
    return stem;
}

std::vector<Method> prepare_methods(const Program& program, const CompareSceneOptions& options,
                                    const core::Scene& scene, double load_seconds,
                                    std::vector<std::string>& warnings) {
    std::vector<Method> traced;
    traced.push_back(triangles(options, scene));
    for (const int resolution : options.resolutions) {
        traced.push_back(fields(program, options, scene, resolution, warnings));
    }
    std::vector<Method> methods;
    for (const RendererKind renderer : options.renderers) {
        for (Method method : traced) {
            method.render.renderer = renderer;
            method.series.renderer = name_of(renderer);
            method.series.tracer = name_of(method.render.tracer);
            method.series.load_seconds = load_seconds;
            if (renderer == RendererKind::kGather) method.series.method = "gather " + method.series.method;
            methods.push_back(std::move(method));
        }
    }
    return methods;
}

}  // namespace cli
