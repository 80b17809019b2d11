// cli/scene_tracers.h: from a loaded scene to what traces it: bake, build; shared by the verbs that render.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cli/options.h"
#include "core/scene/scene.h"
#include "core/trace/triangle_tracer.h"
#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"

namespace cli {

enum class TracerKind { kSdf, kTriangle };

/// As the flags spell it: sdf, triangle.
const char* name_of(TracerKind kind);

/// As the flags spell it: eps, secant, cubic.
const char* name_of(sdf::HitMode mode);

/// Declares --hit-mode; its help says what each mode costs and gives.
void add_hit_mode_option(CLI::App& verb, sdf::HitMode& mode);

/// Declares --sample-bits; its help says what fewer cost and give.
void add_sample_bits_option(CLI::App& verb, sdf::SampleBits& bits);

/// The tracers that a picture needs, and no others. The scene must outlive them.
struct SceneTracers {
    std::unique_ptr<core::TriangleTracer> triangle;
    std::unique_ptr<sdf::SdfTracer> sdf;

    /// @pre that one is there
    const core::Tracer& get(TracerKind kind) const {
        if (kind == TracerKind::kSdf) return *sdf;
        return *triangle;
    }
};

/// Bakes what `folder` does not hold yet and says on stderr what is missing or not as asked for.
/// @throws core::InputError, core::Interrupted when asked to stop
sdf::BakeResult bake_fields(const Program& program, const core::Scene& scene,
                            const sdf::BakeSettings& settings, const std::filesystem::path& folder);

/// One line a mesh that could not be baked and so is missing from everything traced through fields.
std::vector<std::string> missing_meshes(const sdf::BakeResult& baked);

}  // namespace cli
