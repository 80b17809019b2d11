// sdf/triangle_ray_tree.h: where a ray first meets the triangles of a mesh.
//
// Eight float boxes a node, rounded outwards, are tested at once; then four triangles at once in double, by
// the arithmetic of intersect(), so that hits are those of TriangleBvh::first_hit() to the last bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "sdf/box_tree.h"
#include "sdf/triangle_bvh.h"

namespace sdf {

/// Part of a ray in the space of a mesh.
struct RaySegment {
    glm::dvec3 origin{0.0};
    glm::dvec3 direction{0.0};  ///< Of any length but 0.
    double t_min = 0.0, t_max = 0.0;
};

enum class FirstOrAny : std::uint8_t { kFirst, kAny };

/// Triangles whose corners are single precision, as those of a mesh are.
class TriangleRayTree {
public:
    static constexpr std::size_t kBlockTriangles = 4;

    /// The triangles of a leaf, a column a component; those that a leaf lacks have no area.
    struct alignas(32) Block {
        float corner[3][3][kBlockTriangles];  ///< By corner and axis.
        std::uint32_t index[kBlockTriangles];
    };

    TriangleRayTree() = default;
    /// @param selection those that the tree holds, as indices into `triangles`; finite
    TriangleRayTree(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                    std::span<const std::uint32_t> selection);

    /// The first triangle that the ray meets in [t_min, t_max]; at equal t the lower index wins. With kAny,
    /// one of those that it meets.
    FirstHit hit(const RaySegment& ray, FirstOrAny which = FirstOrAny::kFirst) const;

    bool empty() const { return blocks_.empty(); }
    std::size_t bytes() const;
    /// What a tree over so many triangles takes at most, or little more: how many children there are under a
    /// node depends on where the triangles are.
    static std::size_t bytes_of(std::size_t triangle_count);

    // For the kernel.
    const BoxTree::Node* nodes() const { return nodes_.data(); }
    const Block* blocks() const { return blocks_.data(); }
    float reach() const { return reach_; }  ///< The largest coordinate of any corner.

private:
    std::vector<BoxTree::Node> nodes_;  ///< Children: node numbers, or ~block.
    std::vector<Block> blocks_;
    float reach_ = 0.0f;
};

/// A question to a tree, and its answer.
struct TriangleQuery {
    const TriangleRayTree* tree = nullptr;
    RaySegment ray;
    FirstOrAny which = FirstOrAny::kFirst;
    FirstHit hit;  ///< As of TriangleRayTree::hit().
};

/// Answers many queries, several at a time. Each answer depends on its own query alone, and is the same to
/// the last bit on every instruction set.
void hit_triangles(std::span<TriangleQuery> queries);

}  // namespace sdf
