#include "sdf/thin_walls.h"

#include <algorithm>
#include <cmath>

#include "core/support/parallel.h"

namespace sdf {

namespace {

/// Edges of the pieces that triangles are cut into, in voxels.
constexpr double kPieceEdge = 1.0;

/// Sides are parallel up to 15 degrees.
constexpr double kParallelCosine = 0.966;

/// The middle of a wall must be this far inside, in voxels. A field that only just shows the wall here may
/// miss it half a voxel away.
constexpr double kNeededDepth = 0.1;

/// A value of the field, in voxels, that a wall of kSafeThickness has at its middle.
constexpr double kClearlyInside = 0.9;

/// Where a piece's outer side is asked for, in voxels off it: inside there, it lies within another solid and
/// bounds nothing.
constexpr double kOutside = 1e-3;

struct Piece {
    Triangle triangle;
    double thickness = 0.0;
    bool is_wall = false;  ///< The other side is parallel.

    glm::dvec3 center() const { return (triangle.a + triangle.b + triangle.c) / 3.0; }
};

void cut(const Triangle& triangle, std::vector<Piece>& pieces) {
    const double ab = glm::distance(triangle.a, triangle.b), bc = glm::distance(triangle.b, triangle.c),
                 ca = glm::distance(triangle.c, triangle.a);
    const double longest = std::max({ab, bc, ca});
    if (longest <= kPieceEdge) {
        pieces.push_back({triangle});
        return;
    }
    // Halving the longest edge keeps slivers from multiplying their thin side.
    const glm::dvec3 &a = triangle.a, &b = triangle.b, &c = triangle.c;
    if (longest == ab) {
        const glm::dvec3 middle = 0.5 * (a + b);
        cut({a, middle, c}, pieces);
        cut({middle, b, c}, pieces);
    } else if (longest == bc) {
        const glm::dvec3 middle = 0.5 * (b + c);
        cut({a, b, middle}, pieces);
        cut({a, middle, c}, pieces);
    } else {
        const glm::dvec3 middle = 0.5 * (c + a);
        cut({a, b, middle}, pieces);
        cut({middle, b, c}, pieces);
    }
}

/// A lid farther than this from every triangle, in voxels, is none for a ray.
constexpr double kNearLid = 2.5;

/// Adds the triangles next to an edge of the lattice that a lid crosses: whose ends lie on different sides
/// though they are farther from the solid's surface than a surface between them can be.
void add_lid(const std::vector<std::uint8_t>& is_sheet, const FieldLeaf& leaf, int i, const FieldLeaf& other,
             int j, std::vector<std::uint32_t>& rims) {
    constexpr double kSpacing = 1.0 + 1e-3;
    const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
    const double here = leaf.distance[a], there = other.distance[b];
    if ((here < 0.0) == (there < 0.0)) return;
    const auto solid_distance = [&](double value, std::int32_t triangle) {
        return triangle < 0 || is_sheet[static_cast<std::size_t>(triangle)] ? 0.0 : std::abs(value);
    };
    const double near = solid_distance(here, leaf.triangle[a]),
                 far = solid_distance(there, other.triangle[b]);
    if (near + far <= kSpacing) return;
    if (near > 0.0 && near < kNearLid) rims.push_back(static_cast<std::uint32_t>(leaf.triangle[a]));
    if (far > 0.0 && far < kNearLid) rims.push_back(static_cast<std::uint32_t>(other.triangle[b]));
}

}  // namespace

ThinWalls find_thin_walls(const std::vector<Triangle>& corners, const std::vector<Component>& components,
                          const TriangleBvh& solids, const WindingNumber& winding, const LeafMap& field) {
    std::vector<std::uint32_t> solid_triangles;
    std::vector<std::uint8_t> inverted;
    for (const Component& component : components) {
        if (component.is_sheet) continue;
        for (const std::uint32_t triangle : component.triangles) {
            solid_triangles.push_back(triangle);
            inverted.push_back(component.is_inverted);
        }
    }
    std::vector<std::vector<Piece>> missing(solid_triangles.size());
    std::vector<double> area(solid_triangles.size());
    core::parallel_for(solid_triangles.size(), 64, [&](std::size_t begin, std::size_t end) {
        std::vector<Piece> pieces;
        for (std::size_t i = begin; i < end; ++i) {
            const Triangle& triangle = corners[solid_triangles[i]];
            const glm::dvec3 scaled = triangle.scaled_normal();
            area[i] = 0.5 * glm::length(scaled);
            // An area that the mesh's own unit could still hold may vanish beside the extent of the rest.
            if (!(area[i] > 0.0)) continue;
            const glm::dvec3 inward = (inverted[i] ? 1.0 : -1.0) * glm::normalize(scaled);
            pieces.clear();
            cut(triangle, pieces);
            for (Piece& piece : pieces) {
                const glm::dvec3 center = piece.center();
                // A voxel below the surface and still a voxel from any: thick, without asking further.
                double depth = 0.0;
                if (field.interpolate(center + inward, depth) && depth < -kClearlyInside) continue;
                FirstHit other = solids.first_hit(center, inward, 1e-9, kSafeThickness);
                // What lies within another solid is no end of the wall.
                while (other.t < kSafeThickness &&
                       winding.is_inside(center + (other.t + kOutside) * inward)) {
                    other = solids.first_hit(center, inward, other.t + kOutside, kSafeThickness);
                }
                piece.thickness = other.t;
                if (!(piece.thickness < kSafeThickness)) continue;
                const glm::dvec3 facing = glm::normalize(corners[other.triangle].scaled_normal());
                piece.is_wall = std::abs(glm::dot(facing, inward)) > kParallelCosine;
                if (!field.interpolate(center + 0.5 * piece.thickness * inward, depth)) continue;
                if (depth > -std::min(kNeededDepth, 0.25 * piece.thickness) &&
                    !winding.is_inside(center - kOutside * inward)) {
                    missing[i].push_back(piece);
                }
            }
        }
    });

    ThinWalls result;
    std::vector<double> thicknesses;
    double total_area = 0.0, wall_area = 0.0, edge_area = 0.0;
    result.walls.thinnest = kSafeThickness;
    for (std::size_t i = 0; i < missing.size(); ++i) {
        total_area += area[i];
        for (const Piece& piece : missing[i]) {
            result.pieces.push_back(piece.triangle);
            result.triangle_of_piece.push_back(solid_triangles[i]);
            const double piece_area = 0.5 * glm::length(piece.triangle.scaled_normal());
            (piece.is_wall ? wall_area : edge_area) += piece_area;
            if (!piece.is_wall) continue;
            thicknesses.push_back(piece.thickness);
            if (piece.thickness < result.walls.thinnest) {
                result.walls.thinnest = piece.thickness;
                result.walls.thinnest_at = piece.center();
            }
        }
    }
    if (!thicknesses.empty()) {
        const auto tenth = thicknesses.begin() + static_cast<std::ptrdiff_t>(thicknesses.size() / 10);
        std::nth_element(thicknesses.begin(), tenth, thicknesses.end());
        result.walls.tenth_percentile = *tenth;
    }
    if (total_area > 0.0) {
        result.walls.area_fraction = wall_area / total_area;
        result.edge_area_fraction = edge_area / total_area;
    }
    return result;
}

std::vector<std::uint32_t> find_rims(const std::vector<std::uint8_t>& is_sheet,
                                     const std::vector<FieldLeaf>& leaves) {
    const LeafMap map(leaves);
    std::vector<std::vector<std::uint32_t>> found(leaves.size());
    core::parallel_for(leaves.size(), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t number = begin; number < end; ++number) {
            const FieldLeaf& leaf = leaves[number];
            for (int i = 0; i < kLeafSize; ++i) {
                if (!leaf.is_active(i)) continue;
                const glm::ivec3 position = leaf.origin + glm::ivec3(i / 64, i / 8 % 8, i % 8);
                for (int axis = 0; axis < 3; ++axis) {
                    glm::ivec3 next = position;
                    ++next[axis];
                    const FieldLeaf* other = map.find(next);
                    const int j = LeafMap::offset_in_leaf(next);
                    if (other && other->is_active(j)) add_lid(is_sheet, leaf, i, *other, j, found[number]);
                }
            }
        }
    });
    std::vector<std::uint32_t> rims;
    for (const auto& of_leaf : found) rims.insert(rims.end(), of_leaf.begin(), of_leaf.end());
    std::sort(rims.begin(), rims.end());
    rims.erase(std::unique(rims.begin(), rims.end()), rims.end());
    return rims;
}

void add_pieces(const std::vector<Triangle>& corners, const std::vector<std::uint32_t>& triangles,
                ThinWalls& walls) {
    std::vector<Piece> pieces;
    for (const std::uint32_t triangle : triangles) {
        pieces.clear();
        cut(corners[triangle], pieces);
        for (const Piece& piece : pieces) walls.pieces.push_back(piece.triangle);
        walls.triangle_of_piece.insert(walls.triangle_of_piece.end(), pieces.size(), triangle);
    }
}

}  // namespace sdf
