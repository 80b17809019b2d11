// sdf/band.h: which lattice points lie near a mesh, found by OpenVDB; and quick access to what is stored
// there.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "sdf/sampled_field.h"
#include "sdf/triangle_bvh.h"

namespace sdf {

/// Leaves whose active samples lie within about `kBandVoxels` of a triangle, each with a near triangle (an
/// index into `triangles`; close to the closest). Distances are left at 0. Sorted by origin.
std::vector<FieldLeaf> find_band(const std::vector<Triangle>& triangles_voxels);

/// Looks up leaves by lattice coordinates.
class LeafMap {
public:
    explicit LeafMap(const std::vector<FieldLeaf>& leaves);

    /// The leaf that holds a sample, or nothing.
    const FieldLeaf* find(const glm::ivec3& sample) const {
        const glm::ivec3 leaf = (sample - first_) >> 3;
        if (leaf.x < 0 || leaf.y < 0 || leaf.z < 0 || leaf.x >= size_.x || leaf.y >= size_.y ||
            leaf.z >= size_.z) {
            return nullptr;
        }
        const std::int32_t number = table_[index(leaf)];
        return number >= 0 ? &leaves_[static_cast<std::size_t>(number)] : nullptr;
    }

    /// The active value at a sample, or nothing.
    const float* value(const glm::ivec3& sample) const {
        const FieldLeaf* leaf = find(sample);
        if (!leaf) return nullptr;
        const int i = offset_in_leaf(sample);
        return leaf->is_active(i) ? &leaf->distance[static_cast<std::size_t>(i)] : nullptr;
    }

    /// Trilinear value at a point in voxels; false where a corner is not active.
    bool interpolate(const glm::dvec3& point, double& result) const;

    static int offset_in_leaf(const glm::ivec3& sample) {
        return FieldLeaf::index(sample.x & 7, sample.y & 7, sample.z & 7);
    }

private:
    std::size_t index(const glm::ivec3& leaf) const {
        return (static_cast<std::size_t>(leaf.x) * size_.y + leaf.y) * size_.z + leaf.z;
    }

    const std::vector<FieldLeaf>& leaves_;
    glm::ivec3 first_{0};
    glm::ivec3 size_{0};
    std::vector<std::int32_t> table_;
};

}  // namespace sdf
