#include "sdf/mesh_to_sdf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "sdf/winding_number.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

/// Distance by trying every triangle.
double brute_force_distance(const std::vector<sdf::Triangle>& triangles, const glm::dvec3& point) {
    double best = std::numeric_limits<double>::infinity();
    for (const sdf::Triangle& triangle : triangles) {
        best = std::min(best, glm::distance(sdf::closest_point(triangle, point).position, point));
    }
    return best;
}

void expect_equal_samples(const sdf::SampledField& a, const sdf::SampledField& b) {
    ASSERT_EQ(a.leaves.size(), b.leaves.size());
    for (std::size_t i = 0; i < a.leaves.size(); ++i) {
        ASSERT_EQ(a.leaves[i].origin, b.leaves[i].origin);
        ASSERT_EQ(a.leaves[i].active, b.leaves[i].active);
        ASSERT_EQ(a.leaves[i].triangle, b.leaves[i].triangle);
        ASSERT_EQ(std::memcmp(a.leaves[i].distance.data(), b.leaves[i].distance.data(),
                              sizeof(a.leaves[i].distance)),
                  0);
    }
    EXPECT_EQ(a.features, b.features);
    EXPECT_EQ(a.info.error_voxels.max, b.info.error_voxels.max);
}

/// Checks every sample's magnitude and sign by brute force.
void expect_exact(const core::Mesh& mesh, int resolution) {
    const sdf::SampledField field = bake(mesh, resolution);
    const std::vector<sdf::Triangle> triangles = triangles_of(mesh);
    const double background = field.background();
    std::size_t count = 0;
    for_each_sample(field, [&](const glm::dvec3& position, float value, std::int32_t triangle) {
        if (count++ % 23 != 0) return;
        const double distance = std::min(brute_force_distance(triangles, position), background);
        // The bake works in voxels in double and stores floats.
        ASSERT_NEAR(std::abs(value), distance, 1e-6 * background);
        if (distance > 0.01 * field.info.voxel_size) {
            const bool inside = std::abs(sdf::exact_winding_number(triangles, position)) >= 0.5;
            ASSERT_EQ(value < 0.0f, inside)
                << "at distance " << distance / field.info.voxel_size << " voxels";
        }
        if (triangle >= 0 && distance < background) {
            const auto& stored = triangles[static_cast<std::size_t>(triangle)];
            ASSERT_NEAR(glm::distance(sdf::closest_point(stored, position).position, position), distance,
                        1e-6 * background);
        }
    });
    EXPECT_GT(count, 2000u);
}

TEST(MeshToSdf, SamplesAreExactDistancesWithTheSignOfTheWindingNumber) {
    expect_exact(icosphere(3), 24);
    expect_exact(box({0.5f, 0.31f, 0.2f}), 32);
    expect_exact(torus(1.0f, 0.4f, 24, 12), 32);
}

TEST(MeshToSdf, SignsHoldWithFacesMissing) {
    core::Mesh mesh = icosphere(3);
    std::vector<glm::uvec3> kept;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (i % 20 != 3) kept.push_back(mesh.triangles[i]);
    }
    mesh.triangles = kept;
    const sdf::SampledField field = bake(mesh, 32);
    EXPECT_EQ(field.info.mesh_class, sdf::MeshClass::kSolid);
    EXPECT_FALSE(field.info.clean_level_set);
    const std::vector<sdf::Triangle> triangles = triangles_of(mesh);
    std::size_t wrong = 0, count = 0;
    for_each_sample(field, [&](const glm::dvec3& position, float value, std::int32_t triangle) {
        // Within the shells of rims a sample has no side.
        const bool is_plain = field.features[static_cast<std::size_t>(triangle)] == sdf::Feature::kSurface;
        if (value < 0.0f && !is_plain) return;
        if (std::abs(value) < 0.01 * field.info.voxel_size || count++ % 11 != 0) return;
        const double w = std::abs(sdf::exact_winding_number(triangles, position));
        wrong += (value < 0.0f) != (w >= 0.5);
    });
    EXPECT_EQ(wrong, 0u) << "of " << count / 11;
}

TEST(MeshToSdf, ReversedWindingGivesTheSameDistances) {
    const sdf::SampledField a = bake(icosphere(3), 24), b = bake(reversed(icosphere(3)), 24);
    ASSERT_EQ(a.leaves.size(), b.leaves.size());
    for (std::size_t i = 0; i < a.leaves.size(); ++i) {
        ASSERT_EQ(a.leaves[i].active, b.leaves[i].active);
        for (std::size_t k = 0; k < sdf::kLeafSize; ++k) {
            // The corners come in another order: an ulp of a double, then of the stored float.
            ASSERT_NEAR(a.leaves[i].distance[k], b.leaves[i].distance[k], 1e-7f);
        }
    }
}

TEST(MeshToSdf, ThreadCountChangesNoByte) {
    // Solid, sheet and thin wall in one.
    const core::Mesh mesh = merged(merged(icosphere(3), moved(quad(2, 2, 4, 4), translation({0, 0, 1.5}))),
                                   moved(box({0.8f, 0.8f, 0.004f}), translation({0, 0, -1.5})));
    sdf::SampledField one, three;
    core::with_thread_limit(1, [&] { one = bake(mesh, 48); });
    core::with_thread_limit(3, [&] { three = bake(mesh, 48); });
    EXPECT_EQ(one.info.mesh_class, sdf::MeshClass::kMixed);
    expect_equal_samples(one, three);
}

TEST(MeshToSdf, BrokenFacesAreCountedAndChangeNothingElse) {
    const core::Mesh clean = icosphere(2);
    core::Mesh broken = clean;
    const auto vertex = static_cast<std::uint32_t>(broken.positions.size());
    broken.positions.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0f, 0.0f);
    broken.positions.emplace_back(0.0f, std::numeric_limits<float>::infinity(), 0.0f);
    broken.triangles.emplace_back(0u, 1u, vertex);
    broken.triangles.emplace_back(0u, 1u, vertex + 1);
    broken.triangles.emplace_back(0u, 1u, 1u);
    broken.triangles.emplace_back(0u, 1u, 1'000'000u);
    broken.triangles.push_back(clean.triangles[5]);
    const sdf::SampledField a = bake(clean, 24), b = bake(broken, 24);
    expect_equal_samples(a, b);
    EXPECT_EQ(a.info.dropped_faces, 0u);
    EXPECT_EQ(b.info.dropped_faces, 5u);
    EXPECT_EQ(b.info.warnings.size(), 4u);
}

TEST(MeshToSdf, MeshesWithoutAUsableFaceAreRefused) {
    core::Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    mesh.triangles = {{0, 1, 2}};
    try {
        static_cast<void>(sdf::bake_mesh({mesh.positions, mesh.triangles}, {0.1, sdf::ClassOverride::kAuto}));
        FAIL() << "a mesh without area was baked";
    } catch (const core::InputError& error) {
        EXPECT_EQ(error.kind(), core::ErrorKind::kBadData);
    }
}

TEST(MeshToSdf, AbsurdVoxelsAreRefused) {
    const core::Mesh mesh = icosphere(1);
    for (const double voxel : {0.0, -1.0, 1e-9, std::numeric_limits<double>::quiet_NaN()}) {
        EXPECT_THROW(static_cast<void>(sdf::bake_mesh({mesh.positions, mesh.triangles},
                                                      {voxel, sdf::ClassOverride::kAuto})),
                     core::InputError)
            << voxel;
    }
}

TEST(MeshToSdf, ComponentsAreClassifiedApart) {
    EXPECT_EQ(bake(icosphere(2), 16).info.mesh_class, sdf::MeshClass::kSolid);
    EXPECT_EQ(bake(quad(), 16).info.mesh_class, sdf::MeshClass::kSheet);
    EXPECT_EQ(bake(merged(icosphere(2), moved(quad(), translation({0, 0, 2}))), 16).info.mesh_class,
              sdf::MeshClass::kMixed);
    EXPECT_EQ(bake(icosphere(2), 16, sdf::ClassOverride::kSheet).info.mesh_class, sdf::MeshClass::kSheet);
    EXPECT_EQ(bake(quad(), 16, sdf::ClassOverride::kSolid).info.mesh_class, sdf::MeshClass::kSolid);
}

TEST(MeshToSdf, SlightlyBentSheetsAreSheets) {
    // Any bulge lifts |w| on the inner side above one half; only clear enclosure makes a solid.
    core::Mesh cloth = quad(2.0f, 2.0f, 16, 16);
    for (glm::vec3& p : cloth.positions) p.z = 0.15f * std::cos(1.5f * p.x) * std::cos(1.5f * p.y);
    EXPECT_EQ(bake(cloth, 32).info.mesh_class, sdf::MeshClass::kSheet);
}

TEST(MeshToSdf, SheetsAreDistancesLessTheHalfThickness) {
    const core::Mesh mesh = quad();
    const sdf::SampledField field = bake(mesh, 16);
    const double h = field.info.voxel_size;
    EXPECT_NEAR(field.info.half_thickness, 0.9 * h, 1e-12);
    EXPECT_FALSE(field.info.clean_level_set);
    const std::vector<sdf::Triangle> triangles = triangles_of(mesh);
    for_each_sample(field, [&](const glm::dvec3& position, float value, std::int32_t) {
        const double expected = std::min(brute_force_distance(triangles, position) - 0.9 * h, 4.0 * h);
        ASSERT_NEAR(value, expected, 1e-6 * h);
    });
    EXPECT_EQ(field.features, std::vector<sdf::Feature>(mesh.triangles.size(), sdf::Feature::kSheet));
}

TEST(MeshToSdf, WallsThinnerThanAVoxelAreThickenedAndNamed) {
    // Turned, so that the wall crosses the lattice in every phase.
    const glm::dmat4 turn = rotation(0.4, {1, 2, 3});
    const sdf::SampledField thin = bake(moved(box({0.5f, 0.5f, 0.005f}), turn), 32);
    EXPECT_EQ(thin.info.mesh_class, sdf::MeshClass::kSolid);
    EXPECT_GT(thin.info.half_thickness, 0.0);
    ASSERT_EQ(thin.info.warnings.size(), 1u);
    EXPECT_NE(thin.info.warnings[0].find("--resolution"), std::string::npos) << thin.info.warnings[0];

    const sdf::SampledField thick = bake(moved(box({0.5f, 0.5f, 0.25f}), turn), 32);
    EXPECT_EQ(thick.info.half_thickness, 0.0);
    EXPECT_TRUE(thick.info.warnings.empty());
}

TEST(MeshToSdf, ErrorFallsWithTheSquareOfTheVoxel) {
    // A torus of fine facets is smooth at these voxels: trilinear interpolation is of the second order.
    const core::Mesh mesh = torus(1.0f, 0.4f, 256, 128);
    const sdf::FieldInfo coarse = bake(mesh, 24).info, fine = bake(mesh, 48).info;
    const double coarse_error = coarse.error_voxels.mean * coarse.voxel_size;
    const double fine_error = fine.error_voxels.mean * fine.voxel_size;
    EXPECT_NEAR(coarse_error / fine_error, 4.0, 0.6);
    EXPECT_LE(fine.error_voxels.mean, fine.error_voxels.p99);
    EXPECT_LE(fine.error_voxels.p99, fine.error_voxels.max);
    EXPECT_LT(fine.error_voxels.max, 0.1);
}

TEST(MeshToSdf, ScaleAndPlaceDoNotChangeTheLattice) {
    const sdf::SampledField unit = bake(icosphere(2), 20);
    for (const float scale : {0x1p-20f, 0x1p20f}) {
        core::Mesh mesh = icosphere(2);
        for (glm::vec3& p : mesh.positions) p *= scale;
        const sdf::SampledField scaled = bake(mesh, 20);
        ASSERT_EQ(scaled.leaves.size(), unit.leaves.size());
        for (std::size_t i = 0; i < unit.leaves.size(); ++i) {
            ASSERT_EQ(scaled.leaves[i].active, unit.leaves[i].active);
            ASSERT_EQ(scaled.leaves[i].triangle, unit.leaves[i].triangle);
        }
    }
}

}  // namespace
}  // namespace tests
