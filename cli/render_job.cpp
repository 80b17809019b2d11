#include "cli/render_job.h"

#include <fmt/format.h>

#include <memory>
#include <stdexcept>

#include "cli/machine.h"
#include "cli/stage_clock.h"
#include "core/image/png.h"
#include "core/render/path_tracer.h"
#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "core/support/memory.h"
#include "core/support/parallel.h"
#include "gather/effect_costs.h"
#include "gather/final_gather.h"

namespace cli {

namespace {

std::filesystem::path bake_folder(const RenderOptions& options) {
    if (!options.bake_folder.empty()) return options.bake_folder;
    return options.output.parent_path() / (options.scene.file.stem().string() + ".bake");
}

nlohmann::json statistics_of(const Program& program, const RenderOptions& options, const core::Frame& frame,
                             const SceneTracers& tracers, const gather::Plan& plan) {
    nlohmann::json effects = nlohmann::json::object();
    const bool gathers = options.renderer == RendererKind::kGather;
    const auto costs =
        gather::effect_costs(plan, frame.passes, options.width, options.height, options.gather);
    for (std::size_t i = 0; i < (gathers ? gather::kEffectCount : 0); ++i) {
        const auto effect = static_cast<gather::Effect>(i);
        effects[std::string(gather::name_of(effect))] = {
            {"on", plan.on(effect)},       {"reason", plan[effect].reason}, {"passes", costs[i].passes},
            {"seconds", costs[i].seconds}, {"rays", costs[i].rays},         {"bytes", costs[i].bytes}};
    }
    nlohmann::json passes = nlohmann::json::array();
    for (const core::PassCost& pass : frame.passes) {
        passes.push_back({{"name", pass.name}, {"seconds", pass.seconds}, {"rays", pass.rays}});
    }
    const sdf::SdfTracer::Statistics fields =
        tracers.sdf ? tracers.sdf->statistics() : sdf::SdfTracer::Statistics{};
    // Those that were rendered: the gather cuts a crop out of the whole picture.
    const double pixel_count = gathers ? static_cast<double>(options.width) * options.height
                                       : static_cast<double>(frame.image.pixel_count());
    std::string command = "fieldlight";
    for (const std::string& argument : program.arguments) command += " " + argument;
    return {
        {"schema", 1},
        {"version", FIELDLIGHT_VERSION},
        {"command", command},
        {"scene", options.scene.file.string()},
        {"width", frame.image.width()},
        {"height", frame.image.height()},
        {"tracer", name_of(options.tracer)},
        {"primary", name_of(options.primary)},
        {"hit_mode",
         traces_fields(options) ? nlohmann::json(name_of(options.hit_mode)) : nlohmann::json(nullptr)},
        {"sample_bits", traces_fields(options) ? nlohmann::json(static_cast<int>(options.bake.sample_bits))
                                               : nlohmann::json(nullptr)},
        {"renderer", name_of(options.renderer)},
        {"threads", core::thread_limit()},
        {"isa", instruction_set()},
        {"samples_per_pixel", frame.samples_per_pixel},
        {"passes", passes},
        {"rays", frame.rays},
        {"clamped_share", frame.clamped_share},
        {"rays_per_pixel", static_cast<double>(frame.rays) / pixel_count},
        {"sdf", {{"rays", fields.rays}, {"steps", fields.steps}, {"exhausted", fields.exhausted}}},
        {"memory",
         {{"peak_bytes", peak_memory_bytes()},
          {"sdf_bytes", tracers.sdf ? tracers.sdf->bytes() : 0},
          {"triangle_bytes", tracers.triangle ? tracers.triangle->bytes() : 0},
          {"probe_bytes", gather::probe_cache_bytes(plan, options.width, options.height, options.gather)}}},
        {"effects", effects},
        {"nonfinite_pixels", 0}};
}

}  // namespace

const char* name_of(RendererKind kind) {
    return kind == RendererKind::kGather ? "gather" : "path";
}

core::Frame render_frame(const Program& program, const RenderOptions& options, const core::Scene& scene,
                         const core::Camera& camera, const SceneTracers& tracers, const gather::Plan& plan) {
    std::unique_ptr<core::Renderer> renderer;
    if (options.renderer == RendererKind::kGather) {
        renderer = std::make_unique<gather::FinalGather>(options.gather, plan);
    } else {
        renderer = std::make_unique<core::PathTracer>(
            core::PathTracerSettings{options.samples_per_pixel, options.bounces});
    }
    core::Frame frame = renderer->render({.scene = scene,
                                          .camera = camera,
                                          .tracer = tracers.get(options.tracer),
                                          .primary = tracers.get(options.primary),
                                          .width = options.width,
                                          .height = options.height,
                                          .crop = options.crop,
                                          .seed = options.seed,
                                          .aovs = options.aovs,
                                          .time_budget_seconds = options.time_budget_seconds,
                                          .progress = make_progress(program),
                                          .stop_requested = stop_flag()});
    const std::size_t bad = core::count_nonfinite(frame.image);
    if (bad > 0) {
        throw std::runtime_error(
            fmt::format("'{}': {} values of the picture are not finite", options.output.string(), bad));
    }
    return frame;
}

core::ExrAttributes picture_attributes(const RenderOptions& options, const core::Scene& scene,
                                       const std::string& scene_hash, const core::Camera& camera,
                                       const core::Frame& frame, const gather::Plan& plan) {
    const core::CameraRays rays(camera, options.width, options.height);
    core::ExrAttributes attributes;
    // OpenEXR's camera space is left-handed and looks along +Z; glTF's looks along -Z.
    const glm::dmat4 flip_z(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, -1, 0),
                            glm::dvec4(0, 0, 0, 1));
    attributes["worldToCamera"] = glm::mat4(flip_z * rays.camera_from_world());
    attributes["worldToNDC"] = glm::mat4(rays.ndc_from_world());
    const bool gathers = options.renderer == RendererKind::kGather;
    // Without temporal accumulation the picture is the last frame alone.
    const bool last_alone = gathers && !plan.on(gather::Effect::kTemporal);
    attributes["samplesPerPixel"] = last_alone ? 1 : static_cast<int>(frame.samples_per_pixel);
    attributes["seed"] = std::to_string(options.seed);
    attributes["fieldlightVersion"] = std::string(FIELDLIGHT_VERSION);
    attributes["renderer"] = std::string(name_of(options.renderer));
    attributes["tracer"] = std::string(name_of(options.tracer));
    attributes["primary"] = std::string(name_of(options.primary));
    if (gathers) {
        attributes["bounces"] = std::to_string(options.gather.bounces);
        for (const gather::SettingDescription& setting : gather::describe_settings(options.gather)) {
            attributes[setting.name] = setting.value;
        }
        std::string running;
        for (std::size_t i = 0; i < gather::kEffectCount; ++i) {
            const auto effect = static_cast<gather::Effect>(i);
            if (plan.on(effect))
                running += (running.empty() ? "" : " ") + std::string(gather::name_of(effect));
        }
        attributes["plan"] = running;
    } else {
        attributes["bounces"] =
            options.bounces < 0 ? std::string("unlimited") : std::to_string(options.bounces);
    }
    attributes["sceneHash"] = scene_hash;
    const bool has_sky = !gathers || plan.on(gather::Effect::kSky);
    const bool has_sun = !options.scene.sun.empty() && (!gathers || plan.on(gather::Effect::kSun));
    attributes["sky"] = has_sky ? scene.sky_description : std::string("none");
    attributes["sun"] = has_sun ? options.scene.sun : std::string("none");
    if (traces_fields(options)) {
        attributes["hitMode"] = std::string(name_of(options.hit_mode));
        attributes["sampleBits"] = std::to_string(static_cast<int>(options.bake.sample_bits));
        attributes["voxels"] = options.bake.voxel_world
                                   ? fmt::format("{} world units", *options.bake.voxel_world)
                                   : fmt::format("{} on the longest side", options.bake.resolution);
        if (options.bake.max_field_bytes > 0) {
            attributes["maxFieldBytes"] = std::to_string(options.bake.max_field_bytes);
        }
    }
    return attributes;
}

namespace {

/// The picture's size is the caller's choice alone, so it is weighed before anything else is done.
void require_picture_memory(const RenderOptions& options) {
    const bool gathers = options.renderer == RendererKind::kGather;
    // The gather makes the whole picture and cuts the crop out of it.
    const bool crops = options.crop.width > 0 && !gathers;
    const int width = crops ? options.crop.width : options.width;
    const int height = crops ? options.crop.height : options.height;
    const std::uint64_t bytes =
        gathers ? gather::FinalGather::picture_bytes(width, height, options.gather, options.aovs)
                : core::PathTracer::picture_bytes(width, height, options.aovs);
    core::require_memory(bytes, fmt::format("'{}': a picture of {} x {} pixels with {} layers",
                                            options.output.string(), width, height, options.aovs.size()));
}

std::filesystem::path preview_file(const RenderOptions& options) {
    return std::filesystem::path(options.output).replace_extension(".png");
}

/// Told now and not after minutes of rendering; and before a bake makes the folder for itself.
void require_places_for_files(const RenderOptions& options) {
    core::require_place_for_file(options.output);
    if (options.png) core::require_place_for_file(preview_file(options));
    if (!options.stats.empty()) core::require_place_for_file(options.stats);
}

}  // namespace

nlohmann::json run_render(const Program& program, const RenderOptions& options) {
    StageClock clock;
    require_picture_memory(options);
    require_places_for_files(options);
    core::Scene scene = load_scene(program, options.scene);
    const core::Camera camera =
        choose_camera(program, options.scene, scene, static_cast<double>(options.width) / options.height);
    const std::string scene_hash = core::scene_hash(scene);  // Of all that is there, whatever the plan drops.
    gather::Plan plan;
    if (options.renderer == RendererKind::kGather) {
        plan = gather::make_plan(scene, options.width, options.height, options.gather, options.effects,
                                 options.aovs);
        gather::apply_plan(plan, scene);
    }
    const double load_seconds = clock.lap();

    const bool needs_triangles =
        options.tracer == TracerKind::kTriangle || options.primary == TracerKind::kTriangle;
    SceneTracers tracers;
    std::optional<sdf::BakeResult> baked;
    if (traces_fields(options)) baked = bake_fields(program, scene, options.bake, bake_folder(options));
    const double bake_seconds = clock.lap();

    if (needs_triangles) tracers.triangle = std::make_unique<core::TriangleTracer>(scene);
    if (baked) {
        tracers.sdf =
            std::make_unique<sdf::SdfTracer>(scene, sdf::grids_by_mesh(scene, *baked), options.hit_mode);
    }
    const double build_seconds = clock.lap();

    const core::Frame frame = render_frame(program, options, scene, camera, tracers, plan);
    const double render_seconds = clock.lap();

    const std::size_t saturated =
        core::write_exr(options.output, frame.image,
                        picture_attributes(options, scene, scene_hash, camera, frame, plan), options.half);
    if (saturated > 0) {
        warn(program, fmt::format("'{}': {} values beyond 65,504 were saturated by --half",
                                  options.output.string(), saturated));
    }
    if (options.png) {
        const float ev = options.exposure ? *options.exposure : core::automatic_exposure(frame.image);
        core::write_png(preview_file(options), frame.image.width(), frame.image.height(),
                        core::display_picture(frame.image, ev, options.tone_map));
    }
    const double write_seconds = clock.lap();

    nlohmann::json statistics = statistics_of(program, options, frame, tracers, plan);
    statistics["missing_meshes"] = nlohmann::json::array();
    if (baked) {
        for (const sdf::MeshBake& mesh : baked->meshes) {
            if (mesh.error) statistics["missing_meshes"].push_back(mesh.name);
        }
    }
    statistics["seconds"] = {{"load", load_seconds},
                             {"bake", bake_seconds},
                             {"build", build_seconds},
                             {"render", render_seconds},
                             {"write", write_seconds}};
    statistics["saturated"] = saturated;
    if (!options.stats.empty()) core::write_text_atomically(options.stats, statistics.dump(2) + "\n");
    if (frame.clamped_share > 0.0) {
        warn(program, fmt::format("screen_probes.max_ray_intensity took off {:.2g} % of the light that probe "
                                  "rays brought, and the picture is as much darker where they count",
                                  100.0 * frame.clamped_share));
    }
    if (frame.exhausted_rays > 0) {
        warn(program, fmt::format("{} rays ran out of steps and count as black", frame.exhausted_rays));
    }
    return statistics;
}

}  // namespace cli
