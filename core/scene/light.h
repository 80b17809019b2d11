// core/scene/light.h: punctual lights and the sun.
//
// KHR_lights_punctual, whose units enter as they are: candela for points and spots, lux for directional
// lights. `range` is a hint to rasterizers and is ignored: falloff is the inverse square.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <variant>

#include "core/scene/node.h"

namespace core {

struct PointLight {
    std::string name;
    glm::vec3 position{0.0f};
    glm::vec3 intensity{0.0f};     ///< cd.
    std::uint32_t node = kNoNode;  ///< Index into Scene::nodes.
};

struct SpotLight {
    std::string name;
    glm::vec3 position{0.0f};
    glm::vec3 direction{0.0f, 0.0f, -1.0f};  ///< Unit, the way it shines.
    glm::vec3 intensity{0.0f};               ///< cd, inside the inner cone.
    float cos_inner = 1.0f;
    float cos_outer = 0.70710678f;
    std::uint32_t node = kNoNode;  ///< Index into Scene::nodes.
};

/// Light from one direction, or, with an angular radius, from a uniform disc in the sky that camera and
/// bounce rays see when they miss.
struct DirectionalLight {
    std::string name;
    glm::vec3 direction{0.0f, -1.0f, 0.0f};  ///< Unit, the way it shines.
    glm::vec3 illuminance{0.0f};             ///< lx on a surface that faces it.
    float angular_radius = 0.0f;             ///< Radians; 0 is a delta light, which no ray can hit.
    std::uint32_t node = kNoNode;            ///< Index into Scene::nodes.
};

/// The closed set of lights without geometry. A new kind is a struct here and an overload in each function of
/// this file.
using Light = std::variant<PointLight, SpotLight, DirectionalLight>;

/// Light arriving at a point from one sampled direction.
struct LightSample {
    glm::vec3 direction{0.0f};  ///< Unit, towards the light.
    float distance = 0.0f;      ///< To the light, infinite for directional ones.
    glm::vec3 radiance{0.0f};   ///< Delta lights: irradiance at normal incidence (pdf = 1). Else cd/m^2.
    float pdf = 0.0f;           ///< Per steradian; 1 for delta lights; 0: nothing arrives.
    bool delta = false;
};

/// Samples a direction towards the light. @param u in [0, 1)^2, unused by delta lights.
LightSample sample_light(const Light& light, const glm::vec3& position, const glm::vec2& u);

/// Radiance and solid-angle pdf of a light that a ray into `direction` meets when it misses all geometry: the
/// disc of a directional light with an angular radius. Zero for all others.
struct LightEmission {
    glm::vec3 radiance{0.0f};
    float pdf = 0.0f;
};
LightEmission emission_along(const Light& light, const glm::vec3& direction);

/// Luminous power in lm (for directional lights through a disc of `scene_radius`), the weight in light
/// selection. Scales exactly with the intensity.
float estimated_power(const Light& light, float scene_radius);

/// The sun of the command line. Azimuth is measured from +Z towards +X, elevation up from the horizon (+Y
/// up).
/// @param diameter in radians.
DirectionalLight make_sun(float azimuth, float elevation, float lux, float diameter);

}  // namespace core
