// core/scene/material.h: the one glTF material, and what it says at a point of a surface.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>

namespace core {

struct Scene;

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

/// A reference to a texture with its KHR_texture_transform. texture < 0 means absent.
struct TextureUse {
    int texture = -1;
    int uv_set = 0;                                       ///< TEXCOORD_0 or TEXCOORD_1.
    glm::mat3x2 uv_from_mesh_uv{{1, 0}, {0, 1}, {0, 0}};  ///< uv' = matrix * (u, v, 1).

    bool present() const { return texture >= 0; }
};

/// glTF 2.0 metallic-roughness with KHR_materials_emissive_strength (folded into `emission`), _unlit, _ior
/// and _specular. Defaults are glTF's.
struct Material {
    std::string name;
    glm::vec4 base_color{1.0f};
    TextureUse base_color_texture;  ///< sRGB, with alpha.
    float metallic = 1.0f;
    float roughness = 1.0f;
    TextureUse metallic_roughness_texture;  ///< G roughness, B metallic; linear.
    TextureUse normal_texture;              ///< Tangent space; linear.
    float normal_scale = 1.0f;
    glm::vec3 emission{0.0f};     ///< cd/m^2, emissiveFactor x emissiveStrength.
    TextureUse emission_texture;  ///< sRGB.
    AlphaMode alpha_mode = AlphaMode::kOpaque;
    float alpha_cutoff = 0.5f;
    bool double_sided = false;
    bool unlit =
        false;         ///< Shows the base colour in cd/m^2 whatever the light: emits it and reflects nothing.
    float ior = 1.5f;  ///< 0: F0 is specular_color alone, as specular-glossiness materials are converted.
    float specular = 1.0f;        ///< Scales the dielectric's F0 and F90; 0 makes a dielectric Lambert.
    TextureUse specular_texture;  ///< A; linear.
    glm::vec3 specular_color{1.0f};
    TextureUse specular_color_texture;  ///< sRGB.

    /// Whether any point of it may send light out by itself.
    bool emissive() const;
};

/// What interpolated vertex attributes a material lookup may need.
struct SurfaceCoordinates {
    glm::vec2 uv[2] = {glm::vec2(0.0f), glm::vec2(0.0f)};
    glm::vec4 color{1.0f};  ///< COLOR_0, multiplies the base colour.
};

/// A material evaluated at one point: the parameters of core::Brdf plus emission and alpha.
struct MaterialSample {
    glm::vec3 base_color{1.0f};
    float alpha = 1.0f;
    float metallic = 0.0f;
    float roughness = 1.0f;  ///< Perceptual, in [0, 1]; the microfacet alpha is its square.
    glm::vec3 emission{0.0f};
    glm::vec3 dielectric_f0{0.04f};
    float dielectric_f90 = 1.0f;
};

/// Evaluates textures, factors and vertex colours. Everything finite, colours >= 0.
MaterialSample sample_material(const Scene& scene, const Material& material,
                               const SurfaceCoordinates& coordinates);

/// Base-colour alpha alone: what visibility asks.
float sample_alpha(const Scene& scene, const Material& material, const SurfaceCoordinates& coordinates);

/// Emission alone, in cd/m^2: what light sampling asks.
glm::vec3 sample_emission(const Scene& scene, const Material& material,
                          const SurfaceCoordinates& coordinates);

/// The normal-map's tangent-space normal (z outwards, unit), or (0, 0, 1) without a map.
glm::vec3 sample_tangent_normal(const Scene& scene, const Material& material,
                                const SurfaceCoordinates& coordinates);

}  // namespace core
