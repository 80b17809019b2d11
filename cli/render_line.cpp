#include "cli/render_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

namespace cli {

namespace {

std::string quoted(const std::string& argument) {
    const bool plain =
        !argument.empty() && std::all_of(argument.begin(), argument.end(), [](unsigned char letter) {
            return std::isalnum(letter) ||
                   std::string_view("_-./:,=+@%").find(static_cast<char>(letter)) != std::string_view::npos;
        });
    if (plain) return argument;
    std::string result = "'";
    for (const char letter : argument)
        result += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
    return result + "'";
}

void add_scene(const SceneOptions& scene, std::vector<std::string>& line) {
    const auto add = [&](const char* flag, const std::string& value) {
        // One word, since a value may start with a dash.
        if (!value.empty()) line.push_back(fmt::format("{}={}", flag, value));
    };
    add("--scene", scene.scene);
    add("--sky", scene.sky);
    if (scene.sky_rotation_degrees != 0.0)
        add("--sky-rotation", fmt::format("{}", scene.sky_rotation_degrees));
    add("--sun", scene.sun);
    add("--camera", scene.camera);
    if (scene.eye.empty()) return;
    add("--eye", scene.eye);
    add("--look-at", scene.look_at);
    add("--up", scene.up);
    add("--fov", fmt::format("{}", scene.fov_degrees));
}

void add_gather(const RenderOptions& options, std::vector<std::string>& line) {
    line.insert(line.end(), {"--accumulate", std::to_string(options.gather.frames), "--bounces",
                             std::to_string(options.gather.bounces)});
    const auto usual = gather::describe_settings(gather::Settings{});
    const auto chosen = gather::describe_settings(options.gather);
    for (std::size_t i = 0; i < chosen.size(); ++i) {
        if (chosen[i].value == usual[i].value) continue;
        line.insert(line.end(), {"--set", fmt::format("{}={}", chosen[i].name, chosen[i].value)});
    }
    if (options.effects.kind == gather::EffectRequest::Kind::kAuto) return;
    std::vector<std::string_view> effects;
    for (const gather::Effect effect : options.effects.list) effects.push_back(gather::name_of(effect));
    line.insert(line.end(), {"--effects", options.effects.kind == gather::EffectRequest::Kind::kAll
                                              ? "all"
                                              : fmt::format("{}", fmt::join(effects, ","))});
}

}  // namespace

std::string render_line(const RenderOptions& options, bool allow_external) {
    std::vector<std::string> line = {
        "render",   options.scene.file.string(), "-o",        options.output.string(),
        "--tracer", name_of(options.tracer),     "--primary", name_of(options.primary)};
    if (traces_fields(options)) {
        line.insert(line.end(),
                    {"--hit-mode", name_of(options.hit_mode), "--sample-bits",
                     std::to_string(static_cast<int>(options.bake.sample_bits)), "--resolution",
                     std::to_string(options.bake.resolution), "--bake-dir", options.bake_folder.string()});
    }
    line.insert(line.end(), {"--size", fmt::format("{}x{}", options.width, options.height), "--renderer",
                             name_of(options.renderer)});
    if (options.renderer == RendererKind::kPath) {
        line.insert(line.end(), {"--spp", std::to_string(options.samples_per_pixel)});
        if (options.bounces >= 0) line.insert(line.end(), {"--bounces", std::to_string(options.bounces)});
    } else {
        add_gather(options, line);
    }
    line.insert(line.end(), {"--seed", std::to_string(options.seed)});
    add_scene(options.scene, line);
    if (!options.aovs.empty())
        line.insert(line.end(), {"--aov", fmt::format("{}", fmt::join(options.aovs, ","))});
    if (allow_external) line.emplace_back("--allow-external");
    return shell_line(line);
}

std::string shell_line(const std::vector<std::string>& arguments) {
    std::string line = "fieldlight";
    for (const std::string& argument : arguments) line += " " + quoted(argument);
    return line;
}

}  // namespace cli
