// core/scene/camera.h: where a picture is taken from.
//
// As in glTF: the camera looks along its -Z with +Y up.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <string>

#include "core/math/bounds.h"
#include "core/math/ray.h"
#include "core/scene/node.h"

namespace core {

struct Camera {
    std::string name;
    glm::dmat4 world_from_camera{1.0};  ///< Rigid: scale is taken off at load, as the specification demands.
    bool orthographic = false;
    double vertical_fov = 0.8;      ///< Radians; perspective only.
    glm::dvec2 magnification{1.0};  ///< Half width and half height in world units; orthographic only.
    double near_distance = 0.0;     ///< Planar; nothing closer is seen.
    double far_distance = std::numeric_limits<double>::infinity();
    std::uint32_t node = kNoNode;  ///< Index into Scene::nodes.
};

/// Makes rays for pictures of one size. An orthographic camera keeps its half height and takes its width from
/// the picture's shape; so does a perspective one.
class CameraRays {
public:
    CameraRays(const Camera& camera, int width, int height);

    /// The ray through a point of the film; (0, 0) is the top left corner of the top left pixel.
    Ray ray(const glm::vec2& film_pixels) const;

    /// Planar distance along the viewing axis of a world point: `Depth.Z`.
    float depth(const glm::vec3& world_position) const;

    /// For column vectors: into the space of world_from_camera, and to the picture (x, y in [0, 1] after the
    /// divide, y downwards).
    glm::dmat4 camera_from_world() const;
    glm::dmat4 ndc_from_world() const;

private:
    glm::dmat4 world_from_camera_;
    glm::dmat4 camera_from_world_;
    bool orthographic_;
    glm::dvec2 half_extent_;  ///< Of the film at distance 1 (perspective) or in world units.
    glm::dvec2 film_from_pixels_;
    double near_distance_;
    double far_distance_;
};

/// A camera at `eye`. @param vertical_fov radians. @pre eye != target, up not parallel to the view.
Camera look_at(const glm::dvec3& eye, const glm::dvec3& target, const glm::dvec3& up, double vertical_fov);

/// A camera outside the box, from the front, a little above and to the right, that sees all of it.
Camera framing(const DoubleBounds& bounds, double aspect);

}  // namespace core
