// core/scene/polygon.h: polygons to triangles.
//
// Ear clipping after G. H. Meisters, "Polygons have ears", 1975: corners whose triangle holds no other corner
// are cut off one by one, in the plane of the polygon's area vector (M. E. Newell's). Where we differ: a
// polygon that its first corner sees wholly, as every convex one, becomes a fan without a search.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

namespace core {

/// Splits the polygons of one file, and counts what they take: searching ears takes time quadratic in the
/// number of corners, and one byte of a file may become a triangle with vertices of its own. Both are
/// limited, by what no real file of the size needs.
class PolygonSplitter {
public:
    explicit PolygonSplitter(std::size_t file_byte_count);

    /// Sets `triangles` to corners.size() - 2 triangles that cover a simple polygon, concave ones too, wound
    /// as it is; corners are numbered from 0. Polygons that cross themselves or have no area are covered
    /// somehow. False beyond the limits, as limits() says. @pre corners are at least 3, and finite
    bool split(std::span<const glm::vec3> corners, std::vector<glm::uvec3>& triangles);

    /// Counts triangles before they are stored. False beyond the limit.
    bool charge_triangles(std::uint64_t count);

    /// For messages: what was exceeded and what to do.
    std::string limits() const;

private:
    std::uint64_t steps_left_;
    std::uint64_t bytes_left_;
    std::size_t file_byte_count_;
};

}  // namespace core
