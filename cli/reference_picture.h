// cli/reference_picture.h: the picture that others are judged by, kept between runs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "cli/render_job.h"
#include "core/image/image.h"

namespace cli {

/// Path-traced on triangles.
struct ReferencePicture {
    core::Image image;  ///< R, G, B, A and Variance.R, .G, .B, the variance of the pixel's mean.
    bool reused = false;
    double seconds = 0.0;                  ///< Of rendering in this run; 0 where it was reused.
    std::optional<double> render_seconds;  ///< What rendering took, in whichever run; empty if not recorded.
    double rel_variance = 0.0;             ///< Mean over pixels and channels of variance / (R^2 + 0.01).
};

/// Takes the reference from `folder`/HASH.exr, HASH being of the scene's content, the camera and the settings
/// and version that decide the pixels; renders and keeps it where it is missing, what that took in HASH.json
/// beside it. A file that is damaged, or
/// holds something else, is said on stderr and rendered again.
/// @param options of the picture, with Variance among the layers; its output names the picture in messages.
/// @throws core::InputError, core::Interrupted; std::runtime_error if a value is not finite
ReferencePicture reference_picture(const Program& program, const RenderOptions& options,
                                   const core::Scene& scene, const core::Camera& camera,
                                   const SceneTracers& tracers, const std::filesystem::path& folder);

}  // namespace cli
