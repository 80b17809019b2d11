#include "cli/compare_scene_flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "cli/scene_tracers.h"
#include "core/render/path_tracer.h"
#include "core/support/error.h"
#include "sdf/sampled_field.h"

namespace cli {

void CompareSceneFlags::add_to(CLI::App& verb) {
    const auto names = [&] {
        const auto options = std::as_const(verb).get_options();
        return std::set<const CLI::Option*>(options.begin(), options.end());
    };
    const std::set<const CLI::Option*> before = names();

    verb.add_option(
        "-o,--output", options_.folder,
        "Folder for report.html, report.json, report.csv and pictures; made if missing; keeps the "
        "reference and the fields for the next run");
    add_scene_options(verb, options_.scene);
    add_camera_options(verb, options_.scene);
    verb.add_option("--size", size_, "WIDTHxHEIGHT in pixels")->capture_default_str();
    verb.add_option("--renderers", renderers_,
                    "Renderers to compare, with commas: path, gather. The reference is path-traced, and with "
                    "the gather all have its one bounce unless --bounces says 0")
        ->delimiter(',')
        ->check(CLI::IsMember({"path", "gather"}).description(""))
        ->capture_default_str();
    gather_.add_settings_to(verb);
    verb.add_option("--resolutions", options_.resolutions,
                    "Fields to compare: voxels on the longest side of each mesh's box")
        ->delimiter(',')
        ->check(CLI::Range(4, sdf::kMostVoxelsAlongSide))
        ->capture_default_str();
    add_hit_mode_option(verb, options_.hit_mode);
    add_sample_bits_option(verb, options_.sample_bits);
    verb.add_option("--max-spp", options_.max_samples,
                    "The ladder is 1, 2, 4, ... samples a pixel, of the gather frames, up to this")
        ->check(CLI::Range(1, 1 << 20))
        ->capture_default_str();
    verb.add_option("--reference-spp", options_.reference_samples, "Samples a pixel of the reference")
        ->check(CLI::Range(core::PathTracer::kBatchCount, 1 << 24))
        ->capture_default_str();
    verb.add_option("--time-budget", options_.time_budget_seconds,
                    "Seconds of rendering for the ladder, reference apart; ends it before a rung that would "
                    "pass this; none by default")
        ->check(CLI::PositiveNumber);
    verb.add_option("--bake-dir", options_.bake_folder,
                    "Where baked fields are kept, a folder a resolution; default 'fields' in the output");

    for (CLI::Option* option : verb.get_options()) {
        if (before.count(option)) continue;
        option->group("Comparing a scene");
        all_.push_back(option);
    }
}

std::vector<std::string> CompareSceneFlags::given() const {
    std::vector<std::string> flags;
    for (const CLI::Option* option : all_) {
        if (option->count() > 0) flags.push_back(option->get_name());
    }
    return flags;
}

void CompareSceneFlags::understand_renderers(CompareSceneOptions& options) const {
    const auto fail = [](const std::string& message) {
        throw core::InputError(core::ErrorKind::kUsage, message);
    };
    options.renderers.clear();
    for (const std::string& name : renderers_) {
        const RendererKind kind = name == "path" ? RendererKind::kPath : RendererKind::kGather;
        const auto& named = options.renderers;
        if (std::find(named.begin(), named.end(), kind) != named.end()) {
            fail(fmt::format("--renderers: {} is there twice", name));
        }
        options.renderers.push_back(kind);
    }
    if (std::count(options.renderers.begin(), options.renderers.end(), RendererKind::kGather) > 0) {
        options.gather = gather_.settings();
        options.bounces = options.gather.bounces;
        return;
    }
    for (const std::string& flag : gather_.given()) {
        fail(fmt::format("{} is of the gather, which --renderers does not name", flag));
    }
    options.bounces = gather_.bounces().value_or(-1);
}

CompareSceneOptions CompareSceneFlags::understand(const std::string& scene) const {
    CompareSceneOptions options = options_;
    options.scene.file = scene;
    const auto fail = [](const std::string& message) {
        throw core::InputError(core::ErrorKind::kUsage, message);
    };
    if (options.folder.empty()) fail("compare SCENE: needs -o DIR, the folder for the report");
    const glm::ivec2 size = parse_size(size_);
    options.width = size.x;
    options.height = size.y;
    understand_renderers(options);
    std::sort(options.resolutions.begin(), options.resolutions.end());
    const auto twice = std::adjacent_find(options.resolutions.begin(), options.resolutions.end());
    if (twice != options.resolutions.end()) fail(fmt::format("--resolutions: {} is there twice", *twice));
    return options;
}

}  // namespace cli
