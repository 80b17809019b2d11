// cli/render_job.h: one picture from start to file: load, bake, build, render, write, account.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>

#include "cli/scene_setup.h"
#include "cli/scene_tracers.h"
#include "core/image/exr.h"
#include "core/image/tonemap.h"
#include "core/render/renderer.h"
#include "gather/plan.h"
#include "gather/settings.h"
#include "sdf/baker.h"

namespace cli {

enum class RendererKind { kGather, kPath };

/// As the flags spell it: gather, path.
const char* name_of(RendererKind kind);

/// What `fieldlight render` was asked for.
struct RenderOptions {
    SceneOptions scene;
    std::filesystem::path output;
    TracerKind tracer = TracerKind::kSdf;
    TracerKind primary = TracerKind::kTriangle;
    int width = 1280;
    int height = 720;
    core::Crop crop;
    RendererKind renderer = RendererKind::kGather;
    gather::Settings gather;        ///< Of the final gather alone.
    gather::EffectRequest effects;  ///< Likewise.
    int samples_per_pixel = 64;     ///< Of the path tracer alone.
    int bounces = -1;               ///< Of the path tracer; -1: no limit.
    std::uint64_t seed = 0;
    double time_budget_seconds = 0.0;
    std::set<std::string> aovs;
    sdf::HitMode hit_mode = sdf::HitMode::kCubic;  ///< Of rays through fields.
    sdf::BakeSettings bake;
    std::filesystem::path bake_folder;  ///< Empty: `SCENE.bake` beside the output.
    bool half = false;
    bool png = false;
    std::optional<float> exposure;  ///< EV100; nothing: automatic.
    core::ToneMap tone_map = core::ToneMap::kAces;
    std::filesystem::path stats;
};

/// Whether any of its rays go through fields.
inline bool traces_fields(const RenderOptions& options) {
    return options.tracer == TracerKind::kSdf || options.primary == TracerKind::kSdf;
}

/// The picture alone, of a scene that is ready to be traced. @param plan of the final gather
/// @throws core::InputError, core::Interrupted; std::runtime_error if a value is not finite
core::Frame render_frame(const Program& program, const RenderOptions& options, const core::Scene& scene,
                         const core::Camera& camera, const SceneTracers& tracers,
                         const gather::Plan& plan = {});

/// Everything that decided the picture, as the EXR keeps it. @param scene_hash before any plan was applied
core::ExrAttributes picture_attributes(const RenderOptions& options, const core::Scene& scene,
                                       const std::string& scene_hash, const core::Camera& camera,
                                       const core::Frame& frame, const gather::Plan& plan = {});

/// Renders and writes everything that was promised. Returns the object of `--stats`.
/// @throws core::InputError, core::Interrupted; std::runtime_error if a pixel is not finite (nothing is
/// written then).
nlohmann::json run_render(const Program& program, const RenderOptions& options);

}  // namespace cli
