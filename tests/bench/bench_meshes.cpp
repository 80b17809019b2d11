#include "tests/bench/bench_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/support/error.h"
#include "tests/support/analytic_scenes.h"

namespace tests {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Meshes of one part, one after the other.
struct MeshList {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::uvec3> triangles;

    void add(const core::Mesh& mesh, const glm::dmat4& matrix) {
        const core::Mesh placed = moved(mesh, matrix);
        const auto base = static_cast<unsigned>(positions.size());
        positions.insert(positions.end(), placed.positions.begin(), placed.positions.end());
        normals.insert(normals.end(), placed.normals.begin(), placed.normals.end());
        for (const glm::uvec3& triangle : placed.triangles) triangles.push_back(triangle + base);
    }
};

/// Area-weighted vertex normals.
std::vector<glm::vec3> smooth_normals(const std::vector<glm::vec3>& positions,
                                      const std::vector<glm::uvec3>& triangles) {
    std::vector<glm::dvec3> sums(positions.size(), glm::dvec3(0.0));
    for (const glm::uvec3& t : triangles) {
        const glm::dvec3 a(positions[t.x]);
        const glm::dvec3 normal = glm::cross(glm::dvec3(positions[t.y]) - a, glm::dvec3(positions[t.z]) - a);
        for (int corner = 0; corner < 3; ++corner) sums[t[corner]] += normal;
    }
    std::vector<glm::vec3> normals;
    normals.reserve(sums.size());
    for (const glm::dvec3& sum : sums) normals.emplace_back(glm::normalize(sum));
    return normals;
}

core::Mesh finished(std::string name, std::vector<glm::vec3> positions, std::vector<glm::uvec3> triangles) {
    std::vector<glm::vec3> normals = smooth_normals(positions, triangles);
    return make_mesh(std::move(name), std::move(positions), std::move(normals), {}, std::move(triangles));
}

/// Rings of points joined to a tube with a point at either end: `ring(i, j)` is point j of ring i, in the
/// order that winds outwards when seen along the rings.
template <typename Ring>
core::Mesh capped_tube(const char* name, int ring_count, int side_count, const glm::dvec3& first_cap,
                       const glm::dvec3& last_cap, const Ring& ring) {
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    for (int i = 0; i < ring_count; ++i) {
        for (int j = 0; j < side_count; ++j) positions.emplace_back(ring(i, j));
    }
    const auto at = [&](int i, int j) { return static_cast<unsigned>(i * side_count + j % side_count); };
    const auto first = static_cast<unsigned>(positions.size()), last = first + 1;
    positions.emplace_back(first_cap);
    positions.emplace_back(last_cap);
    for (int j = 0; j < side_count; ++j) {
        for (int i = 0; i + 1 < ring_count; ++i) {
            triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
            triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
        triangles.emplace_back(first, at(0, j), at(0, j + 1));
        triangles.emplace_back(last, at(ring_count - 1, j + 1), at(ring_count - 1, j));
    }
    return finished(name, std::move(positions), std::move(triangles));
}

/// A fluted column on a base and under a capital, from y = 0 to `height`.
core::Mesh column_mesh(double radius, double height) {
    constexpr int kRings = 24, kSides = 48, kFlutes = 12;
    const auto ring = [&](int i, int j) {
        const double y = double(i) / (kRings - 1);
        const double angle = 2.0 * kPi * j / kSides;
        // Thicker towards both ends, fluted between them.
        const double end = std::pow(std::abs(2.0 * y - 1.0), 6.0);
        const double flute = (1.0 - end) * 0.1 * std::cos(kFlutes * angle);
        const double r = radius * (1.0 + 0.5 * end + flute);
        return glm::dvec3(r * std::cos(angle), y * height, r * std::sin(angle));
    };
    return capped_tube("column", kRings, kSides, glm::dvec3(0.0), glm::dvec3(0.0, height, 0.0), ring);
}

/// Half a torus over the x axis: from (-radius, 0, 0) up to (0, radius, 0) and down again.
core::Mesh arch_mesh(double radius, double thickness) {
    constexpr int kRings = 25, kSides = 12;
    const auto ring = [&](int i, int j) {
        const double along = kPi * (1.0 - double(i) / (kRings - 1)), round = -2.0 * kPi * j / kSides;
        const glm::dvec3 outwards(std::cos(along), std::sin(along), 0.0);
        return outwards * (radius + thickness * std::cos(round)) +
               glm::dvec3(0.0, 0.0, thickness * std::sin(round));
    };
    return capped_tube("arch", kRings, kSides, glm::dvec3(-radius, 0.0, 0.0), glm::dvec3(radius, 0.0, 0.0),
                       ring);
}

glm::dmat4 random_turn(TestRandom& random) {
    const glm::dvec3 axis = random.direction();
    return rotation(2.0 * kPi * random.uniform(), axis);
}

BenchScene crowd(std::uint32_t count) {
    BenchScene result;
    result.scene = scene_of(blob_mesh(5));
    result.scene.instances.clear();
    TestRandom random(7);
    // Together they have about the volume of the ball that they fill, so that most overlap others.
    const double size = 1.6 / std::cbrt(double(count));
    for (std::uint32_t i = 0; i < count; ++i) {
        const glm::dvec3 direction = random.direction();
        const double reach = count > 1 ? (2.0 - size) * std::cbrt(random.uniform()) : 0.0;
        const double x = random.uniform(0.6, 1.4), y = random.uniform(0.6, 1.4), z = random.uniform(0.6, 1.4);
        const glm::dmat4 turn = random_turn(random), skew = random_turn(random);
        add_instance(result.scene, 0,
                     translation(reach * direction) * turn * scaling(size * glm::dvec3(x, y, z)) * skew);
    }
    result.eye = {1.5, 2.0, 5.0};
    return result;
}

}  // namespace

core::Mesh blob_mesh(int level) {
    core::Mesh mesh = icosphere(level);
    // Waves in a few fixed directions: bumps from a third of the radius to a twentieth.
    struct Wave {
        glm::dvec3 direction;
        double frequency, height;
    };
    constexpr double kSmallest = 0.012;
    const Wave waves[] = {
        {{0.8, 0.5, 0.3}, 3.1, 0.12},        {{-0.4, 0.9, 0.2}, 5.3, 0.07},
        {{0.3, -0.5, 0.9}, 8.9, 0.04},       {{0.7, 0.1, -0.7}, 13.7, 0.025},
        {{0.1, 0.6, 0.8}, 23.0, kSmallest},  {{-0.9, 0.2, 0.4}, 31.0, kSmallest},
        {{0.5, -0.8, 0.1}, 37.0, kSmallest},
    };
    std::vector<glm::vec3> positions;
    for (const glm::vec3& vertex : mesh.positions) {
        const glm::dvec3 normal = glm::normalize(glm::dvec3(vertex));
        double radius = 1.0;
        for (const Wave& wave : waves) {
            const double phase = glm::dot(glm::normalize(wave.direction), normal);
            radius += wave.height * std::sin(wave.frequency * phase + wave.frequency);
        }
        positions.emplace_back(radius * normal);
    }
    return finished("blob", std::move(positions), std::move(mesh.triangles));
}

core::Mesh hall_mesh() {
    MeshList list;
    const auto slab = [&](const glm::dvec3& low, const glm::dvec3& high) {
        list.add(box(), translation(0.5 * (low + high)) * scaling(high - low));
    };
    // Walls reach into the floor and into each other, so that nothing coincides.
    constexpr double kX = 10.0, kY = 8.0, kZ = 6.0, kWall = 0.6;
    slab({-kX, -kWall, -kZ}, {kX, 0.0, kZ});
    for (const double side : {-1.0, 1.0}) {
        const double x = side * (kX - 0.5 * kWall), z = side * (kZ - 0.5 * kWall);
        slab({x - 0.49 * kWall, -0.5 * kWall, -kZ + 0.01}, {x + 0.49 * kWall, kY, kZ - 0.01});
        slab({-kX + 0.02, -0.4 * kWall, z - 0.48 * kWall}, {kX - 0.02, kY - 0.1, z + 0.48 * kWall});
    }

    constexpr int kColumns = 9;
    constexpr double kSpacing = 2.1, kColumnHeight = 5.0;
    const core::Mesh column = column_mesh(0.4, kColumnHeight), arch = arch_mesh(0.5 * kSpacing, 0.32);
    for (const double z : {-2.6, 2.6}) {
        for (int i = 0; i < kColumns; ++i) {
            const double x = kSpacing * (i - 0.5 * (kColumns - 1));
            list.add(column, translation({x, -0.1, z}));
            if (i + 1 < kColumns) {
                list.add(arch, translation({x + 0.5 * kSpacing, kColumnHeight - 0.35, z}));
            }
        }
    }

    TestRandom random(11);
    const core::Mesh ball = icosphere(3);
    for (int i = 0; i < 60; ++i) {
        const double size = random.uniform(0.5, 1.3);
        const double x = random.uniform(-9.0, 9.0), z = random.uniform(-5.0, 5.0);
        const double w = random.uniform(0.7, 1.3), h = random.uniform(0.7, 1.8), d = random.uniform(0.7, 1.3);
        const glm::dmat4 turn = rotation(2.0 * kPi * random.uniform(), glm::dvec3(0.0, 1.0, 0.0));
        const double tilt = random.uniform(-0.2, 0.2);
        list.add(box(), translation({x, 0.35 * size, z}) * turn * rotation(tilt, glm::dvec3(1.0, 0.0, 0.0)) *
                            scaling(size * glm::dvec3(w, h, d)));
    }
    for (int i = 0; i < 3; ++i) {
        list.add(ball, translation({-6.0 + 6.0 * i, 2.0, 0.3 * i}) * scaling(glm::dvec3(0.8)));
    }
    return make_mesh("hall", std::move(list.positions), std::move(list.normals), {},
                     std::move(list.triangles));
}

BenchScene make_bench_scene(const std::string& name) {
    BenchScene result;
    if (name == "blob") {
        result.scene = scene_of(blob_mesh(7));
        result.eye = {1.0, 0.8, 2.6};
    } else if (name == "hall") {
        result.scene = scene_of(hall_mesh());
        result.eye = {-9.0, 3.2, 1.2};
        result.target = {4.0, 1.8, -0.8};
        result.field_of_view = 1.2;
    } else if (name.starts_with("crowd")) {
        std::uint32_t count = 0;
        const char *begin = name.data() + 5, *end = name.data() + name.size();
        const auto [stop, error] = std::from_chars(begin, end, count);
        if (error == std::errc() && stop == end && count > 0) result = crowd(count);
    }
    if (result.scene.instances.empty()) {
        throw core::InputError(core::ErrorKind::kUsage,
                               fmt::format("no mesh '{}'; there are blob, hall and crowd<N>", name));
    }
    result.name = name;
    result.scene.name = name;
    return result;
}

}  // namespace tests
