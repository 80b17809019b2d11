#include "cli/reference_picture.h"

#include <fmt/format.h>

#include <optional>

#include "cli/recorded_seconds.h"
#include "cli/stage_clock.h"
#include "core/image/error_estimate.h"
#include "core/image/exr.h"
#include "core/support/error.h"
#include "core/support/hash.h"

namespace cli {

namespace {

namespace fs = std::filesystem;

/// Header attributes by which a kept reference is known again.
constexpr const char* kKeyAttribute = "referenceKey";
constexpr const char* kPixelAttribute = "pixelHash";

std::string key_of(const RenderOptions& options, const core::Scene& scene, const core::Camera& camera) {
    core::Hasher hasher;
    hasher.add_text(FIELDLIGHT_VERSION);
    hasher.add_text(core::scene_hash(scene));
    hasher.add(camera.world_from_camera);
    hasher.add(camera.orthographic);
    hasher.add(camera.vertical_fov);
    hasher.add(camera.magnification);
    hasher.add(camera.near_distance);
    hasher.add(camera.far_distance);
    hasher.add(options.width);
    hasher.add(options.height);
    hasher.add(options.samples_per_pixel);
    hasher.add(options.bounces);
    hasher.add(options.seed);
    return hasher.hex();
}

/// In the order in which a file gives them back, which is not that of rendering.
std::string pixel_hash(const core::Image& image) {
    core::Hasher hasher;
    for (const char* name : {"R", "G", "B", "A", "Variance.R", "Variance.G", "Variance.B"}) {
        const std::vector<float>* values = image.find(name);
        if (values) hasher.add_range(std::span<const float>(*values));
    }
    return hasher.hex();
}

/// The kept picture, or nothing and why in `reason`.
std::optional<core::Image> read_kept(const fs::path& file, const std::string& key, std::string& reason) {
    try {
        core::ExrFile kept = core::read_exr_file(file);
        const auto& attributes = kept.info.attributes;
        const auto attribute = [&](const char* name) {
            const auto found = attributes.find(name);
            return found == attributes.end() ? std::string() : found->second;
        };
        if (attribute(kKeyAttribute) != key) {
            reason = "it is of another picture";
        } else if (attribute(kPixelAttribute) != pixel_hash(kept.image) || !kept.image.color("Variance") ||
                   core::count_nonfinite(kept.image) > 0) {
            reason = "its pixels are not those that were written";
        } else {
            return std::move(kept.image);
        }
    } catch (const core::InputError& error) {
        reason = error.what();
    }
    return std::nullopt;
}

}  // namespace

ReferencePicture reference_picture(const Program& program, const RenderOptions& options,
                                   const core::Scene& scene, const core::Camera& camera,
                                   const SceneTracers& tracers, const fs::path& folder) {
    const std::string key = key_of(options, scene, camera);
    const fs::path file = folder / (key + ".exr"), price_file = folder / (key + ".json");
    ReferencePicture reference;
    if (fs::exists(file)) {
        std::string reason;
        if (std::optional<core::Image> kept = read_kept(file, key, reason)) {
            note(program, fmt::format("'{}': this reference of an earlier run is used", file.string()));
            reference.image = std::move(*kept);
            reference.reused = true;
            reference.render_seconds = recorded_seconds(price_file, key);
        } else {
            warn(program,
                 fmt::format("'{}': rendered again, because the reference of an earlier run is of no "
                             "use: {}",
                             file.string(), reason));
        }
    }
    if (!reference.reused) {
        StageClock clock;
        core::Frame frame = render_frame(program, options, scene, camera, tracers);
        reference.seconds = clock.lap();
        reference.render_seconds = reference.seconds;
        core::ExrAttributes attributes =
            picture_attributes(options, scene, core::scene_hash(scene), camera, frame);
        attributes[kKeyAttribute] = key;
        attributes[kPixelAttribute] = pixel_hash(frame.image);
        core::write_exr(file, frame.image, attributes);
        record_seconds(price_file, key, reference.seconds);
        reference.image = std::move(frame.image);
    }
    reference.rel_variance = core::noise_rel_mse(reference.image);
    return reference;
}

}  // namespace cli
