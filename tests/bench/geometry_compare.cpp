// tests/bench/geometry_compare.cpp: how far a scene's distance fields lie off its triangles, on the same
// rays.
//
//     fieldlight_geometry SCENE.glb [--resolution 128] [--rays 1000000] [--seed 1] [--cache FOLDER] [--json]
//
// Rays are isotropic uniform lines through the scene's bounding sphere; what is measured of them is defined
// in core/trace/tracer_difference.h.
#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene_loader.h"
#include "core/support/error.h"
#include "core/trace/tracer_difference.h"
#include "core/trace/triangle_tracer.h"
#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"
#include "tests/support/analytic_scenes.h"

namespace {

struct Options {
    std::string scene;
    std::string cache;
    std::uint64_t rays = 1'000'000;
    std::uint64_t resolution = 128;
    std::uint64_t seed = 1;
    bool json = false;
};

std::string json_escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result;
}

void print(const Options& options, const core::TracerDifference& row) {
    const core::DistanceQuantiles &raw = row.voxels, &far = row.voxels_beyond;
    const std::string name = options.scene.substr(options.scene.find_last_of('/') + 1);
    const double percent = row.disagree_percent(), percent_far = row.disagree_beyond_percent(),
                 percent_silhouette = row.silhouette_percent();
    const double triangle_mrays = 1e-6 * row.reference_rays_per_second,
                 sdf_mrays = 1e-6 * row.tested_rays_per_second;
    if (options.json) {
        fmt::print(
            "{{\"scene\": \"{}\", \"resolution\": {}, \"rays\": {}, \"hit_in_either\": {}, "
            "\"disagree_percent\": {:.6g}, \"disagree_beyond_silhouettes_percent\": {:.6g}, "
            "\"silhouette_percent\": {:.6g}, \"raw_voxels\": {{\"p50\": {:.6g}, \"p99\": {:.6g}, \"max\": "
            "{:.6g}}}, "
            "\"beyond_silhouettes_voxels\": {{\"p50\": {:.6g}, \"p99\": {:.6g}, \"max\": {:.6g}}}, "
            "\"normal_degrees\": {:.6g}, \"steps\": {:.6g}, \"exhausted\": {}, \"triangle_mrays\": {:.4g}, "
            "\"sdf_mrays\": {:.4g}}}\n",
            json_escaped(name), options.resolution, row.rays, row.either, percent, percent_far,
            percent_silhouette, raw.p50, raw.p99, raw.max, far.p50, far.p99, far.max, row.normal_degrees,
            row.steps_per_ray, row.exhausted, triangle_mrays, sdf_mrays);
        return;
    }
    fmt::print(
        "{:<28} {:>9} {:>9} {:>9} {:>7} | {:>7} {:>7} {:>8} | {:>7} {:>7} {:>8} | {:>7} {:>6} {:>5} {:>6} "
        "{:>6}\n",
        "scene", "hits", "disagr %", "far dis %", "silh %", "raw p50", "p99", "max", "far p50", "p99", "max",
        "norm deg", "steps", "exh", "tri M/s", "sdf M/s");
    fmt::print(
        "{:<28} {:>9} {:>9.4f} {:>9.4f} {:>7.2f} | {:>7.4f} {:>7.4f} {:>8.3f} | {:>7.4f} {:>7.4f} {:>8.3f} | "
        "{:>7.3f} {:>6.1f} {:>5} {:>6.2f} {:>6.2f}\n",
        name, row.either, percent, percent_far, percent_silhouette, raw.p50, raw.p99, raw.max, far.p50,
        far.p99, far.max, row.normal_degrees, row.steps_per_ray, row.exhausted, triangle_mrays, sdf_mrays);
}

[[noreturn]] void usage(const std::string& why) {
    throw core::InputError(core::ErrorKind::kUsage,
                           why +
                               "; usage: fieldlight_geometry SCENE.glb [--resolution N] [--rays N] "
                               "[--seed N] [--cache FOLDER] [--json]");
}

Options parse(int count, char** arguments) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string_view argument = arguments[i];
        const auto next = [&]() -> std::string_view {
            if (++i >= count) usage(fmt::format("'{}' wants a value", argument));
            return arguments[i];
        };
        const auto number = [&](std::uint64_t& value) {
            const std::string_view text = next();
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            if (error != std::errc() || end != text.data() + text.size() || value == 0) {
                usage(fmt::format("'{}' wants a positive whole number, not '{}'", argument, text));
            }
        };
        if (argument == "--json") {
            options.json = true;
        } else if (argument == "--rays") {
            number(options.rays);
        } else if (argument == "--resolution") {
            number(options.resolution);
        } else if (argument == "--seed") {
            number(options.seed);
        } else if (argument == "--cache") {
            options.cache = next();
        } else if (argument.starts_with("--") || !options.scene.empty()) {
            usage(fmt::format("'{}' is unknown here", argument));
        } else {
            options.scene = argument;
        }
    }
    if (options.scene.empty()) usage("no scene");
    return options;
}

void run(const Options& options) {
    const core::Scene scene = core::load_scene_file(options.scene);
    sdf::BakeSettings settings;
    settings.resolution = static_cast<int>(options.resolution);
    const sdf::BakeResult bakes = sdf::bake_scene(scene, settings, options.cache);
    for (const sdf::MeshBake& bake : bakes.meshes) {
        if (bake.error) fmt::print(stderr, "warning: {}\n", bake.error->what());
    }
    const auto grids = sdf::grids_by_mesh(scene, bakes);
    const core::TriangleTracer triangles(scene);
    const sdf::SdfTracer fields(scene, grids);
    const core::DoubleBounds box = core::world_bounds(scene);
    const core::RayStream rays = tests::random_lines(box.center(), 0.5 * glm::length(box.extent()),
                                                     options.rays, static_cast<std::uint32_t>(options.seed));
    std::vector<double> voxels;
    for (const auto& grid : grids) voxels.push_back(grid ? grid->voxel_size() : 0.0);
    print(options, core::compare_tracers({scene, triangles, fields, voxels}, rays,
                                         static_cast<std::uint32_t>(options.seed)));
}

}  // namespace

int main(int count, char** arguments) {
    try {
        run(parse(count, arguments));
        return 0;
    } catch (const core::InputError& error) {
        fmt::print(stderr, "fieldlight_geometry: {}\n", error.what());
        return static_cast<int>(error.kind());
    }
}
