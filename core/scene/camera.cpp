#include "core/scene/camera.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace core {

CameraRays::CameraRays(const Camera& camera, int width, int height)
    : world_from_camera_(camera.world_from_camera),
      camera_from_world_(glm::inverse(camera.world_from_camera)),
      orthographic_(camera.orthographic),
      film_from_pixels_(2.0 / width, 2.0 / height),
      near_distance_(camera.near_distance),
      far_distance_(camera.far_distance) {
    assert(width > 0 && height > 0);
    const double half_height = orthographic_ ? camera.magnification.y : std::tan(0.5 * camera.vertical_fov);
    half_extent_ = {half_height * width / height, half_height};
}

Ray CameraRays::ray(const glm::vec2& film_pixels) const {
    const glm::dvec2 film(film_pixels.x * film_from_pixels_.x - 1.0,
                          1.0 - film_pixels.y * film_from_pixels_.y);
    const glm::dvec2 on_plane = film * half_extent_;
    glm::dvec3 origin(0.0);
    glm::dvec3 direction(0.0, 0.0, -1.0);
    double distance_per_depth = 1.0;
    if (orthographic_) {
        origin = glm::dvec3(on_plane, 0.0);
    } else {
        direction = glm::dvec3(on_plane, -1.0);
        distance_per_depth = glm::length(direction);
        direction /= distance_per_depth;
    }
    Ray result;
    result.origin = glm::vec3(glm::dvec3(world_from_camera_ * glm::dvec4(origin, 1.0)));
    result.direction = glm::vec3(glm::normalize(glm::dmat3(world_from_camera_) * direction));
    result.t_min = static_cast<float>(near_distance_ * distance_per_depth);
    result.t_max = static_cast<float>(far_distance_ * distance_per_depth);
    return result;
}

float CameraRays::depth(const glm::vec3& world_position) const {
    return static_cast<float>(-(camera_from_world_ * glm::dvec4(glm::dvec3(world_position), 1.0)).z);
}

// GLM multiplies columns and OpenEXR rows, but GLM also stores by columns: element [i][j] is the same number
// in both, so the matrices below are copied element by element.
glm::dmat4 CameraRays::camera_from_world() const {
    return camera_from_world_;
}

glm::dmat4 CameraRays::ndc_from_world() const {
    glm::dmat4 ndc_from_camera(0.0);
    ndc_from_camera[0][0] = 0.5 / half_extent_.x;
    ndc_from_camera[1][1] = -0.5 / half_extent_.y;
    if (orthographic_) {
        ndc_from_camera[2][2] = -1.0;
        ndc_from_camera[3] = glm::dvec4(0.5, 0.5, 0.0, 1.0);
    } else {
        // w is the planar distance; z = 1 becomes its reciprocal, which keeps the matrix invertible.
        ndc_from_camera[2] = glm::dvec4(-0.5, -0.5, 0.0, -1.0);
        ndc_from_camera[3][2] = 1.0;
    }
    return ndc_from_camera * camera_from_world_;
}

Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up, double vertical_fov) {
    const glm::dvec3 backward = glm::normalize(eye - target);
    const glm::dvec3 right = glm::cross(up, backward);
    assert(glm::length(right) > 0.0);
    const glm::dvec3 x = glm::normalize(right);
    Camera camera;
    camera.world_from_camera = glm::dmat4(glm::dvec4(x, 0.0), glm::dvec4(glm::cross(backward, x), 0.0),
                                          glm::dvec4(backward, 0.0), glm::dvec4(eye, 1.0));
    camera.vertical_fov = vertical_fov;
    return camera;
}

Camera framing(const DoubleBounds& bounds, double aspect) {
    constexpr double kVerticalFov = 0.7;
    constexpr double kMargin = 1.05;
    const glm::dvec3 towards_eye = glm::normalize(glm::dvec3(0.45, 0.3, 1.0));
    const glm::dvec3 up(0.0, 1.0, 0.0);
    const bool usable = !bounds.empty();
    const glm::dvec3 center = usable ? bounds.center() : glm::dvec3(0.0);
    glm::dvec3 half = usable ? 0.5 * bounds.extent() : glm::dvec3(1.0);
    if (!(glm::length(half) > 0.0)) half = glm::dvec3(1.0);

    // The smallest distance at which every corner of the box is inside the widened field of view.
    const Camera oriented = look_at(towards_eye, glm::dvec3(0.0), up, kVerticalFov);
    const glm::dmat3 camera_from_world = glm::transpose(glm::dmat3(oriented.world_from_camera));
    const double half_height = std::tan(0.5 * kVerticalFov);
    double distance = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 offset((corner & 1) ? half.x : -half.x, (corner & 2) ? half.y : -half.y,
                                (corner & 4) ? half.z : -half.z);
        const glm::dvec3 local = camera_from_world * offset;
        const double needed =
            kMargin * std::max(std::abs(local.x) / (half_height * aspect), std::abs(local.y) / half_height);
        distance = std::max(distance, local.z + needed);
    }
    // Only moved: beside a box far from the origin the way to it may round to nothing.
    Camera camera = oriented;
    camera.world_from_camera[3] = glm::dvec4(center + distance * towards_eye, 1.0);
    camera.name = "framing";
    return camera;
}

}  // namespace core
