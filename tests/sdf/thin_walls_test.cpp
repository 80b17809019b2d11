// Walls that the lattice misses: named by where and how thin they are, and by a resolution that holds them.
#include "sdf/thin_walls.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <optional>

#include "sdf/baker.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

struct Warning {
    std::string text;
    double thickness = 0.0;
    glm::dvec3 at{0.0};
    int resolution = 0;  ///< 0 where none is recommended.
};

std::optional<Warning> wall_warning(const sdf::FieldInfo& info) {
    for (const std::string& text : info.warnings) {
        const auto start = text.find("the thinnest is ");
        if (start == std::string::npos) continue;
        Warning warning{text};
        EXPECT_EQ(std::sscanf(text.c_str() + start, "the thinnest is %lf thick, at (%lf, %lf, %lf)",
                              &warning.thickness, &warning.at.x, &warning.at.y, &warning.at.z),
                  4)
            << text;
        const auto flag = text.find("; --resolution ");
        if (flag != std::string::npos) {
            EXPECT_EQ(std::sscanf(text.c_str() + flag, "; --resolution %d would", &warning.resolution), 1);
        }
        return warning;
    }
    return std::nullopt;
}

sdf::FieldInfo bake_at(const core::Mesh& mesh, int resolution) {
    const core::Scene scene = scene_of(mesh);
    sdf::BakeSettings settings;
    settings.resolution = resolution;
    return sdf::bake_scene(scene, settings, {}).meshes.at(0).info();
}

/// A shell between two spheres: walls without a rim.
core::Mesh hollow_ball(float thickness) {
    return merged(icosphere(4), reversed(icosphere(4, 1.0f - thickness)));
}

TEST(ThinWalls, AreMendedByTheResolutionThatIsPrinted) {
    const glm::dmat4 turn = rotation(0.4, {1, 2, 3});
    const struct {
        const char* name;
        core::Mesh mesh;
        int resolution;
        double thickness;
    } cases[] = {
        {"plate", moved(box({0.5f, 0.5f, 0.01f}), turn), 32, 0.02},
        {"rod", moved(box({0.5f, 0.012f, 0.02f}), turn), 24, 0.024},
        {"cylinder", moved(cylinder(0.02f, 1.0f, 48), turn), 24, 0.04},
        {"hollow ball", hollow_ball(0.04f), 24, 0.04},
        {"two plates",
         merged(moved(box({0.5f, 0.5f, 0.01f}), turn),
                moved(moved(box({0.5f, 0.5f, 0.02f}), turn), translation({0.3, 0.2, 0.8}))),
         24, 0.02},
    };
    for (const auto& one : cases) {
        const auto warning = wall_warning(bake_at(one.mesh, one.resolution));
        ASSERT_TRUE(warning) << one.name;
        // A facet is nearer than the shape it stands for, by a few percent.
        EXPECT_NEAR(warning->thickness, one.thickness, 0.1 * one.thickness) << one.name;
        ASSERT_GT(warning->resolution, one.resolution) << one.name << ": " << warning->text;
        const sdf::FieldInfo mended = bake_at(one.mesh, warning->resolution);
        const auto left = wall_warning(mended);
        EXPECT_FALSE(left) << one.name << " at " << warning->resolution << ": " << left->text;
        EXPECT_EQ(mended.half_thickness, 0.0) << one.name << ": something is still thickened";
    }
}

TEST(ThinWalls, TheThinnestIsNamedByItsPlace) {
    core::Mesh mesh = moved(box({0.5f, 0.5f, 0.02f}), translation({0.0, 0.0, -1.0}));
    mesh = merged(mesh, moved(box({0.5f, 0.5f, 0.006f}), translation({0.0, 0.0, 1.0})));
    const auto warning = wall_warning(bake_at(mesh, 20));
    ASSERT_TRUE(warning);
    EXPECT_NEAR(warning->thickness, 0.012, 1e-4);
    EXPECT_NEAR(std::abs(warning->at.z - 1.0), 0.006, 1e-4) << warning->text;
}

TEST(ThinWalls, NoResolutionIsPrintedThatABakeWouldNotUse) {
    const core::Mesh foil = moved(box({0.5f, 0.5f, 0.0005f}), rotation(0.4, {1, 2, 3}));
    const auto warning = wall_warning(bake_at(foil, 32));
    ASSERT_TRUE(warning);
    EXPECT_EQ(warning->resolution, 0) << warning->text;
    EXPECT_NE(warning->text.find("no --resolution up to 1024 would hold them"), std::string::npos)
        << warning->text;
    // Foil and a board: most can be mended.
    const auto most =
        wall_warning(bake_at(merged(moved(box({0.01f, 0.01f, 0.0005f}), translation({0.0, 0.0, 0.5})),
                                    moved(box({0.5f, 0.5f, 0.01f}), rotation(0.4, {1, 2, 3}))),
                             32));
    ASSERT_TRUE(most);
    EXPECT_NE(most->text.find("nine tenths of them, none up to 1024 all"), std::string::npos) << most->text;
}

TEST(ThinWalls, SharpEdgesAreNoWalls) {
    // A wedge runs out to nothing at any voxel: no resolution is recommended for it.
    core::Mesh wedge = box({0.5f, 0.5f, 0.25f});
    for (glm::vec3& position : wedge.positions) {
        if (position.x > 0.0f) position.z *= 0.001f;
    }
    wedge = moved(make_mesh("wedge", wedge.positions, {}, {}, wedge.triangles), rotation(0.4, {1, 2, 3}));
    const sdf::FieldInfo info = bake_at(wedge, 32);
    EXPECT_FALSE(wall_warning(info));
    ASSERT_EQ(info.warnings.size(), 1u);
    EXPECT_NE(info.warnings[0].find("sharp edges"), std::string::npos) << info.warnings[0];
}

}  // namespace
}  // namespace tests
