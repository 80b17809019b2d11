// tests/sdf/baked_shapes.h: meshes to fields in one call, for the tests of sdf/.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "core/scene/scene.h"
#include "sdf/brick_grid.h"
#include "sdf/mesh_to_sdf.h"
#include "sdf/triangle_bvh.h"
#include "tests/support/analytic_scenes.h"

namespace tests {

/// Bakes with `resolution` voxels on the longest side.
inline sdf::SampledField bake(const core::Mesh& mesh, int resolution,
                              sdf::ClassOverride surface_class = sdf::ClassOverride::kAuto) {
    const sdf::MeshView view{mesh.positions, mesh.triangles};
    const glm::dvec3 extent = sdf::usable_extent(view);
    return sdf::bake_mesh(view, {std::max({extent.x, extent.y, extent.z}) / resolution, surface_class});
}

inline std::shared_ptr<const sdf::BrickGrid> grid_of(const core::Mesh& mesh, int resolution,
                                                     sdf::SampleBits bits = sdf::SampleBits::k16) {
    return std::make_shared<const sdf::BrickGrid>(bake(mesh, resolution), bits);
}

/// The mesh's triangles in local units.
inline std::vector<sdf::Triangle> triangles_of(const core::Mesh& mesh) {
    std::vector<sdf::Triangle> triangles;
    for (const glm::uvec3& corner : mesh.triangles) {
        triangles.push_back({glm::dvec3(mesh.positions[corner.x]), glm::dvec3(mesh.positions[corner.y]),
                             glm::dvec3(mesh.positions[corner.z])});
    }
    return triangles;
}

/// Calls visit(local position, sample, triangle) for every active sample.
template <typename Visit>
void for_each_sample(const sdf::SampledField& field, const Visit& visit) {
    for (const sdf::FieldLeaf& leaf : field.leaves) {
        for (int i = 0; i < sdf::kLeafSize; ++i) {
            if (!leaf.is_active(i)) continue;
            const glm::ivec3 lattice = leaf.origin + glm::ivec3(i / 64, i / 8 % 8, i % 8);
            visit(field.info.origin + field.info.voxel_size * glm::dvec3(lattice),
                  leaf.distance[static_cast<std::size_t>(i)], leaf.triangle[static_cast<std::size_t>(i)]);
        }
    }
}

}  // namespace tests
