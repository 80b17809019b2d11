// core/render/renderer.h: what every way of making a picture has in common, so that they can be compared.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "core/image/image.h"
#include "core/scene/scene.h"
#include "core/support/progress.h"
#include "core/trace/tracer.h"

namespace core {

/// A rectangle of pixels; width 0 means the whole picture.
struct Crop {
    int x = 0, y = 0, width = 0, height = 0;
};

/// What a picture is made from. References must outlive the call.
struct RenderInputs {
    const Scene& scene;
    const Camera& camera;
    const Tracer& tracer;   ///< For everything after the camera ray.
    const Tracer& primary;  ///< For camera rays.
    int width = 0;          ///< Of the whole picture, before cropping.
    int height = 0;
    Crop crop;
    std::uint64_t seed = 0;
    std::set<std::string> aovs;  ///< Layers wanted beside the beauty: `Depth`, `Normal`, `Variance`, ...
    double time_budget_seconds = 0.0;  ///< Stop refining after this long; 0: no limit.
    Progress progress;
    StopRequested stop_requested;
};

/// What one pass cost.
struct PassCost {
    std::string name;
    double seconds = 0.0;
    std::uint64_t rays = 0;
};

/// A finished picture with what it took.
struct Frame {
    Image image;  ///< R, G, B, A, then the AOVs asked for.
    std::vector<PassCost> passes;
    double samples_per_pixel = 0.0;
    std::uint64_t rays = 0;
    std::uint64_t exhausted_rays = 0;
    double clamped_share = 0.0;  ///< Of the light that gathering rays brought: taken off by a clamp, a bias.
};

/// Makes pictures. Implementations are deterministic: same inputs, same bits, at any thread count.
class Renderer {
public:
    virtual ~Renderer() = default;

    /// @throws InputError for inputs it cannot honour, such as an AOV it does not know.
    virtual Frame render(const RenderInputs& inputs) = 0;
};

}  // namespace core
