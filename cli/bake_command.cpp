#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/options.h"
#include "core/scene/scene_loader.h"
#include "core/support/error.h"
#include "sdf/baker.h"

namespace cli {

namespace {

struct BakeOptions {
    std::string scene;
    std::string output;
    sdf::BakeSettings settings;
    double voxel = 0.0;
    CLI::Option* voxel_option = nullptr;
    std::string surface_class = "auto";
};

const std::map<std::string, sdf::ClassOverride>& class_names() {
    static const std::map<std::string, sdf::ClassOverride> names = {{"auto", sdf::ClassOverride::kAuto},
                                                                    {"solid", sdf::ClassOverride::kSolid},
                                                                    {"sheet", sdf::ClassOverride::kSheet}};
    return names;
}

nlohmann::json as_json(const sdf::ErrorFigures& figures) {
    return {{"mean", figures.mean}, {"p99", figures.p99}, {"max", figures.max}};
}

nlohmann::json as_json(const sdf::MeshBake& bake) {
    if (!bake.grid) {
        return {{"name", bake.name},
                {"triangles", bake.triangle_count},
                {"seconds", bake.seconds},
                {"error", bake.error ? bake.error->what() : "not baked"}};
    }
    const sdf::FieldInfo& info = bake.info();
    return {{"name", bake.name},
            {"triangles", bake.triangle_count},
            {"class", sdf::class_name(info.mesh_class)},
            {"voxel", info.voxel_size},
            {"half_thickness", info.half_thickness},
            {"file", bake.file.string()},
            {"bytes", bake.file_bytes},
            {"memory_bytes", bake.memory_bytes},
            {"seconds", bake.seconds},
            {"reused", bake.reused},
            {"error_voxels", as_json(info.error_voxels)},
            {"error_field_voxels", as_json(info.error_field_voxels)},
            {"sign_mismatches",
             {{"samples", info.sign_mismatches.samples}, {"wrong", info.sign_mismatches.wrong}}},
            {"dropped_faces", info.dropped_faces},
            {"warnings", bake.warnings}};
}

std::string table_of(const sdf::BakeResult& result) {
    std::string text =
        fmt::format("{:<32}{:>10}{:>7}{:>12}{:>12}{:>9}  {:<24}{:<24}{}\n", "mesh", "triangles", "class",
                    "voxel", "bytes", "seconds", "mesh -> field (voxels)", "field -> mesh", "wrong signs");
    for (const sdf::MeshBake& bake : result.meshes) {
        if (!bake.grid) {
            text += fmt::format("{:<32}{:>10} failed\n", bake.name, bake.triangle_count);
            continue;
        }
        const sdf::FieldInfo& info = bake.info();
        const auto figures = [](const sdf::ErrorFigures& f) {
            return fmt::format("{:.3f} {:.3f} {:.3f}", f.mean, f.p99, f.max);
        };
        text += fmt::format("{:<32}{:>10}{:>7}{:>12.5g}{:>12}{:>9.2f}  {:<24}{:<24}{} of {}{}\n", bake.name,
                            bake.triangle_count, sdf::class_name(info.mesh_class), info.voxel_size,
                            bake.file_bytes, bake.seconds, figures(info.error_voxels),
                            figures(info.error_field_voxels), info.sign_mismatches.wrong,
                            info.sign_mismatches.samples, bake.reused ? "  (reused)" : "");
    }
    return text;
}

void report(const Program& program, const sdf::BakeResult& result) {
    for (const sdf::MeshBake& bake : result.meshes) {
        for (const std::string& warning : bake.warnings) {
            warn(program, fmt::format("mesh '{}': {}", bake.name, warning));
        }
    }
    if (!program.common.json) {
        std::fputs(table_of(result).c_str(), stdout);
        return;
    }
    nlohmann::json json = {{"schema", 1}, {"meshes", nlohmann::json::array()}, {"seconds", result.seconds}};
    for (const sdf::MeshBake& bake : result.meshes) json["meshes"].push_back(as_json(bake));
    const std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    std::printf("%s\n", text.c_str());
}

/// One error for all meshes that failed, after the others have been baked and reported.
void throw_failures(const sdf::BakeResult& result) {
    std::string messages;
    core::ErrorKind kind = core::ErrorKind::kBadData;
    for (const sdf::MeshBake& bake : result.meshes) {
        if (!bake.error) continue;
        messages += (messages.empty() ? "" : "\n") + std::string(bake.error->what());
        kind = bake.error->kind();
    }
    if (!messages.empty()) throw core::InputError(kind, messages);
}

void bake(const Program& program, const BakeOptions& options) {
    sdf::BakeSettings settings = options.settings;
    if (options.voxel_option->count() > 0) settings.voxel_world = options.voxel;
    settings.surface_class = class_names().at(options.surface_class);
    core::LoadOptions load;
    load.allow_external = program.common.allow_external;
    const core::Scene scene = core::load_scene_file(options.scene, load);
    for (const std::string& warning : scene.warnings) warn(program, warning);

    const core::StopRequested stop = stop_flag();
    const sdf::BakeResult result =
        sdf::bake_scene(scene, settings, options.output, make_progress(program), stop);
    if (stop()) throw core::Interrupted();
    if (result.meshes.empty()) {
        warn(program, fmt::format("'{}': has no triangles, so no field was written", scene.name));
    }
    report(program, result);
    throw_failures(result);
}

}  // namespace

void add_bake_command(CLI::App& app, Program& program) {
    const auto options = std::make_shared<BakeOptions>();
    sdf::BakeSettings& settings = options->settings;
    CLI::App& verb = *app.add_subcommand("bake", "Turn the meshes of a scene into signed distance fields");
    add_common_options(verb, program.common);
    verb.add_option("SCENE", options->scene, "Scene to read: " + core::scene_file_endings())->required();
    verb.add_option("-o,--output", options->output, "Folder for the fields, one .vdb a mesh; made if missing")
        ->required();
    CLI::Option* resolution =
        verb.add_option("--resolution", settings.resolution, "Voxels on the longest side of each mesh's box")
            ->check(CLI::Range(1, sdf::kMostVoxelsAlongSide))
            ->capture_default_str();
    options->voxel_option =
        verb.add_option("--voxel", options->voxel,
                        "Voxel in world units, by each mesh's largest scale, instead of --resolution")
            ->check(CLI::PositiveNumber)
            ->excludes(resolution);
    verb.add_option("--mesh", settings.only_mesh, "Bake only the mesh of this name");
    verb.add_option(
            "--class", options->surface_class,
            "What surfaces are: auto decides for each connected part; solid encloses a volume; sheet is "
            "given a thickness of about a voxel")
        ->check(CLI::IsMember(class_names()))
        ->capture_default_str();
    verb.add_option(
            "--max-field-bytes", settings.max_field_bytes,
            "Coarsen any field that would take more memory than this in a tracer, and say so; 0: no limit")
        ->capture_default_str();
    verb.add_flag("--force", settings.force, "Bake even where the folder holds a bake that fits");
    verb.footer(
        "Of the errors, mesh -> field is how far the field is from zero at points of the mesh, field -> mesh "
        "how "
        "far points of the field's surface are from the mesh: mean, P99 and maximum in voxels, less the "
        "thickness that sheets and thin walls are given. Wrong signs are samples on the other side than the "
        "exact winding number says, of those that were looked at.\n"
        "A mesh that cannot be baked is named; the others are baked all the same, and the exit code is not "
        "0.\n"
        "Examples:\n"
        "  fieldlight bake room.glb -o room.bake\n"
        "  fieldlight bake room.glb -o room.bake --voxel 0.02 --json\n"
        "  fieldlight bake bunny.ply -o bunny.bake\n"
        "  fieldlight bake room.glb -o room.bake --mesh curtain --class sheet --resolution 256");
    verb.callback([&program, options] { run_verb(program, [&] { bake(program, *options); }); });
}

}  // namespace cli
