#include "core/scene/material.h"

#include <cmath>

#include "core/scene/scene.h"

namespace core {

namespace {

/// std::clamp passes NaN through; this does not.
float unit_range(float value) {
    if (!(value > 0.0f)) return 0.0f;
    return value < 1.0f ? value : 1.0f;
}

float finite_non_negative(float value) {
    return value > 0.0f && std::isfinite(value) ? value : 0.0f;
}

glm::vec3 finite_non_negative(const glm::vec3& value) {
    return {finite_non_negative(value.x), finite_non_negative(value.y), finite_non_negative(value.z)};
}

glm::vec4 lookup(const Scene& scene, const TextureUse& use, const SurfaceCoordinates& coordinates,
                 bool srgb) {
    const Texture& texture = scene.textures[static_cast<std::size_t>(use.texture)];
    const glm::vec2 uv = use.uv_from_mesh_uv * glm::vec3(coordinates.uv[use.uv_set], 1.0f);
    return sample_texture(texture, scene.images[texture.image], uv, srgb);
}

/// Factor, texture and vertex colour multiplied; alpha not yet clamped.
glm::vec4 base_color(const Scene& scene, const Material& material, const SurfaceCoordinates& coordinates) {
    const glm::vec4 constant = material.base_color * coordinates.color;
    if (!material.base_color_texture.present()) return constant;
    return constant * lookup(scene, material.base_color_texture, coordinates, true);
}

/// Emission of a material that is not unlit.
glm::vec3 lit_emission(const Scene& scene, const Material& material, const SurfaceCoordinates& coordinates) {
    if (material.emission == glm::vec3(0.0f) || !material.emission_texture.present()) {
        return finite_non_negative(material.emission);
    }
    return finite_non_negative(material.emission *
                               glm::vec3(lookup(scene, material.emission_texture, coordinates, true)));
}

/// Reflectance at normal incidence of the dielectric: KHR_materials_ior under KHR_materials_specular.
void set_dielectric(const Scene& scene, const Material& material, const SurfaceCoordinates& coordinates,
                    MaterialSample& result) {
    const float root = (material.ior - 1.0f) / (material.ior + 1.0f);
    float specular = material.specular;
    glm::vec3 color = root * root * material.specular_color;
    if (material.specular_texture.present()) {
        specular *= lookup(scene, material.specular_texture, coordinates, false).a;
    }
    if (material.specular_color_texture.present()) {
        color *= glm::vec3(lookup(scene, material.specular_color_texture, coordinates, true));
    }
    specular = unit_range(specular);
    result.dielectric_f0 =
        specular * glm::vec3(unit_range(color.x), unit_range(color.y), unit_range(color.z));
    result.dielectric_f90 = specular;
}

}  // namespace

bool Material::emissive() const {
    const glm::vec3 sent = unlit ? glm::vec3(base_color) : emission;
    return sent.x > 0.0f || sent.y > 0.0f || sent.z > 0.0f;
}

MaterialSample sample_material(const Scene& scene, const Material& material,
                               const SurfaceCoordinates& coordinates) {
    const glm::vec4 color = base_color(scene, material, coordinates);
    MaterialSample result;
    result.alpha = material.alpha_mode == AlphaMode::kOpaque ? 1.0f : unit_range(color.a);
    if (material.unlit) {
        result.emission = finite_non_negative(glm::vec3(color));
        result.base_color = glm::vec3(0.0f);
        result.dielectric_f0 = glm::vec3(0.0f);
        result.dielectric_f90 = 0.0f;
        return result;
    }
    result.base_color = finite_non_negative(glm::vec3(color));
    result.metallic = material.metallic;
    result.roughness = material.roughness;
    if (material.metallic_roughness_texture.present()) {
        const glm::vec4 texel = lookup(scene, material.metallic_roughness_texture, coordinates, false);
        result.roughness *= texel.g;
        result.metallic *= texel.b;
    }
    result.roughness = unit_range(result.roughness);
    result.metallic = unit_range(result.metallic);
    result.emission = lit_emission(scene, material, coordinates);
    set_dielectric(scene, material, coordinates, result);
    return result;
}

float sample_alpha(const Scene& scene, const Material& material, const SurfaceCoordinates& coordinates) {
    if (material.alpha_mode == AlphaMode::kOpaque) return 1.0f;
    float alpha = material.base_color.a * coordinates.color.a;
    if (material.base_color_texture.present()) {
        alpha *= lookup(scene, material.base_color_texture, coordinates, true).a;
    }
    return unit_range(alpha);
}

glm::vec3 sample_emission(const Scene& scene, const Material& material,
                          const SurfaceCoordinates& coordinates) {
    if (material.unlit) {
        return finite_non_negative(glm::vec3(base_color(scene, material, coordinates)));
    }
    return lit_emission(scene, material, coordinates);
}

glm::vec3 sample_tangent_normal(const Scene& scene, const Material& material,
                                const SurfaceCoordinates& coordinates) {
    constexpr glm::vec3 kOutwards(0.0f, 0.0f, 1.0f);
    if (!material.normal_texture.present()) return kOutwards;
    glm::vec3 normal =
        2.0f * glm::vec3(lookup(scene, material.normal_texture, coordinates, false)) - glm::vec3(1.0f);
    normal.x *= material.normal_scale;
    normal.y *= material.normal_scale;
    const float length = glm::length(normal);
    // A texel of mid grey has no direction.
    if (!(length > 1e-6f) || !std::isfinite(length)) return kOutwards;
    return normal / length;
}

}  // namespace core
