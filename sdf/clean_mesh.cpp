#include "sdf/clean_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "core/support/parallel.h"
#include "sdf/surface_samples.h"
#include "sdf/winding_number.h"

namespace sdf {

namespace {

constexpr float kAbsurdCoordinate = 1e30f;

std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
    std::uint64_t h = (a ^ (b * 0x9e3779b97f4a7c15ull)) * 0xff51afd7ed558ccdull;
    return h ^ (h >> 32);
}

struct BitKey {
    std::array<std::uint32_t, 3> words;
    bool operator==(const BitKey&) const = default;
};
struct BitKeyHash {
    std::size_t operator()(const BitKey& key) const {
        return mix(mix(key.words[0], key.words[1]), key.words[2]);
    }
};

BitKey key_of(const glm::vec3& position) {
    // Adding 0 makes -0 and +0 one vertex.
    const glm::vec3 canonical = position + 0.0f;
    BitKey key{};
    std::memcpy(key.words.data(), &canonical, sizeof(key.words));
    return key;
}

bool is_usable(const glm::vec3& p) {
    return std::abs(p.x) <= kAbsurdCoordinate && std::abs(p.y) <= kAbsurdCoordinate &&
           std::abs(p.z) <= kAbsurdCoordinate;
}

bool has_area(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    // Positions are floats, so that collinear ones give exactly 0 in double or close to it.
    const double longest = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
    return glm::length(normal) > 1e-14 * longest;
}

}  // namespace

CleanMesh clean_mesh(const MeshView& mesh) {
    CleanMesh clean;
    std::unordered_map<BitKey, std::uint32_t, BitKeyHash> vertex_of_position;
    std::unordered_set<BitKey, BitKeyHash> faces;
    vertex_of_position.reserve(mesh.positions.size());
    // Six triangles share a vertex: each position is looked up once.
    constexpr std::uint32_t kNotYet = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> vertex_of_index(mesh.positions.size(), kNotYet);
    faces.reserve(mesh.triangles.size());
    for (std::uint32_t source = 0; source < mesh.triangles.size(); ++source) {
        const glm::uvec3& corners = mesh.triangles[source];
        const std::size_t count = mesh.positions.size();
        if (corners.x >= count || corners.y >= count || corners.z >= count) {
            ++clean.out_of_range_count;
            continue;
        }
        const glm::vec3 p[3] = {mesh.positions[corners.x], mesh.positions[corners.y],
                                mesh.positions[corners.z]};
        if (!is_usable(p[0]) || !is_usable(p[1]) || !is_usable(p[2])) {
            ++clean.not_finite_count;
            continue;
        }
        if (!has_area(p[0], p[1], p[2])) {
            ++clean.zero_area_count;
            continue;
        }
        glm::uvec3 welded;
        for (int i = 0; i < 3; ++i) {
            std::uint32_t& vertex = vertex_of_index[corners[i]];
            if (vertex == kNotYet) {
                const auto [entry, is_new] = vertex_of_position.try_emplace(
                    key_of(p[i]), static_cast<std::uint32_t>(clean.vertices.size()));
                if (is_new) clean.vertices.emplace_back(p[i]);
                vertex = entry->second;
            }
            welded[i] = vertex;
        }
        std::array<std::uint32_t, 3> sorted{welded.x, welded.y, welded.z};
        std::sort(sorted.begin(), sorted.end());
        if (!faces.insert({sorted}).second) {
            ++clean.duplicate_count;
            continue;
        }
        clean.triangles.push_back(welded);
        clean.source_triangle.push_back(source);
        for (const glm::vec3& position : p) clean.bounds.include(glm::dvec3(position));
    }
    return clean;
}

namespace {

/// Sets of vertices that grow together, with path halving.
class UnionFind {
public:
    explicit UnionFind(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0u); }

    std::uint32_t root(std::uint32_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::uint32_t a, std::uint32_t b) {
        a = root(a);
        b = root(b);
        if (a != b) parent_[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<std::uint32_t> parent_;
};

bool every_edge_balances(const CleanMesh& mesh, const std::vector<std::uint32_t>& triangles) {
    std::unordered_map<std::uint64_t, int> balance;
    balance.reserve(triangles.size() * 2);
    for (const std::uint32_t triangle : triangles) {
        const glm::uvec3& corners = mesh.triangles[triangle];
        for (int i = 0; i < 3; ++i) {
            const std::uint64_t from = corners[i], to = corners[(i + 1) % 3];
            balance[std::min(from, to) << 32 | std::max(from, to)] += from < to ? 1 : -1;
        }
    }
    return std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; });
}

/// An open component is a solid with holes if, nearly everywhere, one side is clearly wound round and the
/// other clearly not. A bare |w| >= 0.5 would do for flat sheets only: any bulge lifts one side of an open
/// sheet above it, and the cap that closes such a "solid" then hugs the sheet itself. Hence the margin.
bool encloses_volume(const std::vector<Triangle>& triangles) {
    constexpr double kOffsetVoxels = 0.25, kMargin = 0.15, kNeeded = 0.9;
    constexpr std::size_t kMostSamples = 256, kFewTriangles = 256;
    const std::size_t count = std::min(kMostSamples, 16 + 4 * triangles.size());
    const SurfaceSamples samples(triangles, count);

    std::vector<std::uint32_t> all(triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    const TriangleBvh tree(triangles, all);
    const WindingNumber fast(tree);
    const double beta = triangles.size() <= kFewTriangles ? std::numeric_limits<double>::infinity() : 2.0;
    std::size_t clear = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const SurfaceSample sample = samples.at(i);
        const double front = std::abs(fast.at(sample.position + kOffsetVoxels * sample.normal, beta));
        const double back = std::abs(fast.at(sample.position - kOffsetVoxels * sample.normal, beta));
        if (std::min(front, back) < 0.5 - kMargin && std::max(front, back) >= 0.5 + kMargin) ++clear;
    }
    return static_cast<double>(clear) >= kNeeded * static_cast<double>(count);
}

}  // namespace

std::vector<Component> classify_components(const CleanMesh& mesh, const std::vector<Triangle>& corners,
                                           ClassOverride override_class) {
    UnionFind sets(mesh.vertices.size());
    for (const glm::uvec3& triangle : mesh.triangles) {
        sets.join(triangle.x, triangle.y);
        sets.join(triangle.x, triangle.z);
    }
    std::vector<Component> components;
    std::unordered_map<std::uint32_t, std::size_t> component_of_root;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto [entry, is_new] =
            component_of_root.try_emplace(sets.root(mesh.triangles[i].x), components.size());
        if (is_new) components.emplace_back();
        components[entry->second].triangles.push_back(i);
    }
    core::parallel_for(components.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Component& component = components[i];
            component.is_closed = every_edge_balances(mesh, component.triangles);
            std::vector<Triangle> own;
            own.reserve(component.triangles.size());
            double volume = 0.0;
            for (const std::uint32_t triangle : component.triangles) {
                own.push_back(corners[triangle]);
                volume += glm::dot(own.back().a, glm::cross(own.back().b, own.back().c));
            }
            component.is_inverted = volume < 0.0;
            switch (override_class) {
                case ClassOverride::kSolid:
                    component.is_sheet = false;
                    break;
                case ClassOverride::kSheet:
                    component.is_sheet = true;
                    break;
                case ClassOverride::kAuto:
                    component.is_sheet = !component.is_closed && !encloses_volume(own);
                    break;
            }
        }
    });
    return components;
}

}  // namespace sdf
