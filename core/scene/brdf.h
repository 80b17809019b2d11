// core/scene/brdf.h: how a glTF surface scatters light.
//
// Khronos Group, "glTF 2.0 Specification", appendix B, with KHR_materials_ior and _specular: Lambert under a
// GGX microfacet coat (Smith height-correlated masking, Schlick Fresnel on V.H), mixed with a metal.
// The appendix weighs the diffuse layer by 1 - F(V.H), which gains energy towards grazing: at base colour 0.8
// and roughness 0.3 the directional albedo is 1.03 at 80 degrees and 1.17 at 89 (its mean stays below 1). It
// is kept, so that pictures agree with other glTF renderers. Visible normals are sampled after Heitz,
// "Sampling the GGX Distribution of Visible Normals", JCGT 2018. Directions are in the shading frame: +Z is
// the shading normal, all of them unit and pointing away from the surface.
#pragma once

#include <glm/glm.hpp>

#include "core/scene/material.h"

namespace core {

/// The scattering parameters at one point.
struct Brdf {
    glm::vec3 diffuse{0.0f};  ///< (1 - metallic) base colour.
    glm::vec3 f0{0.04f};      ///< Specular reflectance at normal incidence, dielectric and metal mixed.
    glm::vec3 f90{1.0f};      ///< At grazing incidence, mixed likewise.
    glm::vec3 dielectric_f0{0.04f};  ///< Of the dielectric alone: decides what reaches the diffuse layer.
    float dielectric_f90 = 1.0f;
    float alpha = 1.0f;  ///< Microfacet alpha = roughness^2, at least kMinimumAlpha.
};

/// Smoother surfaces are treated as this smooth: 1e-3^2 keeps D finite in floats.
inline constexpr float kMinimumAlpha = 1e-3f;

Brdf make_brdf(const MaterialSample& material);

/// Whether it reflects anything by its coat or as a metal; if not, it is Lambert.
bool has_specular(const Brdf& brdf);

/// Whether a point of this material may have such a lobe. An index of refraction of 1 takes F0 away and
/// leaves F90, the reflection at grazing incidence.
bool has_specular(const Material& material);

/// The parts of the BRDF, 1/sr, without the cosine. Zero unless both directions are above the surface.
struct BrdfValue {
    glm::vec3 diffuse{0.0f};
    glm::vec3 specular{0.0f};
    glm::vec3 sum() const { return diffuse + specular; }
};

/// The value for a pair of directions, and the solid-angle pdf with which sample() chooses `incoming`.
struct BrdfEvaluation {
    BrdfValue value;
    float pdf = 0.0f;
};
BrdfEvaluation evaluate(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec3& incoming);

struct BrdfSample {
    glm::vec3 incoming{0.0f};
    BrdfValue value;
    float pdf = 0.0f;  ///< 0: no direction; the path ends.
};
/// @param u_lobe chooses diffuse or specular; u the direction; all in [0, 1).
BrdfSample sample(const Brdf& brdf, const glm::vec3& outgoing, float u_lobe, const glm::vec2& u);

/// Of the specular lobe alone: `value.diffuse` is 0 and the pdf that of visible normals. @param u in [0, 1)^2
BrdfSample sample_specular(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec2& u);

/// What sample_specular() gives where it chooses `incoming`.
BrdfEvaluation evaluate_specular(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec3& incoming);

/// Directional albedo used to describe a surface in the Albedo AOV: diffuse colour plus f0.
glm::vec3 approximate_albedo(const Brdf& brdf);

}  // namespace core
