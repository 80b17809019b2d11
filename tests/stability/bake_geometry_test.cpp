// Cases 1 to 3, 8 and 11 to 14: what a mesh may hold that a bake cannot use, and what the field says then.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "sdf/baker.h"
#include "sdf/distance.h"
#include "sdf/vdb_file.h"
#include "tests/sdf/baked_shapes.h"
#include "tests/stability/hard_case.h"
#include "tests/support/shared_data.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

/// The mesh with `faces` put in front of its own.
core::Mesh with_faces(core::Mesh mesh, const std::vector<glm::uvec3>& faces) {
    mesh.triangles.insert(mesh.triangles.begin(), faces.begin(), faces.end());
    return mesh;
}

/// Largest difference of two fields with the same samples, in steps of 16 bits; sign changes; triangles that
/// differ but for the `shift` of their numbers.
struct Difference {
    double steps = 0.0;
    std::size_t samples = 0, changed = 0, signs = 0, triangles = 0;
    bool same_topology = true;
};

Difference difference_of(const sdf::SampledField& a, const sdf::SampledField& b, int shift = 0) {
    Difference difference;
    if (a.leaves.size() != b.leaves.size()) {
        difference.same_topology = false;
        return difference;
    }
    for (std::size_t i = 0; i < a.leaves.size(); ++i) {
        const sdf::FieldLeaf &one = a.leaves[i], &other = b.leaves[i];
        if (one.origin != other.origin || one.active != other.active) difference.same_topology = false;
        for (int k = 0; k < sdf::kLeafSize; ++k) {
            if (!one.is_active(k) || !other.is_active(k)) continue;
            const auto slot = static_cast<std::size_t>(k);
            const double apart =
                std::abs(one.distance[slot] / a.info.voxel_size - other.distance[slot] / b.info.voxel_size) /
                static_cast<double>(sdf::kSampleStepVoxels);
            ++difference.samples;
            difference.changed += apart > 1.0;
            difference.steps = std::max(difference.steps, apart);
            difference.signs += (one.distance[slot] < 0.0f) != (other.distance[slot] < 0.0f);
            difference.triangles += one.triangle[slot] + shift != other.triangle[slot];
        }
    }
    return difference;
}

bool same_bytes(const sdf::SampledField& a, const sdf::SampledField& b) {
    if (a.leaves.size() != b.leaves.size()) return false;
    for (std::size_t i = 0; i < a.leaves.size(); ++i) {
        if (std::memcmp(&a.leaves[i].distance, &b.leaves[i].distance, sizeof(a.leaves[i].distance)) != 0 ||
            a.leaves[i].active != b.leaves[i].active || a.leaves[i].origin != b.leaves[i].origin) {
            return false;
        }
    }
    return true;
}

TEST(Case01, FacesThatAreNotFiniteLeaveNoTrace) {
    for (const core::Mesh& clean : {icosphere(2), quad(1.0f, 1.0f, 3, 3), torus(1.0f, 0.4f, 24, 12)}) {
        core::Mesh broken = clean;
        std::vector<glm::uvec3> faces;
        for (const float bad :
             {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
              -std::numeric_limits<float>::infinity(), 3e38f}) {
            for (int axis = 0; axis < 3; ++axis) {
                glm::vec3 position = clean.positions[0];
                position[axis] = bad;
                faces.emplace_back(0u, 1u, static_cast<std::uint32_t>(broken.positions.size()));
                broken.positions.push_back(position);
            }
        }
        broken = with_faces(broken, faces);
        const sdf::SampledField a = bake(clean, 24), b = bake(broken, 24);
        EXPECT_TRUE(same_bytes(a, b));
        EXPECT_EQ(difference_of(a, b, static_cast<int>(faces.size())).triangles, 0u);
        EXPECT_EQ(b.info.dropped_faces, faces.size());
        ASSERT_EQ(b.info.warnings.size(), a.info.warnings.size() + 1);
        EXPECT_NE(b.info.warnings[0].find("12 faces dropped"), std::string::npos) << b.info.warnings[0];
    }
}

TEST(Case02, UnusableFacesMoveNoSampleByAStep) {
    for (const core::Mesh& clean : {icosphere(2), torus(1.0f, 0.4f, 24, 12)}) {
        core::Mesh broken = clean;
        // A vertex in the middle of an edge: a face without area that is no repetition.
        const auto middle = static_cast<std::uint32_t>(broken.positions.size());
        broken.positions.push_back(clean.positions[clean.triangles[0].x]);
        const glm::uvec3 face = clean.triangles[5];
        broken = with_faces(broken, {{0u, 1u, 1u},
                                     {2u, 2u, 2u},
                                     {0u, 1u, 1'000'000u},
                                     {0xffffffffu, 1u, 2u},
                                     {clean.triangles[0].x, clean.triangles[0].y, middle},
                                     face,
                                     {face.y, face.z, face.x}});
        // The faces in front are the first of their kind: the original is the duplicate.
        const sdf::SampledField a = bake(clean, 24), b = bake(broken, 24);
        const Difference difference = difference_of(a, b, 7);
        EXPECT_TRUE(difference.same_topology);
        EXPECT_LE(difference.steps, 1.0);
        EXPECT_EQ(difference.signs, 0u);
        EXPECT_EQ(b.info.dropped_faces, 7u);
    }
}

TEST(Case03, WithoutAUsableFaceThereIsAnErrorAndNoFile) {
    core::Mesh line;
    line.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    line.triangles = {{0, 1, 2}, {0, 0, 0}};
    core::Mesh nowhere = line;
    for (glm::vec3& position : nowhere.positions) position.x = std::numeric_limits<float>::quiet_NaN();
    for (core::Mesh* mesh : {&line, &nowhere}) {
        *mesh = make_mesh("the empty one", mesh->positions, {}, {}, mesh->triangles);
        const TemporaryFolder folder;
        const sdf::BakeResult result = sdf::bake_scene(scene_of(*mesh), {}, folder.path());
        ASSERT_EQ(result.meshes.size(), 1u);
        ASSERT_TRUE(result.meshes[0].error);
        EXPECT_EQ(result.meshes[0].error->kind(), core::ErrorKind::kBadData);
        EXPECT_NE(std::string(result.meshes[0].error->what()).find("'the empty one'"), std::string::npos);
        EXPECT_TRUE(fs::is_empty(folder.path()));
    }
    // A mesh of no faces at all is nothing to bake.
    const TemporaryFolder folder;
    const sdf::BakeResult result =
        sdf::bake_scene(scene_of(make_mesh("none", {}, {}, {}, {})), {}, folder.path());
    EXPECT_TRUE(result.meshes.empty());
    EXPECT_TRUE(fs::is_empty(folder.path()));
}

/// Field values at random points inside the union of two shapes: none may be positive.
template <typename IsDeep>
void expect_solid_inside(const core::Mesh& mesh, int resolution, const IsDeep& is_deep) {
    const BakedScene baked(scene_of(mesh), resolution);
    std::size_t outside = 0, count = 0;
    for_each_sample(bake(mesh, resolution), [&](const glm::dvec3& position, float value, std::int32_t) {
        if (!is_deep(position, 1e-3 * baked.voxel())) return;
        ++count;
        outside += value >= 0.0f;
    });
    EXPECT_GT(count, 1000u);
    EXPECT_EQ(outside, 0u) << "samples inside that count as outside";
    TestRandom random(4);
    std::vector<core::Ray> rays;
    while (static_cast<int>(rays.size()) < ray_count(8'000, 500'000)) {
        const glm::dvec3 origin(random.uniform(-2.0, 2.0), random.uniform(-1.0, 1.0),
                                random.uniform(-1.0, 1.0));
        if (is_deep(origin, 2.0 * baked.voxel())) rays.push_back(make_ray(origin, random.direction()));
    }
    const core::RayStream stream = stream_of(rays);
    for_each_way([&](const Way& way) {
        const core::HitStream hits = trace_both(baked.tracer(way.mode), stream);
        std::size_t within = 0, misses = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            misses += !hits.get(i).hit();
            const glm::dvec3 point =
                glm::dvec3(rays[i].origin) + double(hits.t[i]) * glm::dvec3(rays[i].direction);
            within += hits.get(i).hit() && is_deep(point, 0.5 * baked.voxel());
        }
        // The field is small next to a buried surface, and small is what eps looks for.
        const std::size_t allowed = way.mode == sdf::HitMode::kEps ? rays.size() / 20 : 0;
        EXPECT_LE(within, allowed) << way << ": hits on surfaces inside";
        EXPECT_EQ(misses, 0u) << way;
    });
}

TEST(Case08, OverlappingShellsOfAMeshHaveNoSurfaceInside) {
    const core::Mesh ball = icosphere(4);
    const double inner = icosphere_inner_radius(4);
    expect_solid_inside(merged(moved(ball, translation({-0.5, 0, 0})), moved(ball, translation({0.5, 0, 0}))),
                        48, [&](const glm::dvec3& p, double depth) {
                            return std::min(glm::distance(p, glm::dvec3(0.5, 0, 0)),
                                            glm::distance(p, glm::dvec3(-0.5, 0, 0))) < inner - depth;
                        });
    // Boxes whose faces inside the other lie on samples of exactly 0. One shell within the other as well.
    const core::Mesh block = box(glm::vec3(0.5f));
    expect_solid_inside(
        merged(merged(moved(block, translation({-0.25, 0, 0})), moved(block, translation({0.25, 0, 0}))),
               box(glm::vec3(0.25f))),
        48, [](const glm::dvec3& p, double depth) {
            return std::abs(p.x) < 0.75 - depth && std::max(std::abs(p.y), std::abs(p.z)) < 0.5 - depth;
        });
}

/// Distance from a point to a triangle in long double, by another way than the bake: the plane's foot if it
/// lies inside, else the nearest of three segments.
long double long_distance(const sdf::Triangle& triangle, const glm::dvec3& at) {
    using Vector = glm::tvec3<long double>;
    const Vector corner[3] = {Vector(triangle.a), Vector(triangle.b), Vector(triangle.c)};
    const Vector p(at);
    long double best = std::numeric_limits<long double>::infinity();
    const Vector n = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
    const long double area = glm::length(n);
    bool is_inside = area > 0.0L;
    for (int i = 0; i < 3; ++i) {
        const Vector a = corner[i], e = corner[(i + 1) % 3] - a;
        is_inside = is_inside && glm::dot(glm::cross(e, p - a), n) >= 0.0L;
        const long double s = std::clamp(glm::dot(p - a, e) / glm::dot(e, e), 0.0L, 1.0L);
        best = std::min(best, glm::length(a + s * e - p));
    }
    return is_inside ? std::min(best, std::abs(glm::dot(p - corner[0], n)) / area) : best;
}

TEST(Case11, SliversHaveExactDistances) {
    // A box whose long faces are fans of needles, 1e6 times longer than wide, at all angles.
    const float thin = 1e-6f;
    std::vector<glm::vec3> positions;
    std::vector<glm::uvec3> triangles;
    TestRandom random(7);
    for (int i = 0; i < 60; ++i) {
        const glm::dvec3 start = 0.5 * random.direction();
        const glm::dvec3 along = random.direction();
        const glm::dvec3 across = glm::normalize(glm::cross(along, random.direction()));
        const auto first = static_cast<std::uint32_t>(positions.size());
        positions.emplace_back(start);
        positions.emplace_back(start + along);
        positions.emplace_back(start + random.uniform() * along + double(thin) * across);
        triangles.emplace_back(first, first + 1, first + 2);
    }
    // A ball whose triangles are cut into slivers by a vertex just off an edge.
    const core::Mesh ball = icosphere(1);
    for (const glm::uvec3& corner : ball.triangles) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        const glm::vec3 a = ball.positions[corner.x], b = ball.positions[corner.y],
                        c = ball.positions[corner.z];
        const glm::vec3 near_edge = 0.5f * (a + b) + thin * (c - a);
        for (const glm::vec3& p : {a, b, c, near_edge}) positions.push_back(p + glm::vec3(3.0f, 0.0f, 0.0f));
        triangles.emplace_back(first, first + 1, first + 3);
        triangles.emplace_back(first + 1, first + 2, first + 3);
        triangles.emplace_back(first + 2, first, first + 3);
    }
    const core::Mesh mesh = make_mesh("needles", positions, {}, {}, triangles);
    const sdf::SampledField field = bake(mesh, 64, sdf::ClassOverride::kSheet);
    const double h = field.info.voxel_size;
    const std::vector<sdf::Triangle> corners = triangles_of(mesh);
    std::size_t count = 0;
    double worst = 0.0;
    for_each_sample(field, [&](const glm::dvec3& position, float value, std::int32_t) {
        if (count++ % 7 != 0) return;
        long double exact = std::numeric_limits<long double>::infinity();
        for (const sdf::Triangle& triangle : corners)
            exact = std::min(exact, long_distance(triangle, position));
        const double expected =
            std::min(double(exact) / h - sdf::kHalfThicknessVoxels, double(sdf::kBandVoxels));
        worst = std::max(worst, std::abs(value / h - expected));
    });
    EXPECT_GT(count, 10'000u);
    EXPECT_LE(worst, 1e-4) << "voxels";
}

TEST(Case12, AMeshFarFromTheOriginGivesTheSameField) {
    // Positions are floats: at 2^20 they are an eighth apart, so the shape has corners at eighths.
    core::Mesh shape = moved(icosphere(1), scaling(glm::dvec3(0.5)));
    for (glm::vec3& position : shape.positions) position = glm::round(position * 8.0f) / 8.0f;
    core::Mesh far = shape;
    for (glm::vec3& position : far.positions) position += glm::vec3(0x1p20f, -0x1p20f, 0x1p20f);
    const Difference difference = difference_of(bake(shape, 40), bake(far, 40));
    EXPECT_TRUE(difference.same_topology);
    EXPECT_GT(difference.samples, 10'000u);
    EXPECT_LE(difference.changed, difference.samples / 1000);
    EXPECT_EQ(difference.signs, 0u);
}

TEST(Case12, ScaleChangesNoTopology) {
    // By factors that no power of two hides.
    const core::Mesh mesh = torus(1.0f, 0.4f, 40, 20);
    const sdf::SampledField unit = bake(mesh, 40);
    for (const double scale : {1e-6, 1e6}) {
        const sdf::SampledField scaled = bake(moved(mesh, scaling(glm::dvec3(scale))), 40);
        const Difference difference = difference_of(unit, scaled);
        // The scaled floats round: samples move by up to 1e-6 of the extent, 0.4 steps of the stored
        // distances.
        EXPECT_EQ(difference.signs, 0u) << scale;
        EXPECT_LE(difference.steps, 1.0) << scale;
        EXPECT_TRUE(difference.same_topology) << scale;
    }
}

TEST(Case13, OneThreadAndManyGiveTheSameBytes) {
    const core::Scene scene =
        scene_of(merged(merged(icosphere(3), moved(quad(2, 2, 4, 4), translation({0, 0, 1.5}))),
                        moved(box({0.8f, 0.8f, 0.004f}), translation({0, 0, -1.5}))));
    std::string bytes[3];
    const int threads[] = {1, 2, 7};
    sdf::BakeSettings settings;
    settings.resolution = 64;
    for (int i = 0; i < 3; ++i) {
        const TemporaryFolder folder;
        core::with_thread_limit(threads[i], [&] {
            const sdf::BakeResult result = sdf::bake_scene(scene, settings, folder.path());
            std::ifstream file(result.meshes[0].file, std::ios::binary);
            bytes[i].assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
        });
    }
    EXPECT_GT(bytes[0].size(), 100'000u);
    EXPECT_TRUE(bytes[0] == bytes[1]);
    EXPECT_TRUE(bytes[0] == bytes[2]);
}

/// Least distance from a point to the occupied cells of a grid, or `bound` where none is nearer.
class OccupiedCells {
public:
    explicit OccupiedCells(const sdf::BrickGrid& grid) {
        const glm::ivec3 count = grid.block_count();
        for (int i = 0; i < count.x * count.y * count.z; ++i) {
            const glm::ivec3 block(i / (count.y * count.z), i / count.z % count.y, i % count.z);
            const sdf::Brick* brick = grid.brick(block);
            if (!brick) continue;
            Block& filled = blocks_.emplace_back();
            filled.first = glm::dvec3(block * sdf::kBrickCells);
            for (int cell = 0; cell < 343; ++cell) {
                const glm::ivec3 local(cell / 49, cell / 7 % 7, cell % 7);
                // By the samples themselves, not by the mask alone.
                bool negative = false, positive = false;
                for (const double value : sdf::CellCorners::load(*brick, local).value) {
                    (value < 0.0 ? negative : positive) = true;
                }
                if ((negative && positive) || brick->is_occupied(local.x, local.y, local.z)) {
                    filled.cells.push_back(filled.first + glm::dvec3(local));
                }
            }
        }
    }

    bool any_nearer(const glm::dvec3& point, double bound) const {
        const auto is_near = [&](const glm::dvec3& corner, double size) {
            const glm::dvec3 gap = glm::max(glm::max(corner - point, point - corner - size), glm::dvec3(0.0));
            return glm::dot(gap, gap) < bound * bound;
        };
        return std::any_of(blocks_.begin(), blocks_.end(), [&](const Block& block) {
            return is_near(block.first, 7.0) &&
                   std::any_of(block.cells.begin(), block.cells.end(),
                               [&](const glm::dvec3& cell) { return is_near(cell, 1.0); });
        });
    }

private:
    struct Block {
        glm::dvec3 first;
        std::vector<glm::dvec3> cells;
    };
    std::vector<Block> blocks_;
};

TEST(Case14, NoPointOfAnEmptyBlockIsNearerToASurfaceThanItsBound) {
    core::Mesh holed = icosphere(2);
    holed.triangles.erase(holed.triangles.begin() + 5);
    holed = make_mesh("holed", holed.positions, holed.normals, {}, holed.triangles);
    const core::Mesh shapes[] = {torus(1.0f, 0.3f, 48, 24),
                                 merged(icosphere(2, 0.2f), moved(box(), translation({2, 1, 1}))), holed,
                                 moved(quad(2.0f, 2.0f), rotation(0.4, {1, 2, 3}))};
    for (const core::Mesh& mesh : shapes) {
        const auto grid = grid_of(mesh, 96);
        const OccupiedCells occupied(*grid);
        const glm::dvec3 extent(grid->block_count() * sdf::kBrickCells);
        TestRandom random(21);
        int checked = 0, violations = 0;
        double farthest = 0.0;
        for (int tries = 0; checked < ray_count(20'000, 250'000) && tries < 10'000'000; ++tries) {
            const glm::dvec3 point =
                glm::dvec3(random.uniform(), random.uniform(), random.uniform()) * extent;
            const std::int32_t entry = grid->entry(glm::ivec3(point) / sdf::kBrickCells);
            if (entry >= 0) continue;
            ++checked;
            const double bound = sdf::BrickGrid::empty_distance(entry);
            farthest = std::max(farthest, bound);
            violations += occupied.any_nearer(point, bound);
        }
        EXPECT_EQ(violations, 0) << "of " << checked;
        EXPECT_GT(farthest, 5.0);
    }
}

}  // namespace
}  // namespace tests
