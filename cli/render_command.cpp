// cli/render_command.cpp: the flags of `fieldlight render`.
#include <fmt/format.h>

#include <iostream>
#include <map>
#include <memory>
#include <optional>

#include "cli/gather_flags.h"
#include "cli/options.h"
#include "cli/render_job.h"
#include "core/support/error.h"

namespace cli {

namespace {

/// Of --spp.
constexpr int kMostSamples = 1 << 24;

/// What is typed, before it is understood.
struct RenderFlags {
    RenderOptions options;
    GatherFlags gather;
    std::string renderer = "gather";
    std::string size = "1280x720";
    std::string crop;
    std::string exposure = "auto";
    std::string tone_map = "aces";
    std::vector<std::string> aovs;
    std::optional<int> samples;
    std::optional<double> voxel;
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

/// Layers that one renderer alone can write.
const std::map<std::string, RendererKind> kLayersOfOne = {
    {"Variance", RendererKind::kPath},          {"BentNormal", RendererKind::kGather},
    {"Probes", RendererKind::kGather},          {"RaysPerTexel", RendererKind::kGather},
    {"ProbeWeight", RendererKind::kGather},     {"FilmSamples", RendererKind::kGather},
    {"ProbeHitDistance", RendererKind::kGather}};

/// The flags that belong to one renderer alone; the others' are usage errors.
void understand_renderer(const RenderFlags& flags, RenderOptions& options) {
    if (flags.renderer != "path" && flags.renderer != "gather") {
        fail(fmt::format("--renderer {}: is not built yet; only 'gather' and 'path' are", flags.renderer));
    }
    options.renderer = flags.renderer == "path" ? RendererKind::kPath : RendererKind::kGather;
    for (const std::string& layer : flags.aovs) {
        const auto found = kLayersOfOne.find(layer);
        if (found == kLayersOfOne.end() || found->second == options.renderer) continue;
        fail(fmt::format("--aov {} is of --renderer {}; --renderer {} has no such layer", layer,
                         name_of(found->second), flags.renderer));
    }
    // A budget of time alone decides how much is done until then.
    const bool timed = options.time_budget_seconds > 0.0;
    if (options.renderer == RendererKind::kPath) {
        for (const std::string& flag : flags.gather.given()) {
            fail(fmt::format("{} is of --renderer gather; the path tracer takes --spp, samples a pixel",
                             flag));
        }
        options.bounces = flags.gather.bounces().value_or(-1);
        options.samples_per_pixel = flags.samples.value_or(timed ? kMostSamples : options.samples_per_pixel);
        return;
    }
    if (flags.samples) {
        fail("--spp is of --renderer path; the gather takes --accumulate, frames that it averages");
    }
    options.gather = flags.gather.settings();
    if (timed && !flags.gather.frames_given()) options.gather.frames = kMostFrames;
    options.effects = flags.gather.effects();
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
    options.bake.voxel_world = flags.voxel;
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
    note(program, fmt::format("'{}': {} {}, {:.1f} Mrays; load {:.2f} s, bake {:.2f} s, build {:.2f} s, "
                              "render {:.2f} s, write {:.2f} s",
                              options.output.string(), statistics["samples_per_pixel"].get<double>(),
                              options.renderer == RendererKind::kPath ? "samples a pixel" : "frames",
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
                     "gather: light cached in probes on the screen, one bounce; path: the path tracer")
        ->check(CLI::IsMember({"gather", "path", "irradiance-field", "screen-denoiser", "direct"})
                    .description(""))
        ->capture_default_str();
    verb->add_option("--size", flags->size, "WIDTHxHEIGHT in pixels")->capture_default_str();
    verb->add_option("--crop", flags->crop,
                     "X,Y,W,H: writes this rectangle of the picture alone; the gather makes all "
                     "of it before, the path tracer no more than this");
    add_camera_options(*verb, options.scene);
    flags->gather.add_to(*verb);
    verb->add_option(
            "--spp", flags->samples,
            fmt::format("Of the path tracer: samples a pixel; {} by default", options.samples_per_pixel))
        ->check(CLI::Range(1, kMostSamples));
    verb->add_option(
            "--time-budget", options.time_budget_seconds,
            "Seconds to render for; frames or samples a pixel are as many as fit, or as --accumulate "
            "or --spp say if they are there sooner")
        ->check(CLI::PositiveNumber);
    CLI::Option* resolution = verb->add_option("--resolution", options.bake.resolution,
                                               "Voxels on the longest side of each mesh's box")
                                  ->check(CLI::Range(4, 4096))
                                  ->capture_default_str();
    verb->add_option("--voxel", flags->voxel, "Voxel in world units instead")
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
            "tracer Variance; of the gather BentNormal,Probes,RaysPerTexel,ProbeHitDistance,ProbeWeight,"
            "FilmSamples")
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
        "  fieldlight render assets/two_rooms.glb -o out.exr --png\n"
        "  fieldlight render room.glb -o room.exr --quality draft --set integrate.bent_normal=off --sky "
        "500,600,800 --sun 30,40,60000\n"
        "  fieldlight render toy.gltf -o toy.exr --primary sdf --resolution 256 --eye 0,1,3 --look-at 0,0,0 "
        "--aov Depth,Normal\n"
        "  fieldlight render room.glb -o room.exr --renderer path --tracer triangle --spp 256 --bounces 3");

    verb->callback([flags, &program] {
        run_verb(program, [&] {
            const RenderOptions understood = understand(*flags, program.common);
            print_summary(program, understood, run_render(program, understood));
        });
    });
}

}  // namespace cli
