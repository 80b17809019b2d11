// cli/render_command.cpp: the flags of `fieldlight render`.
#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "cli/options.h"
#include "cli/render_job.h"
#include "core/support/error.h"

namespace cli {

namespace {

/// What is typed, before it is understood.
struct RenderFlags {
    RenderOptions options;
    std::string renderer = "path";
    std::string size = "1280x720";
    std::string crop;
    std::string exposure = "auto";
    std::string tone_map = "aces";
    std::vector<std::string> aovs;
    std::vector<std::string> settings;
    std::string quality = "medium";
    std::string effects = "auto";
    int frames = 0;
    int bounces = 0;
    double voxel = 0.0;
    CLI::Option* bounces_option = nullptr;
    CLI::Option* voxel_option = nullptr;
    CLI::Option* samples_option = nullptr;
    CLI::Option* frames_option = nullptr;
    CLI::Option* quality_option = nullptr;
    CLI::Option* effects_option = nullptr;
};

[[noreturn]] void fail(const std::string& message) {
    throw core::InputError(core::ErrorKind::kUsage, message);
}

void parse_crop(const std::string& text, RenderOptions& options) {
    if (text.empty()) return;
    const std::vector<double> numbers = parse_numbers("--crop", text, 4, 4);
    for (const double number : numbers) {
        if (number != static_cast<double>(static_cast<int>(number)))
            fail("--crop: takes whole pixels X,Y,W,H");
    }
    options.crop = {static_cast<int>(numbers[0]), static_cast<int>(numbers[1]), static_cast<int>(numbers[2]),
                    static_cast<int>(numbers[3])};
    const core::Crop& crop = options.crop;
    if (crop.x < 0 || crop.y < 0 || crop.width < 1 || crop.height < 1 ||
        crop.width > options.width - crop.x || crop.height > options.height - crop.y) {
        fail(fmt::format("--crop {}: must lie within the picture of {}x{}", text, options.width,
                         options.height));
    }
}

/// The flags that belong to one renderer alone; the others' are usage errors.
void understand_renderer(const RenderFlags& flags, RenderOptions& options) {
    if (flags.renderer == "path") {
        const auto refuse = [&](const CLI::Option* option, const char* name) {
            if (option->count() > 0) fail(fmt::format("{}: belongs to --renderer gather, not to path", name));
        };
        refuse(flags.frames_option, "--accumulate");
        refuse(flags.quality_option, "--quality");
        refuse(flags.effects_option, "--effects");
        if (!flags.settings.empty()) fail("--set: belongs to --renderer gather, not to path");
        return;
    }
    if (flags.renderer != "gather") {
        fail(fmt::format("--renderer {}: is not built yet; only 'path' and 'gather' are", flags.renderer));
    }
    options.renderer = RendererKind::kGather;
    if (flags.samples_option->count() > 0) {
        fail("--spp: belongs to --renderer path; the gather takes --accumulate, frames that it averages");
    }
    options.gather = gather::quality_settings(flags.quality);
    if (flags.frames_option->count() > 0) options.gather.frames = flags.frames;
    if (flags.bounces_option->count() > 0) options.gather.bounces = flags.bounces;
    if (options.gather.bounces > 1) {
        fail(fmt::format(
            "--bounces {}: the gather reaches 0 or 1 until surfaces are cached; --renderer path has "
            "no limit",
            options.gather.bounces));
    }
    for (const std::string& setting : flags.settings) {
        const std::size_t equals = setting.find('=');
        if (equals == std::string::npos) {
            fail(
                fmt::format("--set {}: takes NAME=VALUE, such as screen_probes.spatial_filter=off", setting));
        }
        gather::set_setting(options.gather, setting.substr(0, equals), setting.substr(equals + 1));
    }
    options.effects = gather::parse_effects(flags.effects);
}

RenderOptions understand(const RenderFlags& flags, const CommonOptions& common) {
    RenderOptions options = flags.options;
    options.seed = common.seed;
    understand_renderer(flags, options);
    const glm::ivec2 size = parse_size(flags.size);
    options.width = size.x;
    options.height = size.y;
    parse_crop(flags.crop, options);
    if (flags.exposure != "auto") {
        options.exposure = static_cast<float>(parse_numbers("--exposure", flags.exposure, 1, 1)[0]);
    }
    options.tone_map = *core::tone_map_from_name(flags.tone_map);
    options.aovs.insert(flags.aovs.begin(), flags.aovs.end());
    options.bounces = flags.bounces_option->count() > 0 ? flags.bounces : -1;
    if (flags.voxel_option->count() > 0) options.bake.voxel_world = flags.voxel;
    // A budget of time alone decides how many samples there are.
    if (options.time_budget_seconds > 0.0 && flags.samples_option->count() == 0) {
        options.samples_per_pixel = 1 << 24;
    }
    if (options.output.extension() != ".exr") {
        fail(fmt::format("-o {}: must end in .exr (--png writes a preview beside it)",
                         options.output.string()));
    }
    return options;
}

void print_summary(const Program& program, const RenderOptions& options, const nlohmann::json& statistics) {
    if (program.common.json) {
        std::cout << statistics.dump() << "\n";
        return;
    }
    const nlohmann::json& seconds = statistics["seconds"];
    note(program,
         fmt::format("'{}': {} samples a pixel, {:.1f} Mrays; load {:.2f} s, bake {:.2f} s, build {:.2f} s, "
                     "render {:.2f} s, write {:.2f} s",
                     options.output.string(), statistics["samples_per_pixel"].get<double>(),
                     statistics["rays"].get<double>() * 1e-6, seconds["load"].get<double>(),
                     seconds["bake"].get<double>(), seconds["build"].get<double>(),
                     seconds["render"].get<double>(), seconds["write"].get<double>()));
}

}  // namespace

void add_render_command(CLI::App& app, Program& program) {
    CLI::App* verb = app.add_subcommand("render", "Render a scene to an EXR");
    auto flags = std::make_shared<RenderFlags>();
    RenderOptions& options = flags->options;
    const std::map<std::string, TracerKind> tracers = {{"sdf", TracerKind::kSdf},
                                                       {"triangle", TracerKind::kTriangle}};

    add_scene_file(*verb, options.scene);
    add_scene_options(*verb, options.scene);
    verb->add_option("-o,--output", options.output, "The EXR to write")->required();
    verb->add_option("--tracer", options.tracer, "What rays after the first meet: sdf (default) or triangle")
        ->transform(CLI::CheckedTransformer(tracers).description(""))
        ->type_name("KIND");
    verb->add_option("--primary", options.primary, "What camera rays meet: triangle (default) or sdf")
        ->transform(CLI::CheckedTransformer(tracers).description(""))
        ->type_name("KIND");
    add_hit_mode_option(*verb, options.hit_mode);
    add_sample_bits_option(*verb, options.bake.sample_bits);
    verb->add_option("--renderer", flags->renderer,
                     "path: the path tracer; gather: light cached in probes on the screen, one bounce")
        ->check(CLI::IsMember({"path", "gather", "irradiance-field", "screen-denoiser", "direct"})
                    .description(""))
        ->capture_default_str();
    verb->add_option("--size", flags->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    verb->add_option("--crop", flags->crop, "X,Y,W,H: renders this rectangle of the picture alone");
    add_camera_options(*verb, options.scene);
    flags->samples_option = verb->add_option("--spp", options.samples_per_pixel, "Samples a pixel")
                                ->check(CLI::Range(1, 1 << 24))
                                ->capture_default_str();
    flags->frames_option = verb->add_option("--accumulate", flags->frames, "Frames that the gather averages")
                               ->check(CLI::Range(1, 1 << 16));
    flags->quality_option = verb->add_option("--quality", flags->quality, "Row of settings of the gather")
                                ->check(CLI::IsMember({"draft", "medium", "high", "ultra"}).description(""))
                                ->capture_default_str();
    verb->add_option(
            "--set", flags->settings,
            "NAME=VALUE of one setting of the gather, as often as wanted; --help-settings lists them")
        ->allow_extra_args(false);
    flags->effects_option =
        verb->add_option("--effects", flags->effects,
                         "Passes of the gather: auto (what the scene calls for), all, or names with commas")
            ->capture_default_str();
    verb->add_flag_callback(
        "--help-settings",
        [] {
            for (const auto& setting : gather::describe_settings(gather::Settings{})) {
                std::cout << fmt::format("{} = {}  ({})\n    {}\n", setting.name, setting.value,
                                         setting.values, setting.meaning);
            }
            throw CLI::Success();
        },
        "List the settings of the gather with their values at medium quality, and end");
    flags->bounces_option =
        verb->add_option("--bounces", flags->bounces,
                         "Indirect bounces; 0 is emission and direct light; no limit by default")
            ->check(CLI::Range(0, 1 << 20));
    verb->add_option("--time-budget", options.time_budget_seconds,
                     "Seconds to render for; decides the samples a pixel unless --spp ends it first")
        ->check(CLI::PositiveNumber);
    CLI::Option* resolution = verb->add_option("--resolution", options.bake.resolution,
                                               "Voxels on the longest side of each mesh's box")
                                  ->check(CLI::Range(4, 4096))
                                  ->capture_default_str();
    flags->voxel_option = verb->add_option("--voxel", flags->voxel, "Voxel in world units instead")
                              ->check(CLI::PositiveNumber)
                              ->excludes(resolution);
    verb->add_option("--max-field-bytes", options.bake.max_field_bytes,
                     "Coarsen any field that would take more memory than this, and say so; 0: no limit")
        ->capture_default_str();
    verb->add_option("--bake-dir", options.bake_folder,
                     "Where baked fields are kept; default SCENE.bake beside the output");
    verb->add_option(
            "--aov", flags->aovs,
            "Further layers: "
            "Depth,Normal,Albedo,Direct,IndirectDiffuse,IndirectSpecular,HitDistance,Steps; of the path "
            "tracer Variance; of the gather BentNormal,Probes,RaysPerTexel,ProbeWeight")
        ->delimiter(',');
    verb->add_flag("--half", options.half, "16-bit colour layers; saturates at 65,504");
    verb->add_flag("--png", options.png, "Write a tone-mapped preview beside the EXR");
    verb->add_option("--exposure", flags->exposure, "EV100 of the preview, or auto")->capture_default_str();
    verb->add_option("--tone-map", flags->tone_map, "Of the preview: aces, linear or hable")
        ->check(CLI::IsMember({"aces", "linear", "hable"}).description(""))
        ->capture_default_str();
    verb->add_option("--stats", options.stats, "Write what it cost to this JSON file");
    add_common_options(*verb, program.common);
    verb->footer(
        "Examples:\n"
        "  fieldlight render assets/two_rooms.glb -o out.exr --png --spp 256\n"
        "  fieldlight render room.glb -o room.exr --tracer triangle --bounces 2 --sky 500,600,800 --sun "
        "30,40,60000\n"
        "  fieldlight render toy.gltf -o toy.exr --primary sdf --resolution 256 --eye 0,1,3 --look-at 0,0,0 "
        "--aov Depth,Normal\n"
        "  fieldlight render room.glb -o room.exr --renderer gather --quality draft --set "
        "integrate.bent_normal=off");

    verb->callback([flags, &program] {
        run_verb(program, [&] {
            const RenderOptions understood = understand(*flags, program.common);
            print_summary(program, understood, run_render(program, understood));
        });
    });
}

}  // namespace cli
