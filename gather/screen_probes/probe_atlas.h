// gather/screen_probes/probe_atlas.h: the probes of one frame and the light they hold.
//
// Uniform probes first, one a tile in row order; adaptive ones after them, as rows at the bottom of the
// atlas. Directions are world-space octahedral texels of equal area, the same for every probe of a frame, so
// that neighbours match.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/math/spherical_harmonics.h"

namespace gather {

/// Where a probe stands: on the surface that one pixel sees.
struct Probe {
    glm::ivec2 pixel{-1};
    glm::vec3 position{0.0f};
    glm::vec3 normal{0.0f, 0.0f, 1.0f};  ///< Geometric.
    float depth = 0.0f;                  ///< Planar; 0: no surface in its tile, and no light.
    float plane_scale = 1.0f;            ///< Of its pixel.
    int level = 0;                       ///< 0 uniform, 1, 2 by refinement, 3 by flood fill.

    bool valid() const { return depth > 0.0f; }
};

struct ProbeAtlas {
    int resolution = 8;  ///< N.
    int spacing = 16;    ///< Pixels.
    int tiles_x = 0;
    int tiles_y = 0;
    std::vector<Probe> probes;
    std::vector<glm::vec3> radiance;      ///< N x N a probe, row-major.
    std::vector<float> hit_distance;      ///< Likewise; the nearest of a texel's rays.
    std::vector<std::uint8_t> ray_count;  ///< Rays a texel: 0 (culled), 1 or 4.
    std::vector<core::ShColor> sh;        ///< One a probe; empty unless asked for.

    std::vector<std::uint32_t> adaptive_begin;  ///< tiles + 1: adaptive probes of a tile, after the uniform.

    std::size_t tile_count() const {
        return static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y);
    }
    std::size_t texel_count() const {
        return static_cast<std::size_t>(resolution) * static_cast<std::size_t>(resolution);
    }
    std::span<const glm::vec3> radiance_of(std::size_t probe) const {
        return {radiance.data() + probe * texel_count(), texel_count()};
    }

    /// Calls `body(index)` for all probes of the 3 x 3 tiles around a pixel, the uniform ones first.
    template <typename Body>
    void for_probes_around(const glm::ivec2& pixel, const Body& body) const {
        const glm::ivec2 tile = pixel / spacing;
        const glm::ivec2 first = glm::max(tile - 1, glm::ivec2(0));
        const glm::ivec2 last = glm::min(tile + 1, glm::ivec2(tiles_x, tiles_y) - 1);
        const auto index = [&](int x, int y) { return static_cast<std::size_t>(y * tiles_x + x); };
        for (int y = first.y; y <= last.y; ++y) {
            for (int x = first.x; x <= last.x; ++x) body(index(x, y));
        }
        if (adaptive_begin.empty()) return;
        for (int y = first.y; y <= last.y; ++y) {
            // Tiles of a row are neighbours in the list.
            const std::size_t end = adaptive_begin[index(last.x, y) + 1];
            for (std::size_t i = adaptive_begin[index(first.x, y)]; i < end; ++i) body(i);
        }
    }

    /// Room for the light of all probes.
    void allocate_texels();

    /// Bilinear in the octahedral map of one probe, across its border.
    glm::vec3 read(std::size_t probe, const glm::vec2& octahedral) const;
};

/// Bytes of a probe with all its texels; two atlases are kept, this frame's and the last one's.
std::uint64_t probe_bytes(int resolution);

/// What is the same for all probes of one resolution: averages over whole texels, so that a constant
/// environment comes out exact wherever the frame's jitter points.
class TexelTable {
public:
    explicit TexelTable(int resolution);

    /// Mean of the spherical harmonics over each texel.
    const std::vector<core::Sh>& mean_sh() const { return mean_sh_; }

    /// Direction of each texel's centre.
    const std::vector<glm::vec3>& centers() const { return centers_; }

    /// Mean over each texel of the cosine clamped to the hemisphere about `normal`, times the texel's solid
    /// angle: the texels' weights in the irradiance. @param weights N x N
    void cosine_weights(const glm::vec3& normal, std::span<float> weights) const;

    /// Cells along a texel's edge.
    static constexpr int kCells = 4;

    /// Directions of the centres of a texel's cells, row by row.
    std::span<const glm::vec3> cells(std::size_t texel) const {
        constexpr std::size_t kCount = static_cast<std::size_t>(kCells) * kCells;
        return std::span(cells_).subspan(texel * kCount, kCount);
    }

private:
    std::vector<core::Sh> mean_sh_;
    std::vector<glm::vec3> centers_;
    std::vector<glm::vec3> cells_;
};

/// Projects each probe's radiance: c_lm = (4 pi / N^2) sum_j L_j mean(Y_lm)_j.
void project_to_sh(const TexelTable& table, ProbeAtlas& atlas);

}  // namespace gather
