// The proofs of real meshes (tests/full) on shapes that bake in a moment, and that they notice what they are
// for.
#include <gtest/gtest.h>

#include "core/trace/triangle_tracer.h"
#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/exact_signs.h"
#include "tests/support/sheet_rays.h"

namespace tests {
namespace {

constexpr double kPi = 3.14159265358979323846;

sdf::SampledField bake(const core::Mesh& mesh, double voxel) {
    return sdf::bake_mesh({mesh.positions, mesh.triangles}, {.voxel_size = voxel});
}

/// A wavy cloth: no two of its triangles lie in one plane.
core::Mesh cloth(int cells) {
    core::Mesh mesh = quad(2.0f, 2.0f, cells, cells);
    for (glm::vec3& p : mesh.positions) p.z = 0.2f * std::sin(4.0f * p.x) * std::cos(3.0f * p.y);
    return mesh;
}

TEST(ExactSigns, AgreeWithEachSampleOfClosedSolids) {
    // Overlapping parts, one of them inside out: the winding number has more values than 0 and 1.
    const core::Mesh mesh =
        merged(merged(torus(1.0f, 0.4f, 32, 16), moved(icosphere(2), translation({1, 0.2, 0}))),
               reversed(moved(box(), translation({-2.0, 0.1, 0.3}))));
    const sdf::SampledField field = bake(mesh, 0.08);
    ASSERT_TRUE(has_only_closed_solids(mesh, field));
    const SignAgreement agreement = sign_agreement(mesh, field, 4'000);
    EXPECT_GT(agreement.samples, 3'000u);
    EXPECT_GT(agreement.inside, 500u);
    EXPECT_LT(agreement.inside, agreement.samples - 500u);
    EXPECT_EQ(agreement.wrong, 0u);
}

TEST(ExactSigns, CountSamplesOnTheWrongSide) {
    const core::Mesh mesh = icosphere(2);
    sdf::SampledField field = bake(mesh, 0.1);
    std::size_t flipped = 0;
    for (sdf::FieldLeaf& leaf : field.leaves) {
        for (std::size_t i = 7; i < leaf.distance.size(); i += 50) {
            if (!leaf.is_active(static_cast<int>(i)) || std::abs(leaf.distance[i]) <= 0.01 * 0.1) continue;
            leaf.distance[i] = -leaf.distance[i];
            ++flipped;
        }
    }
    ASSERT_GT(flipped, 100u);
    EXPECT_EQ(sign_agreement(mesh, field, 100'000'000).wrong, flipped);
}

TEST(ExactSigns, AskAtShellsOnlyWhatIsOutside) {
    const core::Mesh plate = box({1.0f, 1.0f, 0.01f});
    const sdf::SampledField field = bake(plate, 0.05);
    ASSERT_GT(field.info.half_thickness, 0.0);
    const SignAgreement agreement = sign_agreement(plate, field, 5'000);
    EXPECT_GT(agreement.samples, 2'000u);
    EXPECT_EQ(agreement.wrong, 0u);
}

TEST(ExactSigns, KnowOpenFromClosed) {
    const core::Mesh closed = icosphere(2);
    core::Mesh open = closed;
    open.triangles.pop_back();
    EXPECT_TRUE(has_only_closed_solids(closed, bake(closed, 0.1)));
    EXPECT_FALSE(has_only_closed_solids(open, bake(open, 0.1)));
    EXPECT_FALSE(has_only_closed_solids(quad(), bake(quad(), 0.1)));
}

/// A sheet and its answers.
struct BakedSheet {
    core::Scene scene;
    std::vector<std::shared_ptr<const sdf::BrickGrid>> grids;

    explicit BakedSheet(core::Scene from) : scene(std::move(from)) {
        sdf::BakeSettings settings;
        settings.resolution = 64;
        grids = sdf::grids_by_mesh(scene, sdf::bake_scene(scene, settings, {}));
    }
};

TEST(SheetRays, NonePassesThroughACloth) {
    core::Scene scene = scene_of(cloth(12), rotation(0.7, glm::normalize(glm::dvec3(1, 2, 3))));
    add_instance(scene, 0, translation({0.3, 0.2, 0.1}) * scaling({1.0, -2.0, 0.5}));
    const BakedSheet sheet(std::move(scene));
    const SheetTargets targets(sheet.scene, sheet.grids);
    ASSERT_FALSE(targets.empty());
    const AimedRays aimed = targets.aim(20'000, 3);
    ASSERT_EQ(aimed.rays.size(), 20'000u);
    const SheetPassages passages =
        count_passages(aimed, sdf::SdfTracer(sheet.scene, sheet.grids), core::TriangleTracer(sheet.scene));
    EXPECT_EQ(passages.passed, 0u) << passages;
    EXPECT_EQ(passages.unoccluded, 0u) << passages;
    EXPECT_LE(passages.unconfirmed, 20u) << passages;
}

/// An open box, and a deck in its opening or a little below.
core::Mesh hull_with_deck(double below) {
    core::Mesh hull = box({0.5f, 1.5f, 0.5f});
    std::erase_if(hull.triangles, [&](const glm::uvec3& corner) {
        return hull.positions[corner.x].y > 1.0f && hull.positions[corner.y].y > 1.0f &&
               hull.positions[corner.z].y > 1.0f;
    });
    const core::Mesh open = make_mesh("hull", hull.positions, hull.normals, {}, hull.triangles);
    return merged(open, moved(quad(0.9f, 0.9f, 3, 3), translation({0.0, 1.5 - below, 0.0}) *
                                                          rotation(0.5 * kPi, glm::dvec3(1, 0, 0))));
}

TEST(Rims, AHoleIsAsWideAsItsTrianglesLeaveIt) {
    core::Mesh mesh = box({0.5f, 0.5f, 0.5f});
    std::erase_if(mesh.triangles, [&](const glm::uvec3& corner) {
        return mesh.positions[corner.x].y > 0.0f && mesh.positions[corner.y].y > 0.0f &&
               mesh.positions[corner.z].y > 0.0f;
    });
    const BakedSheet open(scene_of(make_mesh("open box", mesh.positions, mesh.normals, {}, mesh.triangles)));
    ASSERT_EQ(open.grids[0]->info().mesh_class, sdf::MeshClass::kSolid);
    const double h = open.grids[0]->voxel_size();
    TestRandom random(5);
    std::vector<core::Ray> rays;
    for (int i = 0; i < 10'000; ++i) {
        // Down through the opening, where the winding number's lid lies within two voxels of a wall.
        const glm::dvec3 through(0.5 - h * random.uniform(0.05, 2.0), 0.5, random.uniform(-0.4, 0.4));
        const glm::dvec3 direction = random.cosine_direction({0.0, -1.0, 0.0});
        rays.push_back(make_ray(through - direction, direction));
    }
    const core::RayStream stream = stream_of(rays);
    core::HitStream ours, theirs;
    sdf::SdfTracer(open.scene, open.grids).trace_closest(stream, ours);
    core::TriangleTracer(open.scene).trace_closest(stream, theirs);
    std::size_t off = 0;
    for (std::size_t i = 0; i < stream.size(); ++i) {
        off += !ours.get(i).hit() || std::abs(ours.t[i] - theirs.t[i]) > h;
    }
    EXPECT_EQ(off, 0u);
}

TEST(SheetRays, NonePassesADeckInTheOpeningOfAHull) {
    // The deck's sides lie on either side of where the winding number closes the hull, or it lies inside, and
    // always differently between samples.
    for (double below = 0.0; below < 0.1; below += 0.009) {
        const BakedSheet hull(scene_of(hull_with_deck(below)));
        ASSERT_EQ(hull.grids[0]->info().mesh_class, sdf::MeshClass::kMixed);
        const SheetTargets targets(hull.scene, hull.grids);
        const AimedRays aimed = targets.aim(5'000, 7);
        const SheetPassages passages =
            count_passages(aimed, sdf::SdfTracer(hull.scene, hull.grids), core::TriangleTracer(hull.scene));
        EXPECT_EQ(passages.passed, 0u) << below << ": " << passages;
    }
}

TEST(SheetRays, CountThoseThatAHoleLetsThrough) {
    const BakedSheet whole(scene_of(cloth(12)));
    core::Mesh holed = cloth(12);
    holed.triangles.erase(holed.triangles.begin() + 100);
    const BakedSheet sheet(scene_of(holed));
    const SheetTargets targets(whole.scene, whole.grids);
    const SheetPassages passages = count_passages(
        targets.aim(20'000, 3), sdf::SdfTracer(sheet.scene, sheet.grids), core::TriangleTracer(whole.scene));
    // One of 288 triangles, less what lies at borders.
    EXPECT_GT(passages.passed, 20u) << passages;
    EXPECT_EQ(passages.passed, passages.unoccluded) << passages;
}

TEST(SheetRays, AreAimedOffBordersFromBothSides) {
    const BakedSheet sheet(scene_of(quad(2.0f, 1.0f, 4, 2)));
    const AimedRays aimed = SheetTargets(sheet.scene, sheet.grids).aim(5'000, 1);
    const double h = sheet.grids[0]->voxel_size();
    std::size_t above = 0;
    for (std::size_t i = 0; i < aimed.rays.size(); ++i) {
        const core::Ray ray = aimed.rays.get(i);
        const glm::vec3 point = ray.origin + aimed.target[i] * ray.direction;
        EXPECT_NEAR(point.z, 0.0, 1e-5);
        EXPECT_LT(std::abs(point.x), 1.0 - 0.999 * h);
        EXPECT_LT(std::abs(point.y), 0.5 - 0.999 * h);
        EXPECT_NEAR(aimed.voxel[i], h, 1e-6);
        above += ray.origin.z > 0.0f;
    }
    EXPECT_NEAR(static_cast<double>(above), 2'500.0, 250.0);
}

}  // namespace
}  // namespace tests
