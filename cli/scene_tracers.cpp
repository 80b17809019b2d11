#include "cli/scene_tracers.h"

#include <fmt/format.h>

#include <map>

#include "core/support/error.h"

namespace cli {

const char* name_of(TracerKind kind) {
    return kind == TracerKind::kSdf ? "sdf" : "triangle";
}

const char* name_of(sdf::HitMode mode) {
    switch (mode) {
        case sdf::HitMode::kEps:
            return "eps";
        case sdf::HitMode::kSecant:
            return "secant";
        case sdf::HitMode::kCubic:
            break;
    }
    return "cubic";
}

void add_hit_mode_option(CLI::App& verb, sdf::HitMode& mode) {
    std::map<std::string, sdf::HitMode> modes;
    for (const sdf::HitMode each : {sdf::HitMode::kEps, sdf::HitMode::kSecant, sdf::HitMode::kCubic}) {
        modes[name_of(each)] = each;
    }
    verb.add_option(
            "--hit-mode", mode,
            "Where a ray meets a field. cubic (default): the exact root, P99 error 1e-5 voxel. secant: "
            "false positions, 0.01 voxel, at 1.05 times the speed. eps: false positions until a sample is "
            "within 0.1 voxel, at 1.05 times the speed. secant and eps may miss a wall under 1.5 voxels; "
            "secant beats eps: both are there to show what exactness costs")
        ->transform(CLI::CheckedTransformer(modes).description(""))
        ->type_name("MODE");
}

void add_sample_bits_option(CLI::App& verb, sdf::SampleBits& bits) {
    verb.add_option_function<int>(
            "--sample-bits", [&bits](int value) { bits = static_cast<sdf::SampleBits>(value); },
            "Bits a sample of the fields: 16 (default), or 8, of which one read fetches four. 8 puts "
            "the surface up to "
            "0.016 voxel off and normals up to 1 degree, at the same speed and in the same memory: "
            "it is there to "
            "show that price")
        ->check(CLI::IsMember({8, 16}).description(""))
        ->type_name("8|16");
}

sdf::BakeResult bake_fields(const Program& program, const core::Scene& scene,
                            const sdf::BakeSettings& settings, const std::filesystem::path& folder) {
    sdf::BakeResult result = sdf::bake_scene(scene, settings, folder, make_progress(program), stop_flag());
    if (stop_flag()()) throw core::Interrupted();  // The bake ends early and says nothing.
    // A mesh that cannot be baked is stated; a picture that lacks what memory had no room for is none.
    for (const sdf::MeshBake& mesh : result.meshes) {
        if (mesh.error && mesh.error->kind() == core::ErrorKind::kOutOfMemory) {
            throw core::InputError(*mesh.error);
        }
    }
    for (const std::string& missing : missing_meshes(result)) warn(program, missing);
    for (const sdf::MeshBake& mesh : result.meshes) {
        if (mesh.error) continue;
        for (const std::string& warning : mesh.warnings) {
            warn(program, fmt::format("mesh '{}': {}", mesh.name, warning));
        }
    }
    return result;
}

std::vector<std::string> missing_meshes(const sdf::BakeResult& baked) {
    std::vector<std::string> lines;
    for (const sdf::MeshBake& mesh : baked.meshes) {
        if (!mesh.error) continue;
        lines.push_back(
            fmt::format("{}; it is missing from everything traced through fields", mesh.error->what()));
    }
    return lines;
}

}  // namespace cli
