#include "core/scene/primitive_geometry.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "core/scene/tangent_space.h"

namespace core {

namespace {

glm::vec3 area_vector(const PrimitiveGeometry& geometry, const glm::uvec3& triangle) {
    const glm::dvec3 a(geometry.positions[triangle.x]);
    const glm::dvec3 cross = glm::cross(glm::dvec3(geometry.positions[triangle.y]) - a,
                                        glm::dvec3(geometry.positions[triangle.z]) - a);
    const double length = glm::length(cross);
    return length > 0.0 && std::isfinite(length) ? glm::vec3(cross / length) : glm::vec3(0.0f);
}

}  // namespace

bool is_finite(const glm::vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

std::vector<std::uint32_t> compact_vertices(std::vector<glm::uvec3>& triangles, std::size_t vertex_count) {
    std::vector<std::uint32_t> used;
    used.reserve(3 * triangles.size());
    for (const glm::uvec3& triangle : triangles) {
        used.insert(used.end(), {triangle.x, triangle.y, triangle.z});
    }
    const bool dense = vertex_count <= 4 * used.size();
    std::vector<std::uint32_t> new_of_old(dense ? vertex_count : 0, 0);
    if (dense) {
        for (const std::uint32_t vertex : used) new_of_old[vertex] = 1;
        used.clear();
        for (std::size_t old = 0; old < vertex_count; ++old) {
            if (new_of_old[old] == 0) continue;
            new_of_old[old] = static_cast<std::uint32_t>(used.size());
            used.push_back(static_cast<std::uint32_t>(old));
        }
    } else {
        std::sort(used.begin(), used.end());
        used.erase(std::unique(used.begin(), used.end()), used.end());
    }
    for (glm::uvec3& triangle : triangles) {
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t old = triangle[corner];
            triangle[corner] = dense ? new_of_old[old]
                                     : static_cast<std::uint32_t>(
                                           std::lower_bound(used.begin(), used.end(), old) - used.begin());
        }
    }
    return used;
}

void gather_vertices(PrimitiveGeometry& geometry, const std::vector<std::uint32_t>& source) {
    const auto gather = [&](auto& values) {
        if (values.empty()) return;
        std::remove_reference_t<decltype(values)> copied;
        copied.reserve(source.size());
        for (const std::uint32_t vertex : source) copied.push_back(values[vertex]);
        values = std::move(copied);
    };
    gather(geometry.positions);
    gather(geometry.normals);
    gather(geometry.tangents);
    for (auto& uvs : geometry.uvs) gather(uvs);
    gather(geometry.colors);
}

void make_flat_normals(PrimitiveGeometry& geometry) {
    std::vector<std::uint32_t> source;
    source.reserve(3 * geometry.triangles.size());
    for (glm::uvec3& triangle : geometry.triangles) {
        const auto first = static_cast<std::uint32_t>(source.size());
        source.insert(source.end(), {triangle.x, triangle.y, triangle.z});
        triangle = {first, first + 1, first + 2};
    }
    gather_vertices(geometry, source);
    geometry.normals.assign(source.size(), glm::vec3(0.0f, 0.0f, 1.0f));
    for (const glm::uvec3& triangle : geometry.triangles) {
        const glm::vec3 normal = area_vector(geometry, triangle);
        if (normal == glm::vec3(0.0f)) continue;
        for (int corner = 0; corner < 3; ++corner) geometry.normals[triangle[corner]] = normal;
    }
}

std::size_t mend_normals(PrimitiveGeometry& geometry) {
    std::vector<std::uint32_t> broken;
    for (std::size_t i = 0; i < geometry.normals.size(); ++i) {
        const glm::dvec3 normal(geometry.normals[i]);
        const double length = glm::length(normal);
        if (length > 0.0 && std::isfinite(length)) {
            geometry.normals[i] = glm::vec3(normal / length);
        } else {
            geometry.normals[i] = glm::vec3(0.0f);
            broken.push_back(static_cast<std::uint32_t>(i));
        }
    }
    if (broken.empty()) return 0;
    std::vector<glm::vec3> sums(geometry.normals.size(), glm::vec3(0.0f));
    for (const glm::uvec3& triangle : geometry.triangles) {
        const glm::vec3 face = area_vector(geometry, triangle);
        for (int corner = 0; corner < 3; ++corner) sums[triangle[corner]] += face;
    }
    for (const std::uint32_t vertex : broken) {
        const float length = glm::length(sums[vertex]);
        geometry.normals[vertex] = length > 0.0f ? sums[vertex] / length : glm::vec3(0.0f, 0.0f, 1.0f);
    }
    return broken.size();
}

void make_tangents(PrimitiveGeometry& geometry, std::size_t uv_set) {
    const std::vector<glm::vec2>& uvs = geometry.uvs[uv_set];
    const std::size_t vertex_count = geometry.positions.size();
    if (uvs.empty()) {
        for (const glm::vec3& normal : geometry.normals) geometry.tangents.push_back(any_tangent(normal));
        return;
    }
    const std::vector<glm::vec4> corners =
        corner_tangents(geometry.positions, geometry.normals, uvs, geometry.triangles);
    geometry.tangents.assign(vertex_count, glm::vec4(0.0f));
    std::vector<std::uint32_t> source(vertex_count);
    for (std::size_t i = 0; i < vertex_count; ++i) source[i] = static_cast<std::uint32_t>(i);
    std::vector<std::uint32_t> twin(vertex_count, 0);
    for (std::size_t t = 0; t < geometry.triangles.size(); ++t) {
        for (int corner = 0; corner < 3; ++corner) {
            std::uint32_t& vertex = geometry.triangles[t][corner];
            const glm::vec4& tangent = corners[3 * t + static_cast<std::size_t>(corner)];
            if (geometry.tangents[vertex].w == 0.0f) {
                geometry.tangents[vertex] = tangent;
            } else if (geometry.tangents[vertex].w != tangent.w) {
                if (twin[vertex] == 0) {
                    twin[vertex] = static_cast<std::uint32_t>(source.size());
                    source.push_back(vertex);
                    geometry.tangents.push_back(tangent);
                }
                vertex = twin[vertex];
            }
        }
    }
    if (source.size() == vertex_count) return;
    const std::vector<glm::vec4> tangents = std::exchange(geometry.tangents, {});
    gather_vertices(geometry, source);
    geometry.tangents = tangents;
}

void mend_tangents(PrimitiveGeometry& geometry) {
    for (std::size_t i = 0; i < geometry.tangents.size(); ++i) {
        glm::vec4& tangent = geometry.tangents[i];
        const glm::dvec3 direction(tangent);
        const double length = glm::length(direction);
        if (!(length > 0.0) || !std::isfinite(length)) {
            tangent = any_tangent(geometry.normals[i]);
            continue;
        }
        tangent = glm::vec4(glm::vec3(direction / length), tangent.w < 0.0f ? -1.0f : 1.0f);
    }
}

}  // namespace core
