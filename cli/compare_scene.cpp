#include "cli/compare_scene.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <ctime>

#include "cli/comparison_methods.h"
#include "cli/ladder.h"
#include "cli/machine.h"
#include "cli/reference_picture.h"
#include "cli/render_line.h"
#include "cli/report.h"
#include "cli/stage_clock.h"
#include "cli/verdict.h"
#include "core/image/exr.h"
#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "core/support/parallel.h"
#include "core/trace/tracer_difference.h"

namespace cli {

namespace {

namespace fs = std::filesystem;

constexpr int kExitWarned = 1;

/// Farther from the ladder's seeds than it has rungs.
constexpr std::uint64_t kReferenceSeedDistance = 1'000'003;

/// Of the rays on which fields and triangles are compared.
constexpr int kGeometryBounces = 2;
constexpr const char* kGeometryRays =
    "one camera ray a pixel, and two cosine-distributed bounces from wherever it hits the triangles; "
    "shadows: "
    "from these hits to where another of the rays, drawn at random, came to";

/// Samples of the pictures of step counts.
constexpr int kStepSamples = 4;

void make_folder(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error || !fs::is_directory(folder) || ::access(folder.c_str(), W_OK) != 0) {
        throw core::InputError(
            core::ErrorKind::kCannotCreate,
            fmt::format("'{}': a folder that can be written to cannot be made there", folder.string()));
    }
}

std::string utc_now() {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    gmtime_r(&now, &parts);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
    return text;
}

std::string camera_name(const SceneOptions& options, const core::Camera& camera) {
    if (!options.eye.empty()) {
        return fmt::format("at {}, looking at {}, {} degrees high", options.eye, options.look_at,
                           options.fov_degrees);
    }
    return camera.name.empty() ? "the first, unnamed" : camera.name;
}

Report describe(const Program& program, const CompareSceneOptions& options, const core::Scene& scene,
                const core::Camera& camera) {
    Report report;
    report.scene = scene.name;
    report.scene_hash = core::scene_hash(scene);
    report.command = shell_line(program.arguments);
    report.version = FIELDLIGHT_VERSION;
    const Machine machine = this_machine();
    report.commit = machine.commit;
    report.compiler = machine.compiler;
    report.flags = machine.flags;
    report.processor = machine.processor;
    report.isa = machine.isa;
    report.system = machine.system;
    report.cores = machine.cores;
    report.threads = core::thread_limit();
    report.date = utc_now();
    report.seed = program.common.seed;
    report.width = options.width;
    report.height = options.height;
    report.bounces = options.bounces;
    report.camera = camera_name(options.scene, camera);
    report.sky = scene.sky_description;
    report.sun = options.scene.sun.empty() ? "none" : options.scene.sun;
    return report;
}

core::Image make_reference(const Program& program, const CompareSceneOptions& options,
                           const core::Scene& scene, const core::Camera& camera, const Method& triangles,
                           Report& report) {
    RenderOptions render = triangles.render;
    render.output = "reference.exr";
    render.renderer = RendererKind::kPath;
    render.samples_per_pixel = options.reference_samples;
    render.seed = program.common.seed + kReferenceSeedDistance;
    render.aovs = {"Variance"};
    ReferencePicture reference =
        reference_picture(program, render, scene, camera, *triangles.tracers, options.folder / "reference");
    report.reference_samples = render.samples_per_pixel;
    report.reference_seed = render.seed;
    report.reference_reused = reference.reused;
    report.reference_seconds = reference.seconds;
    report.reference_render_seconds = reference.render_seconds;
    report.reference_rel_variance = reference.rel_variance;
    report.reference_command = render_line(render, program.common.allow_external);
    return std::move(reference.image);
}

ReportGeometry compare_geometry(const CompareSceneOptions& options, const core::Scene& scene,
                                const core::Camera& camera, const Method& triangles, const Method& fields,
                                std::uint64_t seed) {
    const core::TracerPair pair{scene, *triangles.tracers->triangle, *fields.tracers->sdf,
                                fields.voxel_of_mesh};
    const auto short_seed = static_cast<std::uint32_t>(seed);
    const core::RayStream rays =
        core::picture_rays(pair, camera, options.width, options.height, kGeometryBounces, short_seed);
    const core::TracerDifference found = core::compare_tracers(pair, rays, short_seed, stop_flag());
    ReportGeometry geometry;
    geometry.method = fields.series.method;
    geometry.resolution = fields.series.resolution;
    geometry.rays = found.rays;
    geometry.either = found.either;
    geometry.miss_percent = found.miss_percent();
    geometry.false_hit_percent = found.false_hit_percent();
    geometry.disagree_beyond_percent = found.disagree_beyond_percent();
    geometry.shadow_disagree_percent = found.shadow_disagree_percent();
    geometry.p50_voxels = found.voxels.p50;
    geometry.p99_voxels = found.voxels.p99;
    geometry.max_voxels = found.voxels.max;
    geometry.p99_beyond_voxels = found.voxels_beyond.p99;
    geometry.normal_degrees = found.normal_degrees;
    geometry.steps_per_ray = found.steps_per_ray;
    geometry.exhausted_percent = found.exhausted_percent();
    geometry.triangle_mrays = 1e-6 * found.reference_rays_per_second;
    geometry.field_mrays = 1e-6 * found.tested_rays_per_second;
    return geometry;
}

/// Steps of the camera rays, from a picture of their own: the rungs' times must not pay for counting them.
std::vector<float> step_picture(const Program& program, const core::Scene& scene, const core::Camera& camera,
                                const Method& method) {
    RenderOptions options = method.render;
    options.renderer = RendererKind::kPath;
    options.output = method.file_stem() + "_steps.exr";
    options.samples_per_pixel = kStepSamples;
    options.bounces = 0;
    options.seed = program.common.seed;
    options.aovs = {"Steps"};
    const core::Frame frame = render_frame(program, options, scene, camera, *method.tracers);
    return *frame.image.find("Steps.Y");
}

std::vector<float> relative_errors(const std::vector<glm::vec3>& test,
                                   const std::vector<glm::vec3>& reference) {
    std::vector<float> errors(test.size());
    for (std::size_t i = 0; i < test.size(); ++i) {
        const float expected = core::luminance(reference[i]);
        errors[i] = std::abs(core::luminance(test[i]) - expected) / (std::abs(expected) + 0.01f);
    }
    return errors;
}

ReportPicture picture_of(const Program& program, const core::Scene& scene, const core::Camera& camera,
                         const std::vector<glm::vec3>& reference, const Method& method) {
    ReportPicture picture;
    picture.name = method.series.method;
    picture.exr = fmt::format("pictures/{}.exr", method.file_stem());
    picture.radiance = *method.last.color();
    picture.flip = method.last_flip;
    picture.relative_error = relative_errors(picture.radiance, reference);
    if (method.tracers->sdf) picture.steps = step_picture(program, scene, camera, method);
    return picture;
}

/// The picture as rendered, with the maps that the report shows of it.
void write_picture(const fs::path& folder, const core::Image& rendered, const ReportPicture& picture) {
    core::Image image = rendered;
    if (!picture.flip.empty()) image.add_channel("Flip.Y", picture.flip);
    if (!picture.relative_error.empty()) image.add_channel("RelativeError.Y", picture.relative_error);
    if (!picture.steps.empty()) image.add_channel("Steps.Y", picture.steps);
    core::write_exr(folder / picture.exr, image);
}

void add_pictures(const Program& program, const CompareSceneOptions& options, const core::Scene& scene,
                  const core::Camera& camera, const core::Image& reference,
                  const std::vector<Method>& methods, Report& report) {
    ReportPicture truth;
    truth.name = "reference";
    truth.exr = "pictures/reference.exr";
    truth.radiance = *reference.color();
    write_picture(options.folder, reference, truth);
    report.pictures.push_back(std::move(truth));
    for (const Method& method : methods) {
        ReportPicture picture = picture_of(program, scene, camera, report.pictures.front().radiance, method);
        write_picture(options.folder, method.last, picture);
        report.pictures.push_back(std::move(picture));
    }
}

void warn_of_exhausted(const std::vector<Method>& methods, Report& report) {
    for (const Method& method : methods) {
        if (method.exhausted_rays == 0) continue;
        report.warnings.push_back(fmt::format("{}: {} rays ran out of steps and count as black",
                                              method.series.method, method.exhausted_rays));
    }
}

Report measure(const Program& program, const CompareSceneOptions& options) {
    StageClock clock;
    const core::Scene scene = load_scene(program, options.scene);
    const core::Camera camera =
        choose_camera(program, options.scene, scene, static_cast<double>(options.width) / options.height);
    const double load_seconds = clock.lap();
    // Told now and not after minutes of rendering.
    for (const char* part : {"pictures", "reference"}) make_folder(options.folder / part);
    Report report = describe(program, options, scene, camera);
    std::vector<Method> methods = prepare_methods(program, options, scene, load_seconds, report.warnings);
    const Method& triangles = methods.front();
    const core::Image reference = make_reference(program, options, scene, camera, triangles, report);
    climb_ladder(program, {options.max_samples, program.common.seed, options.time_budget_seconds}, scene,
                 camera, reference, methods);
    report.geometry_rays = kGeometryRays;
    for (const Method& method : methods) {
        // Rays know nothing of the renderer: fields are compared once.
        if (!method.tracers->sdf || method.render.renderer != options.renderers.front()) continue;
        report.geometry.push_back(
            compare_geometry(options, scene, camera, triangles, method, program.common.seed));
    }
    add_pictures(program, options, scene, camera, reference, methods, report);
    warn_of_exhausted(methods, report);
    for (Method& method : methods) report.series.push_back(std::move(method.series));
    judge(report);
    report.peak_bytes = peak_memory_bytes();
    return report;
}

}  // namespace

void compare_scene(Program& program, const CompareSceneOptions& options) {
    const Report report = measure(program, options);
    if (stop_flag()()) throw core::Interrupted();
    const std::string json =
        report_json(report).dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
    core::write_text_atomically(options.folder / "report.json", json + "\n");
    core::write_text_atomically(options.folder / "report.csv", report_csv(report));
    core::write_text_atomically(options.folder / "report.html", report_html(report));
    for (const std::string& warning : report.warnings) warn(program, warning);
    std::fputs(program.common.json ? (json + "\n").c_str() : report_text(report).c_str(), stdout);
    note(program, fmt::format("'{}': the report", (options.folder / "report.html").string()));
    if (!report.warnings.empty()) program.exit_code = kExitWarned;
}

}  // namespace cli
