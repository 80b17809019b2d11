#include "sdf/band.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cmath>

#include "core/math/bounds.h"

namespace sdf {

std::vector<FieldLeaf> find_band(const std::vector<Triangle>& triangles) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> faces;
    points.reserve(triangles.size() * 3);
    faces.reserve(triangles.size());
    for (const Triangle& triangle : triangles) {
        const auto first = static_cast<std::uint32_t>(points.size());
        for (const glm::dvec3& corner : {triangle.a, triangle.b, triangle.c}) {
            points.emplace_back(static_cast<float>(corner.x), static_cast<float>(corner.y),
                                static_cast<float>(corner.z));
        }
        faces.emplace_back(first, first + 1, first + 2);
    }
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, faces);
    openvdb::Int32Grid polygon_index(0);
    openvdb::util::NullInterrupter interrupter;
    const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
    const openvdb::FloatGrid::Ptr grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        interrupter, adapter, *transform, kBandVoxels, kBandVoxels, openvdb::tools::UNSIGNED_DISTANCE_FIELD,
        &polygon_index);

    std::vector<FieldLeaf> leaves;
    leaves.reserve(grid->tree().leafCount());
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
        const openvdb::Coord origin = leaf->origin();
        const auto* index_leaf = polygon_index.tree().probeConstLeaf(origin);
        FieldLeaf out;
        out.origin = {origin.x(), origin.y(), origin.z()};
        out.triangle.fill(-1);
        for (auto value = leaf->cbeginValueOn(); value; ++value) {
            const int i = static_cast<int>(value.pos());
            out.set_active(i);
            if (index_leaf && index_leaf->isValueOn(value.pos())) {
                out.triangle[static_cast<std::size_t>(i)] = index_leaf->getValue(value.pos());
            }
        }
        leaves.push_back(out);
    }
    std::sort(leaves.begin(), leaves.end(), [](const FieldLeaf& a, const FieldLeaf& b) {
        return std::array{a.origin.x, a.origin.y, a.origin.z} <
               std::array{b.origin.x, b.origin.y, b.origin.z};
    });
    return leaves;
}

LeafMap::LeafMap(const std::vector<FieldLeaf>& leaves) : leaves_(leaves) {
    core::BasicBounds<glm::dvec3> box;
    for (const FieldLeaf& leaf : leaves) box.include(glm::dvec3(leaf.origin));
    if (box.empty()) return;
    first_ = glm::ivec3(box.minimum);
    size_ = (glm::ivec3(box.maximum) - first_) / kLeafSide + 1;
    table_.assign(static_cast<std::size_t>(size_.x) * size_.y * size_.z, -1);
    for (std::size_t i = 0; i < leaves.size(); ++i) {
        table_[index((leaves[i].origin - first_) / kLeafSide)] = static_cast<std::int32_t>(i);
    }
}

bool LeafMap::interpolate(const glm::dvec3& point, double& result) const {
    const glm::dvec3 base = glm::floor(point);
    const glm::dvec3 u = point - base;
    const glm::ivec3 cell(base);
    result = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::ivec3 step(corner >> 2 & 1, corner >> 1 & 1, corner & 1);
        const float* sample = value(cell + step);
        if (!sample) return false;
        result +=
            *sample * (step.x ? u.x : 1.0 - u.x) * (step.y ? u.y : 1.0 - u.y) * (step.z ? u.z : 1.0 - u.z);
    }
    return true;
}

}  // namespace sdf
