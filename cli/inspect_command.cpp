#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/inspect_exr.h"
#include "cli/inspect_vdb.h"
#include "cli/options.h"
#include "cli/vdb_slice_picture.h"
#include "core/image/png.h"
#include "core/scene/scene_loader.h"
#include "core/support/error.h"
#include "sdf/vdb_file.h"

namespace cli {

namespace {

struct InspectOptions {
    std::string file;
    std::string scene;
    std::string slice;       ///< PNG to draw a plane of a .vdb into; empty: none.
    std::string axis = "z";  ///< The plane's normal.
    double at = 0.5;         ///< Where along it.
};

std::string lower_case_extension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

nlohmann::json as_json(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

nlohmann::json inspect_scene(const std::filesystem::path& path, const core::LoadOptions& options) {
    const core::Scene scene = core::load_scene_file(path, options);
    const core::DoubleBounds bounds = core::world_bounds(scene);
    nlohmann::json result = {{"schema", 1},
                             {"meshes", scene.meshes.size()},
                             {"triangles", core::drawn_triangle_count(scene)},
                             {"instances", scene.instances.size()},
                             {"materials", scene.materials.size()},
                             {"lights", scene.lights.size()},
                             {"cameras", scene.cameras.size()},
                             {"animations", scene.animations.size()},
                             {"extensions", scene.extensions_used},
                             {"bounds", nullptr},
                             {"warnings", scene.warnings}};
    if (!bounds.empty()) result["bounds"] = {as_json(bounds.minimum), as_json(bounds.maximum)};
    return result;
}

std::string describe_scene(const nlohmann::json& inspected) {
    std::string text;
    for (const char* key :
         {"meshes", "triangles", "instances", "materials", "lights", "cameras", "animations"}) {
        text += fmt::format("{:<12}{}\n", key, inspected[key].get<std::uint64_t>());
    }
    const nlohmann::json& bounds = inspected["bounds"];
    if (!bounds.is_null()) {
        const auto point = [](const nlohmann::json& v) {
            return fmt::format("({:.6g}, {:.6g}, {:.6g})", v[0].get<double>(), v[1].get<double>(),
                               v[2].get<double>());
        };
        text += fmt::format("{:<12}{} to {}\n", "bounds", point(bounds[0]), point(bounds[1]));
    }
    for (const nlohmann::json& extension : inspected["extensions"]) {
        text += fmt::format("{:<12}{}\n", "extension", extension.get<std::string>());
    }
    for (const nlohmann::json& warning : inspected["warnings"]) {
        text += fmt::format("{:<12}{}\n", "warning", warning.get<std::string>());
    }
    return text;
}

/// Nested JSON as indented `key value` lines.
std::string describe_json(const nlohmann::json& value, int indent = 0) {
    std::string text;
    for (const auto& [key, member] : value.items()) {
        const bool nested =
            member.is_object() || (member.is_array() && !member.empty() && member[0].is_object());
        text += fmt::format("{:{}}{:<{}}", "", indent, key, nested ? 0 : 16);
        text += nested ? "\n" + describe_json(member, indent + 2)
                       : fmt::format(" {}\n", member.is_string() ? member.get<std::string>() : member.dump());
    }
    return text;
}

/// Draws a plane of a field. Returns what the output says of it.
nlohmann::json write_slice(const InspectOptions& options) {
    const sdf::VdbSlice slice = sdf::read_vdb_slice(options.file, options.axis[0] - 'x', options.at);
    const SlicePicture picture = draw_slice(slice);
    core::write_png(options.slice, picture.width, picture.height, picture.rgb);
    return {{"file", options.slice},      {"grid", slice.grid},     {"axis", options.axis},
            {"position", slice.position}, {"width", picture.width}, {"height", picture.height}};
}

void inspect(const Program& program, const InspectOptions& options) {
    const std::filesystem::path path(options.file);
    const std::string extension = lower_case_extension(path);
    if (!options.slice.empty() && extension != ".vdb") {
        throw core::InputError(core::ErrorKind::kUsage,
                               fmt::format("--slice: draws a .vdb; '{}' is none", options.file));
    }
    if (!options.slice.empty() && lower_case_extension(options.slice) != ".png") {
        throw core::InputError(core::ErrorKind::kUsage,
                               fmt::format("--slice {}: must end in .png", options.slice));
    }
    nlohmann::json result;
    std::string text;
    if (core::is_scene_file(path)) {
        core::LoadOptions load;
        load.scene = options.scene;
        load.allow_external = program.common.allow_external;
        result = inspect_scene(path, load);
        text = describe_scene(result);
    } else if (extension == ".exr") {
        result = inspect_exr(path);
        text = describe_exr(result);
    } else if (extension == ".vdb") {
        result = inspect_vdb(path);
        if (!options.slice.empty()) result["slice"] = write_slice(options);
        text = describe_json(result);
    } else {
        throw core::InputError(core::ErrorKind::kUsage,
                               fmt::format("'{}': only scenes ({}), .exr and .vdb files can be inspected",
                                           options.file, core::scene_file_endings()));
    }
    if (program.common.json)
        text = result.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    std::fputs(text.c_str(), stdout);
}

}  // namespace

void add_inspect_command(CLI::App& app, Program& program) {
    CLI::App* verb = app.add_subcommand(
        "inspect", "Tell what a scene, a .vdb or an .exr holds: counts, extents, warnings, NaNs");
    const auto options = std::make_shared<InspectOptions>();
    verb->add_option("FILE", options->file, "A scene, a distance field or a picture")->required();
    verb->add_option("--scene", options->scene, "Which scene of a glTF file: NAME or INDEX");
    verb->add_option("--slice", options->slice, "Draw a plane of a .vdb into this PNG");
    verb->add_option("--axis", options->axis, "Of --slice: the plane's normal, x, y or z")
        ->check(CLI::IsMember({"x", "y", "z"}).description(""))
        ->capture_default_str();
    verb->add_option("--at", options->at, "Of --slice: where along the axis, from 0 to 1 through the field")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    add_common_options(*verb, program.common);
    verb->footer(
        "Examples:\n"
        "  fieldlight inspect room.glb\n"
        "  fieldlight inspect room.glb --json\n"
        "  fieldlight inspect picture.exr\n"
        "  fieldlight inspect scene.bake/wall_0.vdb --slice wall.png --axis x --at 0.25");
    verb->callback([&program, options] { run_verb(program, [&] { inspect(program, *options); }); });
}

}  // namespace cli
