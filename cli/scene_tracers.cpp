#include "cli/scene_tracers.h"

#include <fmt/format.h>

#include "core/support/error.h"

namespace cli {

const char* name_of(TracerKind kind) {
    return kind == TracerKind::kSdf ? "sdf" : "triangle";
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
