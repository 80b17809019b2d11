#include "core/render/light_sampler.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/image/image.h"
#include "core/math/random.h"

namespace core {

namespace {

/// Barycentrics at which a textured triangle's emission is averaged to weigh it. A texture brighter between
/// them only costs noise.
constexpr int kEmissionProbesPerSide = 4;

/// Of the luminance of white: what a textured triangle is taken to emit at least, for the texture may be
/// bright between the probes. A quarter of what one probe weighs.
constexpr float kLeastTexturedShare = 1.0f / (4 * kEmissionProbesPerSide * kEmissionProbesPerSide);

bool is_textured_emitter(const Material& material) {
    return material.unlit || material.emission_texture.present();
}

/// @return 0 where all of the texture is black
float least_emission_luminance(const Scene& scene, const Material& material) {
    const glm::vec3 white = material.unlit ? glm::vec3(material.base_color) : material.emission;
    const TextureUse& use = material.unlit ? material.base_color_texture : material.emission_texture;
    const float least = kLeastTexturedShare * luminance(white);
    if (!use.present()) return least;
    const std::vector<std::uint8_t>& texels =
        scene.images[scene.textures[static_cast<std::size_t>(use.texture)].image].rgba;
    for (std::size_t i = 0; i + 3 < texels.size(); i += 4) {
        for (int c = 0; c < 3; ++c) {
            if (texels[i + static_cast<std::size_t>(c)] > 0 && white[c] > 0.0f) return least;
        }
    }
    return 0.0f;
}

/// By material; 0 for those without a texture, whose emission is known.
std::vector<float> least_emission_luminances(const Scene& scene) {
    std::vector<float> result(scene.materials.size(), 0.0f);
    for (std::size_t i = 0; i < result.size(); ++i) {
        const Material& material = scene.materials[i];
        if (material.emissive() && is_textured_emitter(material)) {
            result[i] = least_emission_luminance(scene, material);
        }
    }
    return result;
}

float mean_emission_luminance(const Scene& scene, const Mesh& mesh, const Material& material,
                              std::uint32_t triangle) {
    if (!is_textured_emitter(material)) return luminance(material.emission);
    double sum = 0.0;
    for (int i = 0; i < kEmissionProbesPerSide; ++i) {
        for (int j = 0; j < kEmissionProbesPerSide; ++j) {
            const glm::vec2 u((static_cast<float>(i) + 0.5f) / kEmissionProbesPerSide,
                              (static_cast<float>(j) + 0.5f) / kEmissionProbesPerSide);
            sum += luminance(
                sample_emission(scene, material, surface_coordinates(mesh, triangle, sample_triangle(u))));
        }
    }
    return static_cast<float>(sum / (kEmissionProbesPerSide * kEmissionProbesPerSide));
}

/// Irradiance estimates fall with distance to the light but not below the light's own size.
float inverse_square(const glm::vec3& offset, float radius) {
    return 1.0f / std::max({glm::dot(offset, offset), radius * radius, std::numeric_limits<float>::min()});
}

}  // namespace

LightSampler::LightSampler(const Scene& scene)
    : LightSampler(scene, {&scene.sky, std::vector<std::uint8_t>(scene.instances.size(), 1)}) {}

LightSampler::LightSampler(const Scene& scene, const LightSubset& subset)
    : scene_(scene),
      sky_(subset.sky),
      group_of_instance_(scene.instances.size(), kNoIndex),
      may_emit_(scene.instances.size(), 0) {
    assert(subset.emitters.size() == scene.instances.size());
    for (std::uint32_t i = 0; i < scene.lights.size(); ++i) {
        if (!(estimated_power(scene.lights[i], 1.0f) > 0.0f)) continue;
        const auto* sun = std::get_if<DirectionalLight>(&scene.lights[i]);
        if (sun && sun->angular_radius > 0.0f) {
            escaped_groups_.push_back(static_cast<std::uint32_t>(groups_.size()));
        }
        groups_.push_back({Kind::kLight, i, glm::vec3(0.0f), 0.0f, 0.0f});
    }
    if (sky_ && !sky_->black()) {
        escaped_groups_.push_back(static_cast<std::uint32_t>(groups_.size()));
        groups_.push_back({Kind::kSky, 0, glm::vec3(0.0f), 0.0f, kPi * sky_->mean_luminance()});
    }
    const std::vector<float> least = least_emission_luminances(scene);
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) add_emitter(i, subset.emitters[i] != 0, least);
}

void LightSampler::add_emitter(std::uint32_t instance_index, bool sampled,
                               std::span<const float> least_emission) {
    const Instance& instance = scene_.instances[instance_index];
    const Mesh& mesh = scene_.meshes[instance.mesh];
    Emitter emitter;
    emitter.instance = instance_index;
    std::vector<float> powers;
    Bounds bounds;
    double power_over_pi = 0.0;
    for (std::size_t part_index = 0; part_index < mesh.parts.size(); ++part_index) {
        const MeshPart& part = mesh.parts[part_index];
        const std::uint32_t material_index = instance.materials[part_index];
        const Material& material = scene_.materials[material_index];
        if (!material.emissive()) continue;
        may_emit_[instance_index] = 1;
        if (!sampled) continue;
        for (std::uint32_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
            const glm::uvec3& corners = mesh.triangles[t];
            glm::dvec3 points[3];
            for (int corner = 0; corner < 3; ++corner) {
                points[corner] =
                    glm::dvec3(instance.world_from_local * glm::dvec4(mesh.positions[corners[corner]], 1.0));
            }
            const glm::dvec3 cross = glm::cross(points[1] - points[0], points[2] - points[0]);
            const double length = glm::length(cross);
            const float area = static_cast<float>(0.5 * length);
            if (!(area > 0.0f)) continue;
            const float power = area * std::max(mean_emission_luminance(scene_, mesh, material, t),
                                                least_emission[material_index]);
            if (!(power > 0.0f)) continue;
            if (emitter.entry_of_triangle.empty())
                emitter.entry_of_triangle.assign(mesh.triangles.size(), kNoIndex);
            emitter.entry_of_triangle[t] = static_cast<std::uint32_t>(emitter.triangles.size());
            emitter.triangles.push_back({glm::vec3(points[0]), glm::vec3(points[1] - points[0]),
                                         glm::vec3(points[2] - points[0]), glm::vec3(cross / length), area,
                                         t});
            powers.push_back(power);
            power_over_pi += static_cast<double>(power);
            for (const glm::dvec3& point : points) bounds.include(glm::vec3(point));
        }
    }
    if (emitter.triangles.empty()) return;
    emitter.distribution = Distribution1D(powers);
    group_of_instance_[instance_index] = static_cast<std::uint32_t>(groups_.size());
    groups_.push_back({Kind::kEmitter, static_cast<std::uint32_t>(emitters_.size()), bounds.center(),
                       0.5f * glm::length(bounds.extent()), static_cast<float>(power_over_pi)});
    emitters_.push_back(std::move(emitter));
}

float LightSampler::importance(const Group& group, const LightReceiver& receiver) const {
    switch (group.kind) {
        case Kind::kSky:
            return group.strength;
        case Kind::kEmitter: {
            const glm::vec3 offset = group.center - receiver.position;
            // Slack for the rounding of both: the bound must not lose a light at the horizon.
            if (glm::dot(offset, receiver.normal) <= -1.001f * group.radius) return 0.0f;
            return group.strength * inverse_square(offset, group.radius);
        }
        case Kind::kLight:
            break;
    }
    const Light& light = scene_.lights[group.index];
    if (const auto* sun = std::get_if<DirectionalLight>(&light)) {
        const float height = -glm::dot(sun->direction, receiver.normal) + std::sin(sun->angular_radius);
        return height > 0.0f ? luminance(sun->illuminance) * std::clamp(height, 0.1f, 1.0f) : 0.0f;
    }
    const LightSample sampled = sample_light(light, receiver.position, glm::vec2(0.0f));
    if (!(sampled.pdf > 0.0f) || !(glm::dot(sampled.direction, receiver.normal) > 0.0f)) return 0.0f;
    return luminance(sampled.radiance);
}

LightSampler::Selection LightSampler::selection(const LightReceiver& receiver) const {
    if (groups_.size() == 1) return {0.0f, 1.0f};
    float total = 0.0f;
    int live_count = 0;
    for (const Group& group : groups_) {
        const float value = importance(group, receiver);
        total += value;
        live_count += value > 0.0f ? 1 : 0;
    }
    if (live_count == 0) return {0.0f, 0.0f};
    if (!std::isfinite(total))
        return {0.0f, 1.0f / static_cast<float>(groups_.size())};  // On top of a light.
    return {0.5f / total, 0.5f / static_cast<float>(live_count)};
}

float LightSampler::group_probability(const Group& group, const LightReceiver& receiver,
                                      const Selection& selection) const {
    if (selection.scale == 0.0f) return selection.floor;  // No estimate: a single group, or all alike.
    const float value = importance(group, receiver);
    return value > 0.0f ? selection.scale * value + selection.floor : 0.0f;
}

LightSampler::Choice LightSampler::choose(const LightReceiver& receiver, const Selection& selection,
                                          float u_group) const {
    Choice choice;
    if (!(selection.floor > 0.0f)) return choice;
    float remaining = u_group;
    for (const Group& group : groups_) {
        const float p = group_probability(group, receiver, selection);
        if (!(p > 0.0f)) continue;
        // The last live group takes what rounding leaves over.
        choice = {&group, p, std::min(remaining / p, kOneMinusEpsilon)};
        if (remaining < p) break;
        remaining -= p;
    }
    return choice;
}

LightSampler::Sample LightSampler::sample(const LightReceiver& receiver, const Selection& selection,
                                          const glm::vec2& u) const {
    const Choice choice = choose(receiver, selection, u.x);
    return choice.group ? sample_group(choice, receiver, {choice.remainder, u.y}) : Sample{};
}

LightSampler::Sample LightSampler::sample_group(const Choice& choice, const LightReceiver& receiver,
                                                const glm::vec2& u) const {
    Sample result;
    switch (choice.group->kind) {
        case Kind::kSky: {
            const Sky::Sample sky = sky_->sample(u);
            result.direction = sky.direction;
            result.distance = std::numeric_limits<float>::infinity();
            result.radiance = sky.radiance;
            result.pdf = sky.pdf;
            break;
        }
        case Kind::kLight: {
            const LightSample light = sample_light(scene_.lights[choice.group->index], receiver.position, u);
            result.direction = light.direction;
            result.distance = light.distance;
            result.radiance = light.radiance;
            result.pdf = light.pdf;
            result.delta = light.delta;
            break;
        }
        case Kind::kEmitter:
            result = sample_emitter(emitters_[choice.group->index], receiver, u);
            break;
    }
    result.pdf *= choice.probability;
    return result;
}

LightSampler::Sample LightSampler::sample_emitter(const Emitter& emitter, const LightReceiver& receiver,
                                                  const glm::vec2& u) const {
    const Distribution1D::Sample entry = emitter.distribution.sample(u.x);
    const EmissiveTriangle& triangle = emitter.triangles[entry.index];
    const glm::vec2 barycentrics = sample_triangle({entry.remainder, u.y});
    const glm::vec3 point =
        triangle.origin + barycentrics.x * triangle.edge1 + barycentrics.y * triangle.edge2;
    Sample result;
    const glm::vec3 offset = point - receiver.position;
    const float distance2 = glm::dot(offset, offset);
    if (!(distance2 > 0.0f)) return result;
    result.distance = std::sqrt(distance2);
    result.direction = offset / result.distance;
    const float cosine = std::abs(glm::dot(result.direction, triangle.normal));
    if (!(cosine > 0.0f)) return result;
    result.pdf = entry.probability * distance2 / (triangle.area * cosine);
    result.instance = emitter.instance;
    const Material& material = scene_.material_of(emitter.instance, triangle.triangle);
    if (!material.emission_texture.present() && !material.unlit) {
        result.radiance = material.emission;
    } else {
        const Mesh& mesh = scene_.meshes[scene_.instances[emitter.instance].mesh];
        result.radiance =
            sample_emission(scene_, material, surface_coordinates(mesh, triangle.triangle, barycentrics));
    }
    return result;
}

bool LightSampler::emits(std::uint32_t instance, std::uint32_t triangle) const {
    return may_emit_[instance] != 0 && scene_.material_of(instance, triangle).emissive();
}

float LightSampler::emitter_pdf(const LightReceiver& receiver, const Selection& selection,
                                std::uint32_t instance, std::uint32_t triangle, const glm::vec3& direction,
                                float distance) const {
    const std::uint32_t group_index = group_of_instance_[instance];
    if (group_index == kNoIndex) return 0.0f;
    const Group& group = groups_[group_index];
    const Emitter& emitter = emitters_[group.index];
    const std::uint32_t entry = emitter.entry_of_triangle[triangle];
    if (entry == kNoIndex) return 0.0f;
    const EmissiveTriangle& emissive = emitter.triangles[entry];
    const float cosine = std::abs(glm::dot(direction, emissive.normal));
    if (!(cosine > 0.0f)) return 0.0f;
    return group_probability(group, receiver, selection) * emitter.distribution.probability(entry) *
           distance * distance / (emissive.area * cosine);
}

glm::vec3 LightSampler::escaped_radiance(const glm::vec3& direction) const {
    glm::vec3 result(0.0f);
    for (const std::uint32_t index : escaped_groups_) {
        const Group& group = groups_[index];
        result += group.kind == Kind::kSky ? sky_->radiance(direction)
                                           : emission_along(scene_.lights[group.index], direction).radiance;
    }
    return result;
}

glm::vec3 LightSampler::weighted_escaped_radiance(const LightReceiver& receiver, const Selection& selection,
                                                  const glm::vec3& direction, float direction_pdf) const {
    glm::vec3 result(0.0f);
    for (const std::uint32_t index : escaped_groups_) {
        const Group& group = groups_[index];
        const LightEmission emission = group.kind == Kind::kSky
                                           ? LightEmission{sky_->radiance(direction), sky_->pdf(direction)}
                                           : emission_along(scene_.lights[group.index], direction);
        if (!(emission.pdf > 0.0f)) {
            result += emission.radiance;
            continue;
        }
        const float light_pdf = emission.pdf * group_probability(group, receiver, selection);
        result += emission.radiance * power_heuristic(direction_pdf, light_pdf);
    }
    return result;
}

}  // namespace core
