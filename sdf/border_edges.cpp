#include "sdf/border_edges.h"

#include <algorithm>
#include <unordered_map>

#include "sdf/clean_mesh.h"

namespace sdf {

std::vector<std::uint8_t> find_border_edges(const MeshView& mesh) {
    const CleanMesh clean = clean_mesh(mesh);
    const auto edge_opposite = [&](std::size_t triangle, int corner) {
        const glm::uvec3& corners = clean.triangles[triangle];
        const std::uint64_t a = corners[(corner + 1) % 3], b = corners[(corner + 2) % 3];
        return std::min(a, b) << 32 | std::max(a, b);
    };
    std::unordered_map<std::uint64_t, std::uint32_t> use_count;
    use_count.reserve(clean.triangles.size() * 2);
    for (std::size_t i = 0; i < clean.triangles.size(); ++i) {
        for (int corner = 0; corner < 3; ++corner) ++use_count[edge_opposite(i, corner)];
    }
    std::vector<std::uint8_t> borders(mesh.triangles.size(), 0);
    for (std::size_t i = 0; i < clean.triangles.size(); ++i) {
        for (int corner = 0; corner < 3; ++corner) {
            if (use_count[edge_opposite(i, corner)] == 1) {
                borders[clean.source_triangle[i]] |= static_cast<std::uint8_t>(1u << corner);
            }
        }
    }
    return borders;
}

}  // namespace sdf
