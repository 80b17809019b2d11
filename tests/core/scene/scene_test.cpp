#include "core/scene/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "core/support/error.h"

namespace {

core::Mesh triangle() {
    core::Mesh mesh;
    mesh.name = "triangle";
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}};
    mesh.normals.assign(3, {0, 0, 1});
    mesh.uvs[0] = {{0, 0}, {1, 0}, {0, 1}};
    mesh.triangles = {{0, 1, 2}};
    mesh.parts = {{0, 1}};
    mesh.part_of_triangle = {0};
    for (const glm::vec3& position : mesh.positions) mesh.bounds.include(position);
    return mesh;
}

core::Scene small_scene() {
    core::Scene scene;
    scene.meshes.push_back(triangle());
    scene.materials.resize(2);
    scene.instances.push_back(core::make_instance("one", 0, {0}, glm::dmat4(1.0)));
    scene.instances.push_back(
        core::make_instance("two", 0, {1}, glm::translate(glm::dmat4(1.0), glm::dvec3(10, 0, 0))));
    scene.lights.emplace_back(core::PointLight{});
    scene.images.push_back({"", 1, 1, {1, 2, 3, 4}});
    scene.textures.push_back({});
    return scene;
}

TEST(Scene, InstancesInvertTheirTransform) {
    const glm::dmat4 world_from_local =
        glm::scale(glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(1, 2, 3)), 0.7,
                               glm::normalize(glm::dvec3(1, 1, 0))),
                   glm::dvec3(-2.0, 1e-3, 5.0));
    const core::Instance instance = core::make_instance("i", 0, {}, world_from_local);
    const glm::dmat4 product = instance.local_from_world * world_from_local;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row) {
            // The condition number of 5e3 times a double's rounding, with room.
            EXPECT_NEAR(product[column][row], column == row ? 1.0 : 0.0, 1e-11);
        }
    }
}

TEST(Scene, NormalsStayPerpendicularUnderNonUniformScale) {
    const glm::dmat4 world_from_local = glm::scale(glm::dmat4(1.0), glm::dvec3(4.0, 1.0, 1.0));
    const core::Instance instance = core::make_instance("i", 0, {}, world_from_local);
    const glm::vec3 tangent(glm::dvec3(world_from_local * glm::dvec4(1, -1, 0, 0)));
    EXPECT_NEAR(glm::dot(instance.normal_from_local * glm::vec3(1, 1, 0), tangent), 0.0f, 1e-6f);
}

TEST(Scene, SmallAndMirroredTransformsAreFine) {
    EXPECT_NO_THROW(core::make_instance("i", 0, {}, glm::scale(glm::dmat4(1.0), glm::dvec3(1e-9))));
    EXPECT_NO_THROW(core::make_instance("i", 0, {}, glm::scale(glm::dmat4(1.0), glm::dvec3(1, -1, 1e-6))));
}

TEST(Scene, SingularTransformsAreRefusedByName) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    glm::dmat4 flattened(1.0);
    flattened[2] = flattened[0] + flattened[1];
    for (const glm::dmat4& matrix : {glm::scale(glm::dmat4(1.0), glm::dvec3(1, 0, 1)),
                                     glm::scale(glm::dmat4(1.0), glm::dvec3(nan, 1, 1)),
                                     glm::scale(glm::dmat4(1.0), glm::dvec3(infinity, 1, 1)), flattened}) {
        try {
            core::make_instance("bent", 0, {}, matrix);
            ADD_FAILURE() << "no error";
        } catch (const core::InputError& error) {
            EXPECT_EQ(error.kind(), core::ErrorKind::kBadData);
            EXPECT_NE(std::string(error.what()).find("'bent'"), std::string::npos);
        }
    }
}

TEST(Scene, BoundsCoverAllInstances) {
    const core::DoubleBounds bounds = core::world_bounds(small_scene());
    EXPECT_EQ(bounds.minimum, glm::dvec3(0, 0, 0));
    EXPECT_EQ(bounds.maximum, glm::dvec3(11, 2, 0));
    EXPECT_TRUE(core::world_bounds({}).empty());
}

TEST(Scene, DrawnTrianglesCountInstances) {
    EXPECT_EQ(core::drawn_triangle_count(small_scene()), 2u);
}

TEST(Scene, OnlyEmissionInUseMakesItEmissive) {
    core::Scene scene = small_scene();
    scene.materials.resize(3);
    scene.materials[2].emission = glm::vec3(1);
    EXPECT_FALSE(core::has_emissive_surface(scene)) << "no instance uses material 2";
    scene.instances[1].materials[0] = 2;
    EXPECT_TRUE(core::has_emissive_surface(scene));
}

TEST(Scene, CoordinatesAreInterpolated) {
    core::Mesh mesh = triangle();
    mesh.colors = {{0, 0, 0, 0}, {1, 0, 0, 1}, {0, 1, 0, 1}};
    const core::SurfaceCoordinates at = core::surface_coordinates(mesh, 0, {0.25f, 0.5f});
    EXPECT_EQ(at.uv[0], glm::vec2(0.25f, 0.5f));
    EXPECT_EQ(at.uv[1], glm::vec2(0.0f));
    EXPECT_EQ(at.color, glm::vec4(0.25f, 0.5f, 0.0f, 0.75f));
    mesh.colors.clear();
    EXPECT_EQ(core::surface_coordinates(mesh, 0, {0.25f, 0.5f}).color, glm::vec4(1));
}

TEST(Scene, HashIgnoresNamesAndCameras) {
    core::Scene scene = small_scene();
    const std::string hash = core::scene_hash(scene);
    EXPECT_EQ(hash.size(), 32u);
    scene.name = "other";
    scene.meshes[0].name = "other";
    scene.instances[0].name = "other";
    scene.materials[0].name = "other";
    scene.images[0].name = "other";
    std::get<core::PointLight>(scene.lights[0]).name = "other";
    scene.cameras.emplace_back();
    EXPECT_EQ(core::scene_hash(scene), hash);
}

TEST(Scene, HashFollowsWhateverDecidesThePicture) {
    const std::string hash = core::scene_hash(small_scene());
    const std::function<void(core::Scene&)> changes[] = {
        [](core::Scene& s) { s.meshes[0].positions[1].x = 1.0000001f; },
        [](core::Scene& s) { s.meshes[0].normals[1].x = 0.1f; },
        [](core::Scene& s) { std::swap(s.meshes[0].triangles[0].x, s.meshes[0].triangles[0].y); },
        [](core::Scene& s) { s.meshes[0].uvs[0][1].x = 0.5f; },
        [](core::Scene& s) { s.instances[0].world_from_local[3].x = 1e-9; },
        [](core::Scene& s) { s.instances[0].materials[0] = 1; },
        [](core::Scene& s) { s.materials[0].roughness = 0.5f; },
        [](core::Scene& s) { s.materials[0].base_color_texture.texture = 0; },
        [](core::Scene& s) { s.materials[0].specular = 0.0f; },
        [](core::Scene& s) { s.materials[0].alpha_mode = core::AlphaMode::kMask; },
        [](core::Scene& s) { s.images[0].rgba[2] = 0; },
        [](core::Scene& s) { s.textures[0].nearest = true; },
        [](core::Scene& s) { std::get<core::PointLight>(s.lights[0]).intensity.x = 1.0f; },
        [](core::Scene& s) { s.lights[0] = core::DirectionalLight{}; },
        [](core::Scene& s) { s.sky = core::Sky::constant(glm::vec3(1.0f)); },
    };
    int number = 0;
    for (const auto& change : changes) {
        core::Scene scene = small_scene();
        change(scene);
        EXPECT_NE(core::scene_hash(scene), hash) << "change " << number;
        ++number;
    }
}

}  // namespace
