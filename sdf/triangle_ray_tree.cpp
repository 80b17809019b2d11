#include "sdf/triangle_ray_tree.h"

#include <algorithm>
#include <cmath>

namespace sdf {

TriangleRayTree::TriangleRayTree(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                                 std::span<const std::uint32_t> selection) {
    std::vector<core::DoubleBounds> boxes(triangles.size());
    for (const std::uint32_t index : selection) {
        for (int corner = 0; corner < 3; ++corner) {
            const glm::vec3& position = positions[triangles[index][corner]];
            boxes[index].include(glm::dvec3(position));
            for (int axis = 0; axis < 3; ++axis) reach_ = std::max(reach_, std::abs(position[axis]));
        }
    }
    BoxTree tree(boxes, {selection.begin(), selection.end()}, kBlockTriangles);
    nodes_ = std::move(tree.nodes);
    blocks_.resize((tree.order.size() + kBlockTriangles - 1) / kBlockTriangles, Block{});
    for (std::size_t i = 0; i < tree.order.size(); ++i) {
        const std::uint32_t index = tree.order[i];
        Block& block = blocks_[i / kBlockTriangles];
        const std::size_t place = i % kBlockTriangles;
        block.index[place] = index;
        for (int corner = 0; corner < 3; ++corner) {
            const glm::vec3& position = positions[triangles[index][corner]];
            for (int axis = 0; axis < 3; ++axis) block.corner[corner][axis][place] = position[axis];
        }
    }
}

FirstHit TriangleRayTree::hit(const RaySegment& ray, FirstOrAny which) const {
    TriangleQuery query{this, ray, which, {}};
    hit_triangles(std::span(&query, 1));
    return query.hit;
}

std::size_t TriangleRayTree::bytes() const {
    return nodes_.capacity() * sizeof(BoxTree::Node) + blocks_.capacity() * sizeof(Block);
}

std::size_t TriangleRayTree::bytes_of(std::size_t triangle_count) {
    const std::size_t block_count = (triangle_count + kBlockTriangles - 1) / kBlockTriangles;
    return block_count * sizeof(Block) + (block_count / 3 + 1) * sizeof(BoxTree::Node);
}

}  // namespace sdf
