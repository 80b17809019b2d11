#include "core/scene/camera.h"

#include <gtest/gtest.h>

#include <cmath>

namespace {

/// Rays and their checks go through floats: a few roundings of 6e-8 at coordinates near ten.
constexpr double kFloatRounding = 5e-6;

core::Camera test_camera() {
    core::Camera camera = core::look_at({1, 2, 3}, {-2, 1, -4}, {0.1, 1, 0}, 0.9);
    camera.near_distance = 0.5;
    camera.far_distance = 20.0;
    return camera;
}

core::Camera orthographic_camera() {
    core::Camera camera = test_camera();
    camera.orthographic = true;
    camera.magnification = {7.0, 2.0};
    return camera;
}

glm::vec3 along(const core::Ray& ray, float t) {
    return ray.origin + t * ray.direction;
}

TEST(Camera, LooksAtItsTargetThroughTheMiddle) {
    const core::CameraRays rays(test_camera(), 64, 48);
    const core::Ray ray = rays.ray({32.0f, 24.0f});
    const glm::vec3 expected = glm::normalize(glm::vec3(-3, -1, -7));
    EXPECT_LT(glm::length(ray.direction - expected), kFloatRounding);
    EXPECT_EQ(ray.origin, glm::vec3(1, 2, 3));
}

TEST(Camera, VerticalFieldOfViewSpansThePictureAtAnyShape) {
    for (const int width : {16, 48, 200}) {
        const core::CameraRays rays(test_camera(), width, 48);
        const core::Ray top = rays.ray({0.5f * static_cast<float>(width), 0.0f});
        const core::Ray bottom = rays.ray({0.5f * static_cast<float>(width), 48.0f});
        EXPECT_NEAR(std::acos(glm::dot(top.direction, bottom.direction)), 0.9, kFloatRounding);
        EXPECT_GT(top.direction.y, bottom.direction.y) << "row 0 is the top";
    }
}

TEST(Camera, PixelsAreSquare) {
    const core::CameraRays rays(test_camera(), 100, 50);
    const glm::vec3 center = rays.ray({50.0f, 25.0f}).direction;
    const glm::vec3 right = rays.ray({51.0f, 25.0f}).direction;
    const glm::vec3 below = rays.ray({50.0f, 26.0f}).direction;
    EXPECT_NEAR(glm::dot(center, right), glm::dot(center, below), kFloatRounding);
}

TEST(Camera, NearAndFarArePlanarDistances) {
    for (const core::Camera& camera : {test_camera(), orthographic_camera()}) {
        const core::CameraRays rays(camera, 64, 48);
        for (const glm::vec2 film : {glm::vec2(0, 0), glm::vec2(64, 48), glm::vec2(10.5f, 30.25f)}) {
            const core::Ray ray = rays.ray(film);
            EXPECT_NEAR(glm::length(ray.direction), 1.0f, kFloatRounding);
            EXPECT_NEAR(rays.depth(along(ray, ray.t_min)), 0.5, kFloatRounding);
            EXPECT_NEAR(rays.depth(along(ray, ray.t_max)), 20.0, 4 * kFloatRounding);
        }
    }
}

TEST(Camera, WithoutAFarPlaneRaysAreEndless) {
    const core::CameraRays rays(core::look_at({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, 1.0), 4, 4);
    EXPECT_EQ(rays.ray({0, 0}).t_max, std::numeric_limits<float>::infinity());
    EXPECT_EQ(rays.ray({0, 0}).t_min, 0.0f);
}

TEST(Camera, OrthographicRaysAreParallelAndKeepTheHalfHeight) {
    const core::CameraRays rays(orthographic_camera(), 60, 40);
    const core::Ray top_left = rays.ray({0, 0});
    const core::Ray bottom_left = rays.ray({0, 40});
    const core::Ray top_right = rays.ray({60, 0});
    EXPECT_EQ(top_left.direction, bottom_left.direction);
    EXPECT_NEAR(glm::distance(top_left.origin, bottom_left.origin), 4.0, kFloatRounding);
    EXPECT_NEAR(glm::distance(top_left.origin, top_right.origin), 6.0, kFloatRounding)
        << "the width follows the picture, not xmag";
}

TEST(Camera, NdcOfARaysPointsIsItsPlaceOnTheFilm) {
    for (const core::Camera& camera : {test_camera(), orthographic_camera()}) {
        const core::CameraRays rays(camera, 64, 48);
        for (const glm::vec2 film : {glm::vec2(0, 0), glm::vec2(64, 0), glm::vec2(12.5f, 40.75f)}) {
            const glm::dvec4 point(glm::dvec3(along(rays.ray(film), 5.0f)), 1.0);
            const glm::dvec4 ndc = rays.ndc_from_world() * point;
            EXPECT_NEAR(ndc.x / ndc.w, film.x / 64.0, kFloatRounding);
            EXPECT_NEAR(ndc.y / ndc.w, film.y / 48.0, kFloatRounding);
            const glm::dvec4 local = rays.camera_from_world() * point;
            EXPECT_NEAR(-local.z, rays.depth(glm::vec3(point)), kFloatRounding);
        }
        EXPECT_GT(std::abs(glm::determinant(rays.ndc_from_world())), 0.0);
    }
}

TEST(Camera, FramingSeesEveryCornerOfTheBox) {
    const core::DoubleBounds boxes[] = {{{-1, -1, -1}, {1, 1, 1}},
                                        {{100, 0, 0}, {900, 1, 1}},
                                        {{0, 0, 0}, {1, 50, 1}},
                                        {{-5, 0, -5}, {5, 0, 5}},
                                        {{1e-3, 1e-3, 1e-3}, {2e-3, 2e-3, 2e-3}}};
    for (const core::DoubleBounds& box : boxes) {
        for (const double aspect : {0.5, 1.0, 2.0}) {
            const core::CameraRays rays(core::framing(box, aspect), static_cast<int>(100 * aspect), 100);
            for (int corner = 0; corner < 8; ++corner) {
                const glm::dvec4 point((corner & 1) ? box.maximum.x : box.minimum.x,
                                       (corner & 2) ? box.maximum.y : box.minimum.y,
                                       (corner & 4) ? box.maximum.z : box.minimum.z, 1.0);
                const glm::dvec4 ndc = rays.ndc_from_world() * point;
                EXPECT_GT(ndc.w, 0.0) << "in front of the camera";
                EXPECT_GE(ndc.x / ndc.w, 0.0);
                EXPECT_LE(ndc.x / ndc.w, 1.0);
                EXPECT_GE(ndc.y / ndc.w, 0.0);
                EXPECT_LE(ndc.y / ndc.w, 1.0);
            }
        }
    }
}

TEST(Camera, FramingOfNothingOrAPointIsStillACamera) {
    for (const core::DoubleBounds& box : {core::DoubleBounds{}, core::DoubleBounds{{3, 3, 3}, {3, 3, 3}},
                                          core::DoubleBounds{{1e20, 1e20, 1e20}, {1e20, 1e20, 1e20}}}) {
        const core::Ray ray = core::CameraRays(core::framing(box, 1.0), 8, 8).ray({4, 4});
        EXPECT_NEAR(glm::length(ray.direction), 1.0f, kFloatRounding);
        EXPECT_TRUE(std::isfinite(ray.origin.x + ray.origin.y + ray.origin.z));
    }
}

}  // namespace
