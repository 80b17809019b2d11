#include "core/trace/placed_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace core {
namespace {

/// Half an ulp of 1.
constexpr float kUnitRoundoff = 0x1p-24f;

/// Rounding errors that an offset allows for, in units of kUnitRoundoff times the magnitudes that were added
/// up: change of space (a sum of four products, once for the ray that found the hit and once for the one that
/// leaves it), plane distance, and the rounding of the position. Worst cases rarely add up: of 3.7e6 bounces
/// over scales 1e-3 to 1e5 one met its own surface at 1.5 and none did at 2.
constexpr float kRoundingCount = 5.0f;

/// Coordinates beyond 2^+-this may overflow or underflow when a kernel multiplies four of them.
constexpr int kLargestExponent = 24;

/// World coordinates, seen from local space, may be this many times larger than any extent of a flattened
/// mesh: rounding them to floats then moves a vertex by under 1.3e-4 of the mesh's thickness.
constexpr double kLargestFlattenedDistance = 2048.0;

double largest_component(const glm::dvec3& v) {
    return std::max({v.x, v.y, v.z});
}

glm::dvec3 largest_magnitude(const DoubleBounds& bounds) {
    return bounds.empty() ? glm::dvec3(0.0) : glm::max(glm::abs(bounds.minimum), glm::abs(bounds.maximum));
}

glm::dmat3 absolute(const glm::dmat3& m) {
    return {glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])};
}

DoubleBounds local_box(const Mesh& mesh) {
    DoubleBounds box;
    box.include(glm::dvec3(mesh.bounds.minimum));
    box.include(glm::dvec3(mesh.bounds.maximum));
    return box;
}

/// The power of two that takes coordinates near 1, or 0 where they are tame already.
int taming_exponent(const glm::dvec3& magnitude) {
    const double largest = largest_component(magnitude);
    if (!(largest > 0.0)) return 0;
    const int exponent = std::ilogb(largest);
    return std::abs(exponent) > kLargestExponent ? -exponent : 0;
}

/// Not normalised; exactly zero for collinear corners, and for corners that are not finite.
glm::dvec3 area_normal(const std::vector<glm::vec3>& vertices, const glm::uvec3& triangle) {
    const glm::dvec3 a(vertices[triangle.x]);
    const glm::dvec3 normal =
        glm::cross(glm::dvec3(vertices[triangle.y]) - a, glm::dvec3(vertices[triangle.z]) - a);
    const double length = glm::length(normal);
    return length > 0.0 && std::isfinite(length) ? normal : glm::dvec3(0.0);
}

template <typename Map>
TriangleSoup make_soup(const Mesh& mesh, const Map& map, const glm::dmat3& normal_map) {
    TriangleSoup soup;
    soup.vertices.reserve(mesh.positions.size() + 2);
    for (const glm::vec3& position : mesh.positions) soup.vertices.push_back(map(glm::dvec3(position)));
    soup.triangles = mesh.triangles;
    soup.normals.reserve(mesh.triangles.size());
    for (glm::uvec3& triangle : soup.triangles) {
        // From the mesh's own vertices: mapped ones are rounded once more.
        const glm::dvec3 normal = normal_map * area_normal(mesh.positions, triangle);
        const bool has_area =
            normal != glm::dvec3(0.0) && area_normal(soup.vertices, triangle) != glm::dvec3(0.0);
        soup.normals.push_back(has_area ? glm::vec3(glm::normalize(normal)) : glm::vec3(0.0f));
        if (!has_area) triangle = glm::uvec3(triangle.x);
    }
    soup.vertices.resize(soup.vertices.size() + 2, glm::vec3(0.0f));
    return soup;
}

}  // namespace

std::size_t TriangleSoup::bytes() const {
    return (vertices.size() + normals.size()) * sizeof(glm::vec3) + triangles.size() * sizeof(glm::uvec3);
}

bool survives_flattening(const Mesh& mesh, const Instance& instance) {
    const DoubleBounds box = transformed(local_box(mesh), instance.world_from_local);
    const glm::dvec3 magnitude = largest_magnitude(box);
    if (taming_exponent(magnitude) != 0 || taming_exponent(box.extent()) != 0) return false;
    const glm::dvec3 reach = absolute(glm::dmat3(instance.local_from_world)) * magnitude;
    const glm::dvec3 extent(mesh.bounds.extent());
    for (int axis = 0; axis < 3; ++axis) {
        // A mesh that is exactly flat has no thickness to lose.
        if (extent[axis] > 0.0 && reach[axis] > kLargestFlattenedDistance * extent[axis]) return false;
    }
    return true;
}

TriangleSoup flattened_soup(const Mesh& mesh, const Instance& instance) {
    const auto to_world = [&](const glm::dvec3& position) {
        return glm::vec3(instance.world_from_local * glm::dvec4(position, 1.0));
    };
    return make_soup(mesh, to_world, glm::transpose(glm::dmat3(instance.local_from_world)));
}

PlacedMesh place_flattened(const TriangleSoup& soup, const Mesh& mesh, const Instance& instance) {
    const glm::dvec3 magnitude = largest_magnitude(transformed(local_box(mesh), instance.world_from_local));
    PlacedMesh placed;
    placed.local_magnitude = glm::vec3(magnitude);
    placed.normals = soup.normals.data();
    // A point that is exact on the mesh meets vertices and an origin that are each rounded once.
    placed.start_offset = static_cast<float>(kRoundingCount * kUnitRoundoff * 3.0 * glm::length(magnitude));
    return placed;
}

SharedSoup shared_soup(const Mesh& mesh) {
    SharedSoup soup;
    soup.factor = std::ldexp(1.0, taming_exponent(largest_magnitude(local_box(mesh))));
    const auto tame = [&](const glm::dvec3& position) { return glm::vec3(soup.factor * position); };
    soup.triangles = make_soup(mesh, tame, glm::dmat3(1.0));
    return soup;
}

glm::dmat4 world_from_soup(const SharedSoup& soup, const Instance& instance) {
    glm::dmat4 result = instance.world_from_local;
    for (int column = 0; column < 3; ++column) result[column] /= soup.factor;
    return result;
}

Stretch stretch_of(const SharedSoup& soup, const Instance& instance) {
    const auto longest_column = [](const glm::dmat3& m) {
        return std::max({glm::length(m[0]), glm::length(m[1]), glm::length(m[2])});
    };
    return {longest_column(glm::dmat3(world_from_soup(soup, instance))),
            longest_column(soup.factor * glm::dmat3(instance.local_from_world))};
}

PlacedMesh place_shared(const SharedSoup& soup, const Mesh& mesh, const Instance& instance) {
    const DoubleBounds box = local_box(mesh);
    const glm::dmat3 linear = soup.factor * glm::dmat3(instance.local_from_world);
    const glm::dmat3 size = absolute(linear);
    const glm::dvec3 magnitude =
        soup.factor * (glm::abs(glm::dvec3(instance.local_from_world[3])) + largest_magnitude(box));
    const double common =
        1.0 / std::max({largest_component(size[0]), largest_component(size[1]), largest_component(size[2])});
    const glm::dvec3 world = largest_magnitude(transformed(box, instance.world_from_local));

    PlacedMesh placed;
    placed.normal_from_local = glm::mat3(common * glm::transpose(linear));
    placed.magnitude_from_world = glm::mat3(common * size);
    placed.local_magnitude = glm::vec3(common * magnitude);
    placed.normals = soup.triangles.normals.data();
    // There and back, as a kernel's float matrix and its inverse round it.
    const glm::dvec3 rounding =
        absolute(glm::dmat3(world_from_soup(soup, instance))) * (size * world + magnitude);
    placed.start_offset =
        static_cast<float>(kRoundingCount * kUnitRoundoff * glm::length(2.0 * world + rounding));
    return placed;
}

void finish_hit(const PlacedMesh& placed, const RayStream& rays, std::size_t i, HitStream& hits) {
    const glm::vec3 origin(rays.origin_x[i], rays.origin_y[i], rays.origin_z[i]);
    const glm::vec3 direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);

    const glm::vec3 local_normal = placed.normals[hits.triangle[i]];
    const glm::dvec3 scaled(placed.normal_from_local * local_normal);
    const double inverse_length = 1.0 / std::sqrt(glm::dot(scaled, scaled));
    glm::vec3 normal(scaled * inverse_length);
    const bool front = glm::dot(normal, direction) <= 0.0f;
    if (!front) normal = -normal;

    // Rounding along the normal: of the sums in the soup's space, carried to the world, and of the position.
    const glm::vec3 reach = glm::abs(origin) + hits.t[i] * glm::abs(direction);
    const glm::vec3 local_reach = placed.magnitude_from_world * reach + placed.local_magnitude;
    const float magnitude =
        glm::dot(glm::abs(local_normal), local_reach) * static_cast<float>(inverse_length) +
        glm::dot(glm::abs(normal), reach);

    hits.normal_x[i] = normal.x;
    hits.normal_y[i] = normal.y;
    hits.normal_z[i] = normal.z;
    hits.front[i] = front ? 1 : 0;
    hits.offset[i] = kRoundingCount * kUnitRoundoff * magnitude;
}

}  // namespace core
