// tests/core/scene/mesh_text.h: small mesh files made in a test, and what reading them says.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/support/error.h"

namespace tests {

inline std::vector<std::uint8_t> bytes_of(const std::string& text) {
    return {text.begin(), text.end()};
}

/// The message and kind of the InputError that a call ends in; "no error" if there is none.
template <typename Call>
std::string input_error_of(const Call& call) {
    try {
        call();
    } catch (const core::InputError& error) {
        return fmt::format("{} (kind {})", error.what(), static_cast<int>(error.kind()));
    }
    return "no error";
}

/// A unit cube, as its 8 corners and 6 faces in counter-clockwise order.
inline constexpr std::array<std::array<int, 3>, 8> kCubeCorners = {
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
inline constexpr std::array<std::array<int, 4>, 6> kCubeFaces = {
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 4, 7, 3}, {1, 2, 6, 5}}};

using Point = std::array<float, 3>;
using Triangle = std::array<Point, 3>;

/// All triangles by position, each from its smallest corner on, sorted.
inline std::vector<Triangle> triangles_of(const core::Scene& scene) {
    std::vector<Triangle> result;
    for (const core::Mesh& mesh : scene.meshes) {
        for (const glm::uvec3& indices : mesh.triangles) {
            Triangle& triangle = result.emplace_back();
            for (int i = 0; i < 3; ++i) {
                const glm::vec3& p = mesh.positions[indices[i]];
                triangle[static_cast<std::size_t>(i)] = {p.x, p.y, p.z};
            }
            std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
        }
    }
    std::sort(result.begin(), result.end());
    return result;
}

/// Whether every array of every mesh fits the others, as Scene promises.
inline bool is_consistent(const core::Scene& scene) {
    for (const core::Mesh& mesh : scene.meshes) {
        const std::size_t count = mesh.positions.size();
        const auto fits = [&](const auto& values) { return values.empty() || values.size() == count; };
        if (mesh.normals.size() != count || !fits(mesh.tangents) || !fits(mesh.colors) ||
            !fits(mesh.uvs[0]) || mesh.part_of_triangle.size() != mesh.triangles.size() ||
            mesh.bounds.empty()) {
            return false;
        }
        for (const glm::uvec3& t : mesh.triangles) {
            if (std::max({t.x, t.y, t.z}) >= count) return false;
        }
        for (const std::uint32_t part : mesh.part_of_triangle) {
            if (part >= mesh.parts.size()) return false;
        }
        for (const glm::vec3& normal : mesh.normals) {
            if (!(std::abs(glm::length(normal) - 1.0f) < 1e-5f)) return false;
        }
    }
    for (const core::Instance& instance : scene.instances) {
        if (instance.materials.size() != scene.meshes[instance.mesh].parts.size()) return false;
        for (const std::uint32_t material : instance.materials) {
            if (material >= scene.materials.size()) return false;
        }
    }
    return true;
}

std::string cube_obj();
std::string cube_ply_text();
std::string cube_ply_binary(bool big_endian);
std::string cube_stl_text();
std::string cube_stl_binary(const std::string& header = "");

}  // namespace tests
