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

/// How far columns and boxes reach into the floor, and arches into what they stand on. Faces that are buried
/// must lie deeper than two voxels, and meet what buries them at right angles, or the bake takes what lies
/// before them for a thin wall.
constexpr double kBuried = 0.4;

/// A fluted shaft between a round base and a round capital, from y = -kBuried to `height`.
core::Mesh column_mesh(double height) {
    constexpr int kRings = 24, kSides = 48, kFlutes = 12;
    constexpr double kShaft = 0.4, kEnd = 0.9, kEndHeight = 0.7;
    const auto ring = [&](int i, int j) {
        const double y = -kBuried + (height + kBuried) * i / (kRings - 1);
        const double from_end = std::min(y, height - y);
        const double shaft = std::clamp((from_end - kEndHeight) / 0.4, 0.0, 1.0);
        const double angle = 2.0 * kPi * j / kSides;
        const double fluted = kShaft * (1.0 + 0.08 * std::cos(kFlutes * angle));
        const double r = kEnd + shaft * shaft * (3.0 - 2.0 * shaft) * (fluted - kEnd);
        return glm::dvec3(r * std::cos(angle), y, r * std::sin(angle));
    };
    return capped_tube("column", kRings, kSides, glm::dvec3(0.0, -kBuried, 0.0), glm::dvec3(0.0, height, 0.0),
                       ring);
}

/// Half a torus on straight legs, over the x axis: it stands at y = 0 and reaches kBuried below.
core::Mesh arch_mesh(double radius, double thickness) {
    constexpr int kRings = 27, kSides = 12;
    constexpr double kLeg = 0.4;
    const auto ring = [&](int i, int j) {
        const double along = kPi * (1.0 - double(std::clamp(i, 1, kRings - 2) - 1) / (kRings - 3));
        const double rise = i == 0 || i == kRings - 1 ? -kBuried : kLeg, round = -2.0 * kPi * j / kSides;
        const glm::dvec3 outwards(std::cos(along), std::sin(along), 0.0);
        return outwards * (radius + thickness * std::cos(round)) +
               glm::dvec3(0.0, rise, thickness * std::sin(round));
    };
    return capped_tube("arch", kRings, kSides, glm::dvec3(-radius, -kBuried, 0.0),
                       glm::dvec3(radius, -kBuried, 0.0), ring);
}

/// A box without a lid, as thick as `wall`: the inside reaches from y = 0 to the rim at half_extent.y.
core::Mesh open_box_mesh(const glm::dvec3& half_extent, double wall) {
    const glm::dvec3 inner = half_extent - wall;
    std::vector<glm::vec3> positions;
    // Counter-clockwise seen from above: outside at the bottom and at the rim, inside at the rim and below.
    const auto add_ring = [&](double x, double y, double z) {
        for (const glm::dvec2 sign :
             {glm::dvec2(-1, -1), glm::dvec2(-1, 1), glm::dvec2(1, 1), glm::dvec2(1, -1)})
            positions.emplace_back(sign.x * x, y, sign.y * z);
    };
    add_ring(half_extent.x, -wall, half_extent.z);
    add_ring(half_extent.x, half_extent.y, half_extent.z);
    add_ring(inner.x, half_extent.y, inner.z);
    add_ring(inner.x, 0.0, inner.z);
    std::vector<glm::uvec3> triangles = {{0, 2, 1}, {0, 3, 2}, {12, 13, 14}, {12, 14, 15}};
    for (unsigned ring = 0; ring < 12; ring += 4) {
        for (unsigned j = 0; j < 4; ++j) {
            const unsigned a = ring + j, b = ring + (j + 1) % 4;
            triangles.emplace_back(a, b, b + 4);
            triangles.emplace_back(a, b + 4, a + 4);
        }
    }
    return finished("open box", std::move(positions), std::move(triangles));
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
    list.add(open_box_mesh({10.0, 8.0, 6.0}, 2.0 * kBuried), glm::dmat4(1.0));

    constexpr int kColumns = 9;
    constexpr double kSpacing = 2.0, kColumnHeight = 5.0;
    // Legs of neighbouring arches stand side by side on the column between them.
    const core::Mesh column = column_mesh(kColumnHeight), arch = arch_mesh(0.5 * kSpacing - 0.34, 0.24);
    for (const double z : {-2.6, 2.6}) {
        for (int i = 0; i < kColumns; ++i) {
            const double x = kSpacing * (i - 0.5 * (kColumns - 1));
            list.add(column, translation({x, 0.0, z}));
            if (i + 1 < kColumns) list.add(arch, translation({x + 0.5 * kSpacing, kColumnHeight, z}));
        }
    }

    // Boxes stand in rows, each turned and sized at random, and touch nothing but the floor.
    TestRandom random(11);
    constexpr int kBoxesInRow = 15;
    for (const double z : {-4.3, -0.75, 0.75, 4.3}) {
        for (int i = 0; i < kBoxesInRow; ++i) {
            const double x = 1.22 * (i - 0.5 * (kBoxesInRow - 1));
            const double width = random.uniform(0.4, 0.75), depth = random.uniform(0.4, 0.75);
            const double height = random.uniform(0.4, 2.0), turn = kPi * random.uniform();
            list.add(box(), translation({x, 0.5 * (height - kBuried), z}) *
                                rotation(turn, glm::dvec3(0.0, 1.0, 0.0)) *
                                scaling({width, height + kBuried, depth}));
        }
    }
    const core::Mesh ball = icosphere(3);
    for (int i = 0; i < 3; ++i) {
        list.add(ball, translation({-6.0 + 6.0 * i, 3.6, 0.3 * i}) * scaling(glm::dvec3(0.8)));
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
