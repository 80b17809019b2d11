#include "core/scene/tangent_space.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

const std::vector<glm::vec3> kSquare = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const std::vector<glm::vec3> kUp(4, glm::vec3(0, 0, 1));
const std::vector<glm::uvec3> kTwoTriangles = {{0, 1, 2}, {0, 2, 3}};

TEST(TangentSpace, FollowsUAndHandednessPointsUpThePicture) {
    // An upright picture: u along x, v against y.
    const std::vector<glm::vec2> uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    for (const glm::vec4& tangent : core::corner_tangents(kSquare, kUp, uvs, kTwoTriangles)) {
        EXPECT_EQ(tangent, glm::vec4(1, 0, 0, 1));
    }
}

TEST(TangentSpace, MirroredPicturesHaveNegativeHandedness) {
    const std::vector<glm::vec2> uvs = {{1, 1}, {0, 1}, {0, 0}, {1, 0}};
    for (const glm::vec4& tangent : core::corner_tangents(kSquare, kUp, uvs, kTwoTriangles)) {
        EXPECT_EQ(tangent, glm::vec4(-1, 0, 0, -1));
    }
}

TEST(TangentSpace, IsPerpendicularToTheNormal) {
    const std::vector<glm::vec2> uvs = {{0, 1}, {1, 0.7f}, {1, 0}, {0.2f, 0}};
    std::vector<glm::vec3> normals;
    for (const float tilt : {0.3f, -0.6f, 0.1f, 0.9f}) {
        normals.push_back(glm::normalize(glm::vec3(tilt, 0.5f * tilt, 1)));
    }
    const auto tangents = core::corner_tangents(kSquare, normals, uvs, kTwoTriangles);
    for (std::size_t i = 0; i < tangents.size(); ++i) {
        const std::uint32_t vertex = kTwoTriangles[i / 3][static_cast<int>(i % 3)];
        // Float rounding of a unit vector.
        EXPECT_NEAR(glm::dot(glm::vec3(tangents[i]), normals[vertex]), 0.0f, 1e-6f);
        EXPECT_NEAR(glm::length(glm::vec3(tangents[i])), 1.0f, 1e-6f);
    }
}

TEST(TangentSpace, CopiesOfAVertexAreAveragedTogether) {
    // The same bent strip once with shared vertices and once with copies.
    const std::vector<glm::vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}};
    const std::vector<glm::vec2> uvs = {{0, 1}, {1, 1}, {0, 0}, {1, 0.3f}};
    const std::vector<glm::uvec3> shared = {{0, 1, 2}, {1, 3, 2}};
    const auto expected = core::corner_tangents(positions, kUp, uvs, shared);
    std::vector<glm::vec3> split_positions;
    std::vector<glm::vec2> split_uvs;
    for (const glm::uvec3& triangle : shared) {
        for (int corner = 0; corner < 3; ++corner) {
            split_positions.push_back(positions[triangle[corner]]);
            split_uvs.push_back(uvs[triangle[corner]]);
        }
    }
    const std::vector<glm::vec3> normals(6, glm::vec3(0, 0, 1));
    const std::vector<glm::uvec3> split = {{0, 1, 2}, {3, 4, 5}};
    EXPECT_EQ(core::corner_tangents(split_positions, normals, split_uvs, split), expected);
}

TEST(TangentSpace, WeighsFacesByTheirAngle) {
    // Two faces meet at the origin: one of 90 degrees with u along +x, and one of 45 degrees. Over the
    // second, the step a (0, 1) + b (-1, 1) with dv = -a - 2 b = 0 and du = -b > 0 is a = 2, b = -1: u along
    // (1, 1).
    const std::vector<glm::vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 1, 0}};
    const std::vector<glm::vec2> uvs = {{0, 0}, {1, 0}, {0, -1}, {-1, -2}};
    const auto tangents =
        core::corner_tangents(positions, kUp, uvs, std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}});
    const double right_angle = std::acos(0.0);
    const glm::dvec2 expected =
        glm::normalize(right_angle * glm::dvec2(1, 0) + 0.5 * right_angle * glm::normalize(glm::dvec2(1, 1)));
    // Float rounding of a unit vector.
    EXPECT_NEAR(tangents[0].x, expected.x, 1e-6);
    EXPECT_NEAR(tangents[0].y, expected.y, 1e-6);
}

TEST(TangentSpace, WithoutTextureAreaAnyPerpendicularDirectionWillDo) {
    const std::vector<glm::vec2> uvs(4, glm::vec2(0.5f));
    for (const glm::vec4& tangent : core::corner_tangents(kSquare, kUp, uvs, kTwoTriangles)) {
        EXPECT_NEAR(glm::length(glm::vec3(tangent)), 1.0f, 1e-6f);
        EXPECT_NEAR(tangent.z, 0.0f, 1e-6f);
        EXPECT_EQ(std::abs(tangent.w), 1.0f);
    }
}

}  // namespace
