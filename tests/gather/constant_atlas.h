// tests/gather/constant_atlas.h: probes on a plane whose every texel holds 1.
#pragma once

#include "gather/screen_probes/probe_atlas.h"

namespace tests {

/// 3 x 3 tiles of 16 pixels with one probe each at (x, y), y rows of `across` and `along` world units apart.
/// All rays hit at distance 1.
inline gather::ProbeAtlas constant_atlas(int resolution, const glm::vec3& across, const glm::vec3& along,
                                         const glm::vec3& normal) {
    gather::ProbeAtlas atlas;
    atlas.resolution = resolution;
    atlas.spacing = 16;
    atlas.tiles_x = 3;
    atlas.tiles_y = 3;
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 3; ++x) {
            gather::Probe probe;
            probe.pixel = {16 * x + 5, 16 * y + 9};
            probe.position = static_cast<float>(x) * across + static_cast<float>(y) * along;
            probe.normal = normal;
            probe.depth = probe.plane_scale = 2.0f;
            atlas.probes.push_back(probe);
        }
    }
    atlas.allocate_texels();
    for (glm::vec3& value : atlas.radiance) value = glm::vec3(1.0f);
    for (float& distance : atlas.hit_distance) distance = 1.0f;
    for (std::uint8_t& count : atlas.ray_count) count = 1;
    return atlas;
}

}  // namespace tests
