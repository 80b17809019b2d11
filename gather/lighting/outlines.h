// gather/lighting/outlines.h: more samples of the film where an outline crosses a pixel.
//
// A frame lights one sample a pixel with care, so that few frames leave outlines ragged. Pixels in which an
// earlier frame found an outline take further camera rays. These have their own emission, sky and direct
// light by one shadow ray; their indirect light is that of the nearest of the frame's samples beside them, on
// the same surface if there is one: an approximation, which blurs indirect light by a pixel. All of them
// count, and which pixels take them depends on earlier frames alone: a sample that chose its own company
// would weigh itself wrongly.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/render/renderer.h"
#include "gather/lighting/scene_lighting.h"
#include "gather/lighting/visible_surfaces.h"

namespace gather {

/// A further sample of a pixel's film.
struct OutlineSample {
    std::uint32_t pixel = 0;
    std::uint32_t source = kSky;  ///< The pixel whose indirect light it takes, or one of:
    glm::vec3 tint{1.0f};         ///< Its albedo over the source's.
    glm::vec3 direct{0.0f};       ///< Emission or sky, and light of S.
    glm::vec3 normal{0.0f};
    glm::vec3 albedo{0.0f};
    float depth = 0.0f;     ///< Planar.
    float distance = 0.0f;  ///< Along the ray.
    std::uint32_t steps = 0;

    static constexpr std::uint32_t kSky = 0xffffffffu;  ///< No surface.
    static constexpr std::uint32_t kAlone =
        0xfffffffeu;  ///< No sample about it is on any surface: no indirect light.
};

/// The samples of the film of all pixels over the frames of a picture.
class Outlines {
public:
    /// @param samples a pixel takes a frame where an outline crosses it, its first one included; 1: none
    Outlines(int width, int height, int samples);

    /// By pixel, the index of the frame's first sample in the sequence of its film.
    const std::vector<std::uint32_t>& film_indices() const { return film_indices_; }

    /// Whether pixels may take further samples.
    bool wanted() const { return further_ > 0; }

    struct Rays {
        std::uint64_t camera_rays = 0, shadow_rays = 0, exhausted = 0;
    };

    /// Takes the further samples of this frame, those of a pixel in a row.
    Rays sample(const core::RenderInputs& inputs, const SceneLighting& lighting,
                const VisibleSurfaces& visible);

    /// Calls `body` with the further samples of some pixels, from several threads; each pixel's in one call.
    void for_pixels(const std::function<void(std::span<const OutlineSample>)>& body) const;

    /// Looks for outlines in this frame, for those that follow.
    void end_frame(const VisibleSurfaces& visible);

    static std::uint64_t bytes(int width, int height, int samples);

private:
    std::uint32_t further_;  ///< Samples beside the first.
    std::vector<std::uint32_t> film_indices_;
    std::vector<std::uint8_t> marks_;
    std::vector<std::uint32_t> pixels_;  ///< Those that are marked, in order.
    std::vector<OutlineSample> samples_;
};

/// Whether an outline runs between two pixels: of a surface, between surfaces, or of what emits.
bool is_outline(const VisibleSurfaces& visible, std::size_t a, std::size_t b);

}  // namespace gather
