#include "sdf/bake_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

/// A baked field in voxels, as the bake measures it, to be spoilt.
struct Baked {
    explicit Baked(const core::Mesh& mesh, int resolution) : Baked(mesh, bake(mesh, resolution)) {}
    Baked(const core::Mesh& mesh, const sdf::SampledField& field)
        : leaves(field.leaves), corners(triangles_of(mesh)), features(field.features) {
        const double h = field.info.voxel_size;
        for (sdf::Triangle& triangle : corners) {
            for (glm::dvec3* corner : {&triangle.a, &triangle.b, &triangle.c}) {
                *corner = (*corner - field.info.origin) / h;
            }
        }
        for (sdf::FieldLeaf& leaf : leaves) {
            for (float& value : leaf.distance) value = static_cast<float>(value / h);
        }
        features.resize(corners.size(), sdf::Feature::kSurface);
        std::vector<std::uint32_t> solid, sheet;
        for (std::uint32_t i = 0; i < corners.size(); ++i) {
            (features[i] == sdf::Feature::kSheet ? sheet : solid).push_back(i);
        }
        solids = std::make_unique<sdf::TriangleBvh>(corners, solid);
        sheets = std::make_unique<sdf::TriangleBvh>(corners, sheet);
        winding = std::make_unique<sdf::WindingNumber>(*solids);
    }

    sdf::BakedSurfaces surfaces() const { return {corners, features, *solids, *sheets, *winding}; }
    sdf::ErrorFigures mesh_to_field() const { return sdf::measure_error(surfaces(), sdf::LeafMap(leaves)); }
    sdf::ErrorFigures field_to_mesh() const { return sdf::measure_field_error(surfaces(), leaves); }

    std::vector<sdf::FieldLeaf> leaves;
    std::vector<sdf::Triangle> corners;
    std::vector<sdf::Feature> features;
    std::unique_ptr<sdf::TriangleBvh> solids, sheets;
    std::unique_ptr<sdf::WindingNumber> winding;
};

constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

TEST(BakeError, OfASphereIsThatOfTrilinearInterpolation) {
    // Interpolation adds u (1 - u) / 2 times the second derivative along each axis: on a sphere of radius r
    // 1 / (6 r) in the mean and 1 / (4 r) at most. Its facets are flatter than a tenth of that.
    for (const double radius : {8.0, 16.0}) {
        const sdf::FieldInfo info = bake(icosphere(6), static_cast<int>(2.0 * radius)).info;
        for (const sdf::ErrorFigures& error : {info.error_voxels, info.error_field_voxels}) {
            EXPECT_NEAR(error.mean, 1.0 / (6.0 * radius), 0.1 / (6.0 * radius));
            EXPECT_LE(error.p99, 1.1 / (4.0 * radius));
            EXPECT_GE(error.p99, 0.7 / (4.0 * radius));
            EXPECT_LE(error.max, 1.2 / (4.0 * radius));
        }
    }
}

TEST(BakeError, OfThickenedFeaturesIsWithoutTheirHalfThickness) {
    // A plate within the lattice's planes: both surfaces are flat, and only its rim is not.
    const sdf::FieldInfo sheet = bake(quad(1.0f, 1.0f, 3, 3), 48).info;
    EXPECT_LT(sheet.error_field_voxels.mean, 0.05);
    const sdf::FieldInfo wall = bake(moved(box({0.5f, 0.5f, 0.003f}), rotation(0.4, {1, 2, 3})), 32).info;
    ASSERT_GT(wall.half_thickness, 0.0);
    EXPECT_LT(wall.error_field_voxels.mean, 0.1);
    EXPECT_LT(wall.error_field_voxels.p99, 0.5);
}

TEST(BakeError, SurfacesThatTheMeshHasNotAreSeenFromTheFieldAlone) {
    Baked ball(icosphere(4), 32);
    const sdf::ErrorFigures before = ball.mesh_to_field();
    EXPECT_LT(ball.field_to_mesh().max, 0.1);
    int specks = 0;
    for (sdf::FieldLeaf& leaf : ball.leaves) {
        for (int i = 0; i < sdf::kLeafSize; ++i) {
            float& value = leaf.distance[static_cast<std::size_t>(i)];
            if (!leaf.is_active(i) || value < 2.5f || value > 2.9f || i % 7 != 0) continue;
            value = -1.0f;
            ++specks;
        }
    }
    ASSERT_GT(specks, 10);
    EXPECT_EQ(ball.mesh_to_field().max, before.max);
    EXPECT_GT(ball.field_to_mesh().max, 1.5);
}

TEST(BakeError, SurfacesThatTheFieldHasNotAreSeenFromTheMeshAlone) {
    Baked ball(merged(icosphere(4), moved(icosphere(3, 0.4f), translation({2.0, 0.0, 0.0}))), 48);
    // The small ball's inside is made outside.
    for (sdf::FieldLeaf& leaf : ball.leaves) {
        for (int i = 0; i < sdf::kLeafSize; ++i) {
            const std::int32_t triangle = leaf.triangle[static_cast<std::size_t>(i)];
            float& value = leaf.distance[static_cast<std::size_t>(i)];
            if (triangle >= 20 * 256) value = std::abs(value) + 1.0f;
        }
    }
    EXPECT_GT(ball.mesh_to_field().max, 0.9);
    EXPECT_LT(ball.field_to_mesh().max, 0.1);
}

TEST(SignMismatches, AreNoneInWhatTheBakeMakes) {
    core::Mesh holed = icosphere(4);
    std::erase_if(holed.triangles, [](const glm::uvec3& t) { return t.x % 20 == 3; });
    const core::Mesh shells = merged(icosphere(3), moved(icosphere(3), translation({0.5, 0.2, 0.1})));
    for (const core::Mesh& mesh : {icosphere(4), reversed(torus(1.0f, 0.4f)), holed, shells,
                                   merged(box(), moved(quad(2.0f, 2.0f), translation({0.0, 0.0, 2.0})))}) {
        const sdf::FieldInfo info = bake(mesh, 32).info;
        EXPECT_GT(info.sign_mismatches.samples, 20u);
        EXPECT_LE(info.sign_mismatches.samples, 3'000u);
        EXPECT_EQ(info.sign_mismatches.wrong, 0u);
    }
    EXPECT_EQ(bake(box({0.5f, 0.5f, 0.003f}), 32).info.sign_mismatches.wrong, 0u);
    const sdf::FieldInfo sheet = bake(quad(), 24).info;
    EXPECT_EQ(sheet.sign_mismatches.samples, 0u) << "a sheet has no inside";
}

TEST(SignMismatches, AreCountedToTheLast) {
    Baked ball(icosphere(3), 24);
    ASSERT_EQ(sdf::count_sign_mismatches(ball.surfaces(), ball.leaves, kAll).wrong, 0u);
    std::uint32_t samples = 0, turned = 0;
    for (sdf::FieldLeaf& leaf : ball.leaves) {
        for (int i = 0; i < sdf::kLeafSize; ++i) {
            float& value = leaf.distance[static_cast<std::size_t>(i)];
            if (!leaf.is_active(i) || !(std::abs(value) > 0.01f)) continue;
            ++samples;
            if (i % 50 != 0) continue;
            value = -value;
            ++turned;
        }
    }
    const sdf::SignMismatches all = sdf::count_sign_mismatches(ball.surfaces(), ball.leaves, kAll);
    EXPECT_EQ(all.samples, samples);
    EXPECT_EQ(all.wrong, turned);
    // One sample in fifty is wrong: among two thousand, about forty.
    const sdf::SignMismatches some = sdf::count_sign_mismatches(ball.surfaces(), ball.leaves);
    EXPECT_LT(some.samples, 3'000u);
    EXPECT_NEAR(some.wrong, some.samples / 50.0, 4.0 * std::sqrt(some.samples / 50.0));
}

}  // namespace
}  // namespace tests
