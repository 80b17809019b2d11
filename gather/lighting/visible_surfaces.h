// gather/lighting/visible_surfaces.h: what each pixel sees in one frame, and its direct light.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "core/render/renderer.h"
#include "core/scene/camera.h"
#include "core/trace/surface.h"
#include "gather/lighting/scene_lighting.h"

namespace gather {

/// How large a pixel in the middle of the picture, and the picture, are at some depth.
class PixelFootprint {
public:
    PixelFootprint() = default;
    PixelFootprint(const core::CameraRays& camera, int width, int height);

    /// In world units. @param depth planar
    float at(float depth) const { return glm::length(origin_ + depth * direction_); }

    /// The length that distances from planes are told by: the depth, as long as the picture is not narrower
    /// than half of it. Through long lenses, and without perspective, depth says nothing of what is seen.
    float plane_scale(float depth) const { return std::min(depth, 2.0f * height_ * at(depth)); }

private:
    glm::vec3 origin_{0.0f}, direction_{0.0f};  ///< From the ray of one pixel to its neighbour's.
    float height_ = std::numeric_limits<float>::infinity();  ///< Of the picture, in pixels.
};

/// One camera ray a pixel; row-major. Pixels without a surface have depth 0.
struct VisibleSurfaces {
    int width = 0;
    int height = 0;
    PixelFootprint footprint;
    std::vector<core::SurfacePoint> points;
    std::vector<glm::vec3> origins;   ///< Where rays leave the surface.
    std::vector<glm::vec3> outgoing;  ///< Unit, towards the camera.
    std::vector<float> depth;         ///< Planar; 0: no surface.
    std::vector<float> distance;      ///< Along the ray; 0: no surface.
    std::vector<glm::vec3> emitted;   ///< Seen directly: emission of the surface, or the sky.
    std::vector<std::uint32_t> steps;

    bool surface(std::size_t pixel) const { return depth[pixel] > 0.0f; }
    float plane_scale(std::size_t pixel) const { return footprint.plane_scale(depth[pixel]); }
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }
    void resize(int new_width, int new_height);
};

/// Bytes of one pixel of VisibleSurfaces.
inline constexpr std::uint64_t kVisibleSurfaceBytes =
    sizeof(core::SurfacePoint) + 3 * sizeof(glm::vec3) + 2 * sizeof(float) + sizeof(std::uint32_t);

struct PassRays {
    std::uint64_t rays = 0;
    std::uint64_t exhausted = 0;
};

/// The key of a pixel's random numbers; `use` names the pass, so that dropping a pass shifts nothing.
std::uint32_t pixel_key(std::uint64_t seed, int x, int y, std::uint32_t use);
enum PixelUse : std::uint32_t {
    kCameraUse,
    kDirectUse,
    kInterpolationUse,
    kSpecularUse,
    kBentNormalUse,
    kVisibilityUse,
    kReflectionUse,
    kOutlineUse,
    kReflectionReuseUse
};

/// The camera ray through the sample of a pixel's film that has this index in its sequence.
core::Ray film_ray(const core::RenderInputs& inputs, const core::CameraRays& camera, int x, int y,
                   std::uint32_t film_index);

/// Writes down what a camera ray found. @return false for one that was exhausted, which claims neither
/// surface nor sky
bool see(const core::RenderInputs& inputs, const SceneLighting& lighting, const core::CameraRays& camera,
         const core::Ray& ray, const core::Hit& hit, std::size_t index, VisibleSurfaces& result);

/// One camera ray a pixel. @param film_indices by pixel, of its sample
PassRays find_visible_surfaces(const core::RenderInputs& inputs, const SceneLighting& lighting,
                               const std::vector<std::uint32_t>& film_indices, VisibleSurfaces& result);

/// The random numbers of a surface's light samples: their sequence, and the first one's index in it.
struct SampleId {
    std::uint32_t key = 0;
    std::uint32_t first = 0;
};

/// Adds the light of S to the surfaces from `begin` up to `end`, `samples` lights each by a shadow ray.
PassRays light_surfaces(const core::RenderInputs& inputs, const SceneLighting& lighting,
                        const VisibleSurfaces& visible, std::size_t begin, std::size_t end, int samples,
                        const std::function<SampleId(std::size_t)>& id, std::span<glm::vec3> direct);

/// Likewise to each pixel.
PassRays add_direct_light(const core::RenderInputs& inputs, const SceneLighting& lighting,
                          const VisibleSurfaces& visible, int samples, std::uint32_t frame,
                          std::vector<glm::vec3>& direct);

}  // namespace gather
