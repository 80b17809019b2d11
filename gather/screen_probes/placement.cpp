#include "gather/screen_probes/placement.h"

#include <algorithm>
#include <array>
#include <span>

#include "core/math/random.h"
#include "core/support/parallel.h"
#include "gather/screen_probes/interpolation.h"

namespace gather {

namespace {

/// A connected region of fewer failing pixels than this gets no probe of its own.
constexpr std::size_t kSmallestRegion = 4;

constexpr int kRefinementLevels = 2;

Probe probe_at(const VisibleSurfaces& visible, int x, int y, int level) {
    const std::size_t pixel = visible.index(x, y);
    const core::SurfacePoint& point = visible.points[pixel];
    return {{x, y}, point.position, point.geometric_normal, visible.depth[pixel], visible.plane_scale(pixel),
            level};
}

/// One frame's placement.
class Placement {
public:
    Placement(const VisibleSurfaces& visible, const ScreenProbeSettings& settings, ProbeAtlas& atlas)
        : visible_(visible), settings_(settings), atlas_(atlas) {}

    void place_uniform(const glm::ivec2& jitter);
    void refine(const glm::ivec2& jitter, std::uint32_t frame);

private:
    bool fails(int x, int y) const;
    void refine_by(const glm::ivec2& jitter, std::span<const std::uint32_t> order);
    void fill_regions(std::size_t tile, std::vector<Probe>& found) const;
    void register_adaptive();

    template <typename Body>
    void for_tile_pixels(std::size_t tile, const glm::ivec2& offset, int step, const Body& body) const {
        const int x0 = static_cast<int>(tile % static_cast<std::size_t>(atlas_.tiles_x)) * atlas_.spacing;
        const int y0 = static_cast<int>(tile / static_cast<std::size_t>(atlas_.tiles_x)) * atlas_.spacing;
        for (int y = y0 + offset.y; y < std::min(y0 + atlas_.spacing, visible_.height); y += step) {
            for (int x = x0 + offset.x; x < std::min(x0 + atlas_.spacing, visible_.width); x += step) {
                body(x, y);
            }
        }
    }

    const VisibleSurfaces& visible_;
    const ScreenProbeSettings& settings_;
    ProbeAtlas& atlas_;
    std::size_t budget_ = 0;                ///< Adaptive probes still to be had.
    std::vector<std::vector<Probe>> kept_;  ///< Adaptive probes by tile.
    bool by_distance_ = false;              ///< Whether probes far along the surface fail, too.
};

void Placement::place_uniform(const glm::ivec2& jitter) {
    atlas_.probes.assign(atlas_.tile_count(), Probe{});
    core::parallel_for(atlas_.tile_count(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t tile = begin; tile < end; ++tile) {
            const glm::ivec2 origin = glm::ivec2(tile % static_cast<std::size_t>(atlas_.tiles_x),
                                                 tile / static_cast<std::size_t>(atlas_.tiles_x)) *
                                      atlas_.spacing;
            const glm::ivec2 wanted =
                glm::min(origin + jitter, glm::ivec2(visible_.width, visible_.height) - 1);
            if (visible_.surface(visible_.index(wanted.x, wanted.y))) {
                atlas_.probes[tile] = probe_at(visible_, wanted.x, wanted.y, 0);
                continue;
            }
            // The surface of the tile that is nearest to the wanted pixel.
            int best = std::numeric_limits<int>::max();
            for_tile_pixels(tile, glm::ivec2(0), 1, [&](int x, int y) {
                const glm::ivec2 offset = glm::ivec2(x, y) - wanted;
                const int distance = offset.x * offset.x + offset.y * offset.y;
                if (distance >= best || !visible_.surface(visible_.index(x, y))) return;
                best = distance;
                atlas_.probes[tile] = probe_at(visible_, x, y, 0);
            });
        }
    });
}

bool Placement::fails(int x, int y) const {
    const std::size_t pixel = visible_.index(x, y);
    if (!visible_.surface(pixel)) return false;
    const core::SurfacePoint& point = visible_.points[pixel];
    const ProbeWeights weights =
        find_probes(atlas_,
                    {glm::vec2(x, y), point.position, point.geometric_normal, visible_.plane_scale(pixel),
                     visible_.footprint.at(visible_.depth[pixel]) * static_cast<float>(atlas_.spacing)},
                    settings_.plane_sharpness);
    const float support = by_distance_ ? weights.support : weights.surface_support;
    return !(support >= settings_.adaptive_threshold);
}

void Placement::fill_regions(std::size_t tile, std::vector<Probe>& found) const {
    std::vector<glm::ivec2> failing;
    for_tile_pixels(tile, glm::ivec2(0), 1, [&](int x, int y) {
        if (fails(x, y)) failing.emplace_back(x, y);
    });
    std::vector<std::uint8_t> taken(failing.size(), 0);
    std::vector<std::size_t> region;
    for (std::size_t seed = 0; seed < failing.size(); ++seed) {
        if (taken[seed]) continue;
        region.assign(1, seed);
        taken[seed] = 1;
        glm::ivec2 sum(0);
        for (std::size_t next = 0; next < region.size(); ++next) {
            sum += failing[region[next]];
            for (std::size_t other = 0; other < failing.size(); ++other) {
                if (taken[other]) continue;
                const glm::ivec2 offset = glm::abs(failing[other] - failing[region[next]]);
                if (offset.x + offset.y != 1) continue;
                taken[other] = 1;
                region.push_back(other);
            }
        }
        if (region.size() < kSmallestRegion) continue;
        const glm::vec2 center = glm::vec2(sum) / static_cast<float>(region.size());
        const std::size_t best = *std::min_element(region.begin(), region.end(), [&](auto a, auto b) {
            const glm::vec2 to_a = glm::vec2(failing[a]) - center;
            const glm::vec2 to_b = glm::vec2(failing[b]) - center;
            return glm::dot(to_a, to_a) < glm::dot(to_b, to_b);
        });
        found.push_back(probe_at(visible_, failing[best].x, failing[best].y, kRefinementLevels + 1));
    }
}

void Placement::register_adaptive() {
    atlas_.probes.resize(atlas_.tile_count());
    atlas_.adaptive_begin.assign(atlas_.tile_count() + 1, 0);
    for (std::size_t tile = 0; tile < kept_.size(); ++tile) {
        atlas_.adaptive_begin[tile] = static_cast<std::uint32_t>(atlas_.probes.size());
        atlas_.probes.insert(atlas_.probes.end(), kept_[tile].begin(), kept_[tile].end());
    }
    atlas_.adaptive_begin.back() = static_cast<std::uint32_t>(atlas_.probes.size());
}

void Placement::refine(const glm::ivec2& jitter, std::uint32_t frame) {
    budget_ = adaptive_limit(visible_.width, visible_.height, settings_);
    kept_.assign(atlas_.tile_count(), {});
    // A budget that ends in the middle of a level leaves out other tiles in every frame.
    std::vector<std::uint32_t> order(atlas_.tile_count());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const std::uint32_t hash_a = core::hash_words(a, frame);
        const std::uint32_t hash_b = core::hash_words(b, frame);
        return hash_a != hash_b ? hash_a < hash_b : a < b;
    });
    // Surfaces without any probe come first: what is left serves those whose probes are far along the
    // surface.
    by_distance_ = false;
    refine_by(jitter, order);
    by_distance_ = true;
    refine_by(jitter, order);
}

void Placement::refine_by(const glm::ivec2& jitter, std::span<const std::uint32_t> order) {
    const std::size_t tiles = atlas_.tile_count();
    std::vector<std::uint8_t> failed_before(tiles, 0);
    for (int level = 1; level <= kRefinementLevels + 1 && budget_ > 0; ++level) {
        const int step = atlas_.spacing >> level;
        const bool flood = level > kRefinementLevels;
        if (!flood && step < 2) continue;
        std::vector<std::vector<Probe>> found(tiles);
        core::parallel_for(tiles, 16, [&](std::size_t begin, std::size_t end) {
            for (std::size_t tile = begin; tile < end; ++tile) {
                if (flood) {
                    if (failed_before[tile]) fill_regions(tile, found[tile]);
                    continue;
                }
                for_tile_pixels(tile, jitter % step, step, [&](int x, int y) {
                    if (fails(x, y)) found[tile].push_back(probe_at(visible_, x, y, level));
                });
                failed_before[tile] = failed_before[tile] || !found[tile].empty();
            }
        });
        for (const std::uint32_t tile : order) {
            const std::size_t count = std::min(budget_, found[tile].size());
            kept_[tile].insert(kept_[tile].end(), found[tile].begin(),
                               found[tile].begin() + static_cast<std::ptrdiff_t>(count));
            budget_ -= count;
        }
        register_adaptive();
    }
}

}  // namespace

glm::ivec2 tile_grid(int width, int height, int spacing) {
    return {(width + spacing - 1) / spacing, (height + spacing - 1) / spacing};
}

std::size_t adaptive_limit(int width, int height, const ScreenProbeSettings& settings) {
    const glm::ivec2 tiles = tile_grid(width, height, settings.spacing);
    return static_cast<std::size_t>(static_cast<double>(settings.adaptive_budget) * tiles.x * tiles.y);
}

void place_probes(const VisibleSurfaces& visible, const ScreenProbeSettings& settings, bool adaptive,
                  std::uint32_t frame, std::uint64_t seed, ProbeAtlas& atlas) {
    const glm::ivec2 tiles = tile_grid(visible.width, visible.height, settings.spacing);
    atlas.resolution = settings.resolution;
    atlas.spacing = settings.spacing;
    atlas.tiles_x = tiles.x;
    atlas.tiles_y = tiles.y;
    atlas.adaptive_begin.clear();
    glm::ivec2 jitter(settings.spacing / 2);
    if (settings.jitter_placement) {
        const core::SampleSequence sequence(pixel_key(seed, 0, 0, 0x9a0be5u), frame);
        jitter = glm::min(glm::ivec2(sequence.point(0) * static_cast<float>(settings.spacing)),
                          glm::ivec2(settings.spacing - 1));
    }
    Placement placement(visible, settings, atlas);
    placement.place_uniform(jitter);
    if (adaptive) placement.refine(jitter, frame);
}

}  // namespace gather
