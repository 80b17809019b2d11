// Cases 4, 7, 9 and 10: which side a sample lies on where meshes leave it open.
#include <algorithm>
#include <cmath>

#include "core/support/parallel.h"
#include "sdf/winding_number.h"
#include "tests/sdf/baked_shapes.h"
#include "tests/stability/hard_case.h"

namespace tests {
namespace {

core::Mesh without_faces(const core::Mesh& mesh, const std::function<bool(std::size_t)>& is_missing) {
    std::vector<glm::uvec3> kept;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (!is_missing(i)) kept.push_back(mesh.triangles[i]);
    }
    return make_mesh("holed", mesh.positions, mesh.normals, {}, kept);
}

struct SignCount {
    std::size_t samples = 0, wrong = 0;
};

/// Compares the sign of every sample farther than `clear` voxels from its triangle with the exact winding
/// number of `truth`, which may be another mesh than the one that was baked. `counts` picks samples.
SignCount count_wrong_signs(const sdf::SampledField& field, const core::Mesh& truth, double clear,
                            const std::function<bool(const glm::dvec3&)>& counts = {}) {
    const std::vector<sdf::Triangle> triangles = triangles_of(truth);
    struct Sample {
        glm::dvec3 position;
        bool is_negative;
    };
    std::vector<Sample> samples;
    for_each_sample(field, [&](const glm::dvec3& position, float value, std::int32_t triangle) {
        if (std::abs(value) <= clear * field.info.voxel_size) return;
        // Within the shell of a hole's rim or of a thin wall a sample has no side.
        if (value < 0.0f && !field.features.empty() &&
            field.features[static_cast<std::size_t>(triangle)] != sdf::Feature::kSurface) {
            return;
        }
        if (!counts || counts(position)) samples.push_back({position, value < 0.0f});
    });
    std::vector<std::uint8_t> wrong(samples.size());
    core::parallel_for(samples.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const double w = std::abs(sdf::exact_winding_number(triangles, samples[i].position));
            // At exactly one half, or within the rounding of a sum of solid angles, either sign is right.
            wrong[i] = std::abs(w - 0.5) > 1e-9 && samples[i].is_negative != (w >= 0.5);
        }
    });
    return {samples.size(), static_cast<std::size_t>(std::count(wrong.begin(), wrong.end(), 1))};
}

TEST(Case04, SignsAreThoseOfTheExactWindingNumberWithFacesMissing) {
    // Coarse spheres: one face is a hole of many voxels.
    for (const int level : {1, 2}) {
        const core::Mesh ball = icosphere(level);
        for (const std::size_t missing : {std::size_t{0}, std::size_t{7}}) {
            const core::Mesh holed = without_faces(ball, [&](std::size_t i) { return i == missing; });
            const sdf::SampledField field = bake(holed, 32);
            EXPECT_EQ(field.info.mesh_class, sdf::MeshClass::kSolid);
            const SignCount count = count_wrong_signs(field, holed, 0.01);
            EXPECT_GT(count.samples, 10'000u);
            EXPECT_EQ(count.wrong, 0u) << "level " << level << ", of " << count.samples;
        }
    }
    TestRandom random(3);
    for (const core::Mesh& whole : {icosphere(3), torus(1.0f, 0.4f, 32, 16)}) {
        const core::Mesh holed = without_faces(whole, [&](std::size_t) { return random.uniform() < 0.05; });
        const sdf::SampledField field = bake(holed, 32);
        EXPECT_EQ(field.info.mesh_class, sdf::MeshClass::kSolid);
        const SignCount count = count_wrong_signs(field, holed, 0.01);
        EXPECT_GT(count.samples, 10'000u);
        EXPECT_EQ(count.wrong, 0u) << "of " << count.samples;
    }
}

TEST(Case07, SpheresThatNearlyTouchStayApart) {
    // Balls of radius 1 along x with a gap of `gap` voxels, h = 1 / 12.
    const double h = 1.0 / 12.0;
    const core::Mesh ball = icosphere(4);
    for (const double gap : {0.2, 0.5, 0.8, 1.1, 1.5, 2.0, 3.0}) {
        const double half = 0.5 * gap * h;
        const core::Mesh both = merged(moved(ball, translation({-1.0 - half, 0, 0})),
                                       moved(ball, translation({1.0 + half, 0, 0})));
        const sdf::MeshView view{both.positions, both.triangles};
        const sdf::SampledField field = sdf::bake_mesh(view, {h, sdf::ClassOverride::kAuto});
        // Every seventh sample; all of those about the gap.
        std::size_t number = 0;
        const SignCount count = count_wrong_signs(field, both, 0.01, [&](const glm::dvec3& p) {
            return number++ % 29 == 0 || glm::length(p) < 4.0 * h;
        });
        EXPECT_EQ(count.wrong, 0u) << "gap " << gap << ", of " << count.samples;
    }
}

TEST(Case07, ARayDownTheGapPasses) {
    const core::Mesh ball = icosphere(4);
    for (const double gap : {1.1, 1.5, 2.0, 3.0}) {
        const double h = 1.0 / 12.0, half = 0.5 * gap * h;
        // Shifted, so that the gap lies anywhere between samples, and turned.
        std::size_t blocked[3] = {}, count = 0;
        TestRandom random(5);
        for (int turn = 0; turn < ray_count(3, 40); ++turn) {
            const glm::dmat4 matrix =
                turn == 0 ? glm::dmat4(1.0) : rotation(random.uniform(0.0, 3.0), random.direction());
            const core::Mesh both = moved(merged(moved(ball, translation({-1.0 - half, 0, 0})),
                                                 moved(ball, translation({1.0 + half, 0, 0}))),
                                          matrix);
            const glm::vec3 extent = both.bounds.extent();
            const BakedScene baked(
                scene_of(both), static_cast<int>(std::round(std::max({extent.x, extent.y, extent.z}) / h)));
            std::vector<core::Ray> rays;
            for (int i = 0; i < 50; ++i) {
                const double angle = random.uniform(0.0, 6.28);
                const glm::dvec3 direction(0.0, std::cos(angle), std::sin(angle));
                rays.push_back(
                    make_ray(glm::dmat3(matrix) * (-2.0 * direction), glm::dmat3(matrix) * direction));
            }
            count += rays.size();
            for_each_way([&](const Way& way) {
                const core::HitStream hits = trace_both(baked.tracer(way.mode), stream_of(rays));
                for (std::size_t i = 0; i < rays.size(); ++i) {
                    blocked[static_cast<int>(way.mode)] += hits.get(i).hit();
                }
            });
        }
        EXPECT_EQ(blocked[static_cast<int>(sdf::HitMode::kCubic)], 0u) << "gap " << gap << ", of " << count;
        EXPECT_EQ(blocked[static_cast<int>(sdf::HitMode::kSecant)], 0u) << "gap " << gap << ", of " << count;
        if (std::getenv("FIELDLIGHT_FIGURES")) {
            std::cerr << "gap " << gap << ": eps blocks " << blocked[0] << " of " << count << "\n";
        }
    }
}

TEST(Case09, ReversedWindingGivesTheSameField) {
    for (const core::Mesh& mesh : {icosphere(3), box({0.5f, 0.31f, 0.2f}), torus(1.0f, 0.4f, 32, 16)}) {
        const sdf::SampledField a = bake(mesh, 32), b = bake(reversed(mesh), 32);
        ASSERT_EQ(a.leaves.size(), b.leaves.size());
        EXPECT_EQ(a.info.mesh_class, b.info.mesh_class);
        double worst = 0.0;
        std::size_t signs = 0;
        for (std::size_t i = 0; i < a.leaves.size(); ++i) {
            ASSERT_EQ(a.leaves[i].active, b.leaves[i].active);
            for (std::size_t k = 0; k < sdf::kLeafSize; ++k) {
                worst = std::max(worst, std::abs(double(a.leaves[i].distance[k]) - b.leaves[i].distance[k]));
                signs += (a.leaves[i].distance[k] < 0.0f) != (b.leaves[i].distance[k] < 0.0f);
            }
        }
        EXPECT_EQ(signs, 0u);
        // An ulp of the stored floats.
        EXPECT_LE(worst, 4.0 * 0x1p-24 * a.background());
    }
}

TEST(Case09, FlippedFacesSpoilFewSigns) {
    for (const core::Mesh& whole : {icosphere(3), torus(1.0f, 0.4f, 32, 16)}) {
        core::Mesh flipped = whole;
        TestRandom random(5);
        for (glm::uvec3& corner : flipped.triangles) {
            if (random.uniform() < 0.05) std::swap(corner.y, corner.z);
        }
        const sdf::SampledField field = bake(flipped, 32);
        if (field.info.mesh_class == sdf::MeshClass::kSheet) continue;
        // Against the mesh as it was meant.
        const SignCount count = count_wrong_signs(field, whole, 0.01);
        EXPECT_LE(count.wrong, count.samples / 200) << "of " << count.samples;
    }
}

TEST(Case10, FinsAndCracksSpoilOnlyTheirOwnNeighbourhood) {
    const core::Mesh ball = icosphere(3);
    const double width = 2e-4;  // 1e-4 of the extent.
    // Cracks: at a tenth of the triangles one corner draws back from its neighbours. The mesh stays in one
    // piece.
    core::Mesh cracked = ball;
    TestRandom random(3);
    for (glm::uvec3& corner : cracked.triangles) {
        if (random.uniform() > 0.1) continue;
        const glm::vec3 p = ball.positions[corner.x];
        const glm::vec3 middle = 0.5f * (ball.positions[corner.y] + ball.positions[corner.z]);
        corner.x = static_cast<std::uint32_t>(cracked.positions.size());
        cracked.positions.push_back(p + float(width) * glm::normalize(middle - p));
    }
    cracked = make_mesh("cracked", cracked.positions, {}, {}, cracked.triangles);
    // Fins: triangles that stand on edges of the sphere, three faces an edge, 1e-4 high.
    core::Mesh finned = ball;
    for (std::size_t i = 0; i < ball.triangles.size(); i += 5) {
        const glm::uvec3 corner = ball.triangles[i];
        const glm::vec3 a = ball.positions[corner.x], b = ball.positions[corner.y];
        const auto tip = static_cast<std::uint32_t>(finned.positions.size());
        const glm::vec3 middle = 0.5f * (a + b);
        finned.positions.push_back(middle + (i % 2 ? 1.0f : -1.0f) * float(width) * glm::normalize(middle));
        finned.triangles.emplace_back(corner.x, corner.y, tip);
    }
    finned = make_mesh("finned", finned.positions, {}, {}, finned.triangles);
    for (const core::Mesh* mesh : std::initializer_list<const core::Mesh*>{&cracked, &finned}) {
        const sdf::SampledField field = bake(*mesh, 40);
        EXPECT_NE(field.info.mesh_class, sdf::MeshClass::kSheet) << mesh->name;
        // Farther than twice the width from the surface.
        const SignCount count = count_wrong_signs(field, ball, 2.0 * width / field.info.voxel_size);
        EXPECT_GT(count.samples, 10'000u);
        EXPECT_EQ(count.wrong, 0u) << mesh->name << ", of " << count.samples;
    }
}

}  // namespace
}  // namespace tests
