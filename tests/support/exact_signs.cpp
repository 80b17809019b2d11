#include "tests/support/exact_signs.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/support/parallel.h"
#include "sdf/clean_mesh.h"
#include "sdf/triangle_bvh.h"
#include "sdf/winding_number.h"
#include "tests/support/analytic_scenes.h"

namespace tests {
namespace {

constexpr double kMarginVoxels = 0.01;

/// The triangles that the bake could use, in voxels about the field's origin, with what became of them.
struct BakedMesh {
    sdf::CleanMesh clean;
    std::vector<sdf::Triangle> corners;

    BakedMesh(const core::Mesh& mesh, const sdf::SampledField& field)
        : clean(sdf::clean_mesh({mesh.positions, mesh.triangles})) {
        const auto voxels = [&](std::uint32_t vertex) {
            return (clean.vertices[vertex] - field.info.origin) / field.info.voxel_size;
        };
        for (const glm::uvec3& t : clean.triangles)
            corners.push_back({voxels(t.x), voxels(t.y), voxels(t.z)});
    }

    sdf::Feature feature(const sdf::SampledField& field, std::uint32_t triangle) const {
        return field.features.empty() ? sdf::Feature::kSurface
                                      : field.features[clean.source_triangle[triangle]];
    }
};

struct Sample {
    glm::dvec3 position{0.0};
    bool is_negative = false;
};

/// About `most` samples that have a side, chosen at random.
std::vector<Sample> samples_with_side(const sdf::SampledField& field, std::size_t most) {
    std::size_t active = 0;
    for (const sdf::FieldLeaf& leaf : field.leaves) {
        for (int i = 0; i < sdf::kLeafSize; ++i) active += leaf.is_active(i);
    }
    const double share = static_cast<double>(most) / static_cast<double>(active);
    TestRandom random(1);
    std::vector<Sample> samples;
    for (const sdf::FieldLeaf& leaf : field.leaves) {
        for (int i = 0; i < sdf::kLeafSize; ++i) {
            if (!leaf.is_active(i) || random.uniform() >= share) continue;
            const auto at = static_cast<std::size_t>(i);
            const double voxels = leaf.distance[at] / field.info.voxel_size;
            if (!(std::abs(voxels) > kMarginVoxels)) continue;
            const std::int32_t triangle = leaf.triangle[at];
            if (voxels < 0.0 && triangle >= 0 && !field.features.empty() &&
                field.features[static_cast<std::size_t>(triangle)] != sdf::Feature::kSurface) {
                continue;
            }
            samples.push_back({glm::dvec3(leaf.origin + glm::ivec3(i / 64, i / 8 % 8, i % 8)), voxels < 0.0});
        }
    }
    return samples;
}

}  // namespace

bool has_only_closed_solids(const core::Mesh& mesh, const sdf::SampledField& field) {
    if (field.info.mesh_class == sdf::MeshClass::kSheet) return false;
    const BakedMesh baked(mesh, field);
    for (const sdf::Component& part :
         sdf::classify_components(baked.clean, baked.corners, sdf::ClassOverride::kAuto)) {
        if (!part.is_sheet && !part.is_closed) return false;
    }
    return true;
}

SignAgreement sign_agreement(const core::Mesh& mesh, const sdf::SampledField& field, std::size_t most) {
    const BakedMesh baked(mesh, field);
    std::vector<sdf::Triangle> solid;
    for (std::uint32_t i = 0; i < baked.corners.size(); ++i) {
        if (baked.feature(field, i) != sdf::Feature::kSheet) solid.push_back(baked.corners[i]);
    }
    const std::vector<Sample> samples = samples_with_side(field, most);
    std::vector<std::uint8_t> is_inside(samples.size());
    core::parallel_for(samples.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            is_inside[i] = std::abs(sdf::exact_winding_number(solid, samples[i].position)) >= 0.5;
        }
    });
    SignAgreement result;
    result.samples = samples.size();
    for (std::size_t i = 0; i < samples.size(); ++i) {
        result.inside += is_inside[i];
        result.wrong += samples[i].is_negative != (is_inside[i] != 0);
    }
    return result;
}

}  // namespace tests
