#include "core/scene/tangent_space.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <unordered_map>

namespace core {

namespace {

/// A vertex by value, so that copies of it in a file count as one.
struct VertexKey {
    std::array<std::uint32_t, 8> bits;
    bool operator==(const VertexKey&) const = default;
};

struct VertexKeyHash {
    std::size_t operator()(const VertexKey& key) const {
        std::uint64_t hash = 0x9e3779b97f4a7c15u;
        for (const std::uint32_t word : key.bits) {
            hash = (hash ^ word) * 0xff51afd7ed558ccdu;
            hash ^= hash >> 32;
        }
        return static_cast<std::size_t>(hash);
    }
};

VertexKey make_key(const glm::vec3& position, const glm::vec3& normal, const glm::vec2& uv) {
    const float values[8] = {position.x, position.y, position.z, normal.x, normal.y, normal.z, uv.x, uv.y};
    VertexKey key;
    // Adding 0 turns -0 into 0.
    for (std::size_t i = 0; i < 8; ++i) key.bits[i] = std::bit_cast<std::uint32_t>(values[i] + 0.0f);
    return key;
}

std::vector<std::uint32_t> weld(std::span<const glm::vec3> positions, std::span<const glm::vec3> normals,
                                std::span<const glm::vec2> uvs) {
    std::unordered_map<VertexKey, std::uint32_t, VertexKeyHash> groups;
    groups.reserve(positions.size());
    std::vector<std::uint32_t> group_of_vertex(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        const auto next = static_cast<std::uint32_t>(groups.size());
        group_of_vertex[i] =
            groups.try_emplace(make_key(positions[i], normals[i], uvs[i]), next).first->second;
    }
    return group_of_vertex;
}

glm::dvec3 projected(const glm::dvec3& vector, const glm::dvec3& normal) {
    return vector - glm::dot(vector, normal) * normal;
}

/// Zero where there is no direction.
glm::dvec3 normalized_or_zero(const glm::dvec3& vector) {
    const double length = glm::length(vector);
    return length > 0.0 && std::isfinite(length) ? vector / length : glm::dvec3(0.0);
}

/// The direction in which u grows over a triangle, and on which side v decreases.
struct FaceTangent {
    glm::dvec3 direction{0.0};
    int side = 0;  ///< 0: right-handed, 1: mirrored, -1: the texture coordinates span no area.
};

FaceTangent face_tangent(const glm::dvec3& edge1, const glm::dvec3& edge2, const glm::dvec2& uv1,
                         const glm::dvec2& uv2) {
    // v is measured downwards in glTF, so up in the picture is -v.
    const double area = -(uv1.x * uv2.y - uv2.x * uv1.y);
    FaceTangent result;
    result.side = area > 0.0 ? 0 : (area < 0.0 ? 1 : -1);
    const glm::dvec3 direction = uv1.y * edge2 - uv2.y * edge1;
    result.direction = normalized_or_zero(result.side == 0 ? direction : -direction);
    if (result.direction == glm::dvec3(0.0)) result.side = -1;
    return result;
}

}  // namespace

glm::vec4 any_tangent(const glm::vec3& normal) {
    const glm::vec3 axis =
        std::abs(normal.x) < 0.7f ? glm::vec3(1.0f, 0.0f, 0.0f) : glm::vec3(0.0f, 1.0f, 0.0f);
    return {glm::normalize(axis - glm::dot(axis, normal) * normal), 1.0f};
}

std::vector<glm::vec4> corner_tangents(std::span<const glm::vec3> positions,
                                       std::span<const glm::vec3> normals, std::span<const glm::vec2> uvs,
                                       std::span<const glm::uvec3> triangles) {
    const std::vector<std::uint32_t> group_of_vertex = weld(positions, normals, uvs);
    // Two sums a group: right-handed faces and mirrored ones.
    std::vector<std::array<glm::dvec3, 2>> sums(positions.size(), {glm::dvec3(0.0), glm::dvec3(0.0)});
    std::vector<int> side_of_triangle(triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        glm::dvec3 p[3];
        glm::dvec2 uv[3];
        for (int c = 0; c < 3; ++c) {
            p[c] = glm::dvec3(positions[triangles[t][c]]);
            uv[c] = glm::dvec2(uvs[triangles[t][c]]);
        }
        const FaceTangent face = face_tangent(p[1] - p[0], p[2] - p[0], uv[1] - uv[0], uv[2] - uv[0]);
        side_of_triangle[t] = face.side;
        if (face.side < 0) continue;
        for (int c = 0; c < 3; ++c) {
            const std::uint32_t vertex = triangles[t][c];
            const glm::dvec3 normal(normals[vertex]);
            const glm::dvec3 to_next = normalized_or_zero(projected(p[(c + 1) % 3] - p[c], normal));
            const glm::dvec3 to_previous = normalized_or_zero(projected(p[(c + 2) % 3] - p[c], normal));
            const double angle = std::acos(glm::clamp(glm::dot(to_next, to_previous), -1.0, 1.0));
            const glm::dvec3 tangent = normalized_or_zero(projected(face.direction, normal));
            sums[group_of_vertex[vertex]][static_cast<std::size_t>(face.side)] += angle * tangent;
        }
    }
    std::vector<glm::vec4> result(3 * triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        for (int c = 0; c < 3; ++c) {
            const std::uint32_t vertex = triangles[t][c];
            const auto& sum = sums[group_of_vertex[vertex]];
            // A face without texture area borrows from its neighbours.
            int side = side_of_triangle[t];
            if (side < 0) side = glm::length(sum[0]) > 0.0 ? 0 : 1;
            const glm::dvec3 tangent = normalized_or_zero(
                projected(sum[static_cast<std::size_t>(side)], glm::dvec3(normals[vertex])));
            result[3 * t + static_cast<std::size_t>(c)] =
                tangent == glm::dvec3(0.0) ? any_tangent(normals[vertex])
                                           : glm::vec4(glm::vec3(tangent), side == 0 ? 1.0f : -1.0f);
        }
    }
    return result;
}

}  // namespace core
