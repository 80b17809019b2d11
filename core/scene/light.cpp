#include "core/scene/light.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/image/image.h"
#include "core/math/sampling.h"

namespace core {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// 1 - cos(angle) without cancellation: the sun's is 1e-5.
float one_minus_cos(float angle) {
    const float s = std::sin(0.5f * angle);
    return 2.0f * s * s;
}

/// Radiance of the disc that gives `illuminance` on a surface that faces it: E = L pi sin^2(radius).
glm::vec3 disc_radiance(const DirectionalLight& light) {
    const float s = std::sin(light.angular_radius);
    return light.illuminance / (kPi * s * s);
}

glm::vec3 about_axis(const glm::vec3& local, const glm::vec3& axis) {
    const float sign = std::copysign(1.0f, axis.z);
    const float a = -1.0f / (sign + axis.z);
    const float b = axis.x * axis.y * a;
    const glm::vec3 tangent(1.0f + sign * axis.x * axis.x * a, sign * b, -sign * axis.x);
    const glm::vec3 bitangent(b, sign + axis.y * axis.y * a, -axis.y);
    return glm::normalize(local.x * tangent + local.y * bitangent + local.z * axis);
}

/// KHR_lights_punctual's cone falloff.
float cone_attenuation(const SpotLight& light, float cosine) {
    const float scale = 1.0f / std::max(0.001f, light.cos_inner - light.cos_outer);
    const float linear = std::clamp((cosine - light.cos_outer) * scale, 0.0f, 1.0f);
    return linear * linear;
}

LightSample sample_at(const glm::vec3& light_position, const glm::vec3& intensity,
                      const glm::vec3& position) {
    LightSample result;
    const glm::vec3 offset = light_position - position;
    const float distance2 = glm::dot(offset, offset);
    if (!(distance2 > 0.0f)) return result;
    result.distance = std::sqrt(distance2);
    result.direction = offset / result.distance;
    result.radiance = intensity / distance2;
    result.pdf = 1.0f;
    result.delta = true;
    return result;
}

LightSample sample_one(const PointLight& light, const glm::vec3& position, const glm::vec2&) {
    return sample_at(light.position, light.intensity, position);
}

LightSample sample_one(const SpotLight& light, const glm::vec3& position, const glm::vec2&) {
    LightSample result = sample_at(light.position, light.intensity, position);
    const float attenuation = cone_attenuation(light, -glm::dot(result.direction, light.direction));
    result.radiance *= attenuation;
    if (!(attenuation > 0.0f)) result.pdf = 0.0f;
    return result;
}

LightSample sample_one(const DirectionalLight& light, const glm::vec3&, const glm::vec2& u) {
    LightSample result;
    result.distance = kInfinity;
    if (light.angular_radius > 0.0f) {
        const float height = one_minus_cos(light.angular_radius);
        result.direction = about_axis(sample_uniform_cone(u, height), -light.direction);
        result.radiance = disc_radiance(light);
        result.pdf = uniform_cone_pdf(height);
    } else {
        result.direction = -light.direction;
        result.radiance = light.illuminance;
        result.pdf = 1.0f;
        result.delta = true;
    }
    return result;
}

float power_of(const PointLight& light, float) {
    return 4.0f * kPi * luminance(light.intensity);
}

float power_of(const SpotLight& light, float) {
    return 2.0f * kPi * (1.0f - 0.5f * (light.cos_inner + light.cos_outer)) * luminance(light.intensity);
}

float power_of(const DirectionalLight& light, float scene_radius) {
    return kPi * scene_radius * scene_radius * luminance(light.illuminance);
}

}  // namespace

LightSample sample_light(const Light& light, const glm::vec3& position, const glm::vec2& u) {
    return std::visit([&](const auto& one) { return sample_one(one, position, u); }, light);
}

LightEmission emission_along(const Light& light, const glm::vec3& direction) {
    const auto* sun = std::get_if<DirectionalLight>(&light);
    if (!sun || !(sun->angular_radius > 0.0f)) return {};
    // |d + l|^2 = 2 (1 - cos): the same precision as one_minus_cos().
    const glm::vec3 difference = direction + sun->direction;
    const float height = one_minus_cos(sun->angular_radius);
    if (0.5f * glm::dot(difference, difference) > height) return {};
    return {disc_radiance(*sun), uniform_cone_pdf(height)};
}

float estimated_power(const Light& light, float scene_radius) {
    return std::visit([&](const auto& one) { return power_of(one, scene_radius); }, light);
}

DirectionalLight make_sun(float azimuth, float elevation, float lux, float diameter) {
    DirectionalLight sun;
    sun.name = "sun";
    const float c = std::cos(elevation);
    sun.direction =
        -glm::normalize(glm::vec3(c * std::sin(azimuth), std::sin(elevation), c * std::cos(azimuth)));
    sun.illuminance = glm::vec3(lux);
    sun.angular_radius = 0.5f * diameter;
    return sun;
}

}  // namespace core
