#include "gather/screen_probes/probe_atlas.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/math/octahedral.h"
#include "core/math/sampling.h"
#include "core/support/parallel.h"

namespace gather {

namespace {

constexpr int kEdgeForSh = 256;  ///< Of a whole map: midpoints' error falls with its square.

}  // namespace

void ProbeAtlas::allocate_texels() {
    const std::size_t count = probes.size() * texel_count();
    radiance.assign(count, glm::vec3(0.0f));
    hit_distance.assign(count, 0.0f);
    ray_count.assign(count, 0);
}

glm::vec3 ProbeAtlas::read(std::size_t probe, const glm::vec2& octahedral) const {
    const glm::vec2 at = octahedral * static_cast<float>(resolution) - 0.5f;
    const glm::vec2 corner = glm::floor(at);
    const glm::vec2 f = at - corner;
    const std::span<const glm::vec3> texels = radiance_of(probe);
    const auto texel = [&](int dx, int dy) {
        const glm::ivec2 t = core::wrap_octahedral_texel(glm::ivec2(corner) + glm::ivec2(dx, dy), resolution);
        return texels[static_cast<std::size_t>(t.y * resolution + t.x)];
    };
    return glm::mix(glm::mix(texel(0, 0), texel(1, 0), f.x), glm::mix(texel(0, 1), texel(1, 1), f.x), f.y);
}

std::uint64_t probe_bytes(int resolution) {
    const auto texels = static_cast<std::uint64_t>(resolution) * static_cast<std::uint64_t>(resolution);
    return sizeof(Probe) + sizeof(core::ShColor) +
           texels * (sizeof(glm::vec3) + sizeof(float) + sizeof(std::uint8_t));
}

TexelTable::TexelTable(int resolution) {
    const int sub_for_sh = kEdgeForSh / resolution;
    const auto sub_direction = [&](int x, int y, int i, int j, int sub) {
        const glm::vec2 point(
            (static_cast<float>(x) + (static_cast<float>(i) + 0.5f) / static_cast<float>(sub)),
            (static_cast<float>(y) + (static_cast<float>(j) + 0.5f) / static_cast<float>(sub)));
        return core::direction_from_octahedral(point / static_cast<float>(resolution));
    };
    for (int y = 0; y < resolution; ++y) {
        for (int x = 0; x < resolution; ++x) {
            centers_.push_back(sub_direction(x, y, 0, 0, 1));
            std::array<double, core::kShCount> sum{};
            for (int j = 0; j < sub_for_sh; ++j) {
                for (int i = 0; i < sub_for_sh; ++i) {
                    const core::Sh basis = core::sh_basis(sub_direction(x, y, i, j, sub_for_sh));
                    for (std::size_t k = 0; k < core::kShCount; ++k) sum[k] += static_cast<double>(basis[k]);
                }
            }
            core::Sh mean{};
            for (std::size_t k = 0; k < core::kShCount; ++k) {
                mean[k] = static_cast<float>(sum[k] / (sub_for_sh * sub_for_sh));
            }
            mean_sh_.push_back(mean);
            for (int j = 0; j < kCells; ++j) {
                for (int i = 0; i < kCells; ++i) cells_.push_back(sub_direction(x, y, i, j, kCells));
            }
        }
    }
}

void TexelTable::cosine_weights(const glm::vec3& normal, std::span<float> weights) const {
    float total = 0.0f;
    for (std::size_t texel = 0; texel < weights.size(); ++texel) {
        float sum = 0.0f;
        for (const glm::vec3& direction : cells(texel)) sum += std::max(0.0f, glm::dot(direction, normal));
        weights[texel] = sum;
        total += sum;
    }
    // By the sum, which the cells of coarse texels miss by up to 2 %: a constant environment comes out exact.
    const float scale = core::kPi / total;
    for (float& weight : weights) weight *= scale;
}

void project_to_sh(const TexelTable& table, ProbeAtlas& atlas) {
    atlas.sh.resize(atlas.probes.size());
    const std::vector<core::Sh>& mean = table.mean_sh();
    const float solid_angle = 4.0f * core::kPi / static_cast<float>(atlas.texel_count());
    core::parallel_for(atlas.probes.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t probe = begin; probe < end; ++probe) {
            core::ShColor sum{};
            const std::span<const glm::vec3> texels = atlas.radiance_of(probe);
            for (std::size_t texel = 0; texel < texels.size(); ++texel) {
                for (std::size_t k = 0; k < core::kShCount; ++k) sum[k] += texels[texel] * mean[texel][k];
            }
            for (glm::vec3& coefficient : sum) coefficient *= solid_angle;
            atlas.sh[probe] = sum;
        }
    });
}

}  // namespace gather
