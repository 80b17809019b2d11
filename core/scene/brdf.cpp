#include "core/scene/brdf.h"

#include <algorithm>
#include <cmath>

#include "core/image/image.h"
#include "core/math/sampling.h"

namespace core {

namespace {

float max_component(const glm::vec3& v) {
    return std::max({v.x, v.y, v.z});
}

float schlick_weight(float cosine) {
    const float m = std::clamp(1.0f - cosine, 0.0f, 1.0f);
    const float m2 = m * m;
    return m2 * m2 * m;
}

/// What the coat of the dielectric keeps from the diffuse layer. The extension takes the largest channel, so
/// that a coloured specular does not tint the diffuse light with its complement.
float dielectric_reflectance(const Brdf& brdf, float weight) {
    const float f0 = max_component(brdf.dielectric_f0);
    return f0 + (brdf.dielectric_f90 - f0) * weight;
}

/// GGX distribution of normals. Written with the tangential part of the half vector, since 1 - z^2 has lost
/// its digits where it matters.
float ggx_distribution(const glm::vec3& half, float alpha) {
    const float alpha2 = alpha * alpha;
    const float d = (half.x * half.x + half.y * half.y) / alpha2 + half.z * half.z;
    return 1.0f / (kPi * alpha2 * d * d);
}

/// sqrt(alpha^2 + (1 - alpha^2) z^2), the root in Smith's masking.
float smith_root(float z, float alpha) {
    const float alpha2 = alpha * alpha;
    return std::sqrt(alpha2 + (1.0f - alpha2) * z * z);
}

/// Chance of sampling the specular lobe, from both lobes' reflectance seen from `outgoing`.
float specular_probability(const Brdf& brdf, float outgoing_z) {
    if (!has_specular(brdf)) return 0.0f;
    const float diffuse = max_component(brdf.diffuse);
    if (!(diffuse > 0.0f)) return 1.0f;
    const float weight = schlick_weight(outgoing_z);
    const float specular = max_component(brdf.f0 + (brdf.f90 - brdf.f0) * weight);
    const float below = diffuse * (1.0f - dielectric_reflectance(brdf, weight));
    // Both lobes stay alive: the estimates leave out the half vector, which may differ much.
    return std::clamp(specular / (specular + below), 0.1f, 0.9f);
}

float specular_pdf(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec3& half) {
    return ggx_distribution(half, brdf.alpha) / (2.0f * (outgoing.z + smith_root(outgoing.z, brdf.alpha)));
}

BrdfValue evaluate_with_half(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec3& incoming,
                             const glm::vec3& half) {
    const float weight = schlick_weight(glm::dot(outgoing, half));
    const float visibility = 0.5f / (incoming.z * smith_root(outgoing.z, brdf.alpha) +
                                     outgoing.z * smith_root(incoming.z, brdf.alpha));
    return {brdf.diffuse * ((1.0f - dielectric_reflectance(brdf, weight)) / kPi),
            (brdf.f0 + (brdf.f90 - brdf.f0) * weight) * (ggx_distribution(half, brdf.alpha) * visibility)};
}

float pdf_with_half(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec3& incoming,
                    const glm::vec3& half) {
    const float chance = specular_probability(brdf, outgoing.z);
    return (1.0f - chance) * cosine_hemisphere_pdf(incoming.z) + chance * specular_pdf(brdf, outgoing, half);
}

/// Without a coat there is no half vector to find.
BrdfEvaluation lambert(const Brdf& brdf, const glm::vec3& incoming) {
    return {{brdf.diffuse / kPi, glm::vec3(0.0f)}, cosine_hemisphere_pdf(incoming.z)};
}

glm::vec3 sample_visible_normal(const glm::vec3& outgoing, float alpha, const glm::vec2& u) {
    const glm::vec3 stretched = glm::normalize(glm::vec3(alpha * outgoing.x, alpha * outgoing.y, outgoing.z));
    const float length2 = stretched.x * stretched.x + stretched.y * stretched.y;
    const glm::vec3 t1 = length2 > 0.0f ? glm::vec3(-stretched.y, stretched.x, 0.0f) / std::sqrt(length2)
                                        : glm::vec3(1.0f, 0.0f, 0.0f);
    const glm::vec3 t2 = glm::cross(stretched, t1);
    glm::vec2 p = disk_from_square(u);
    const float s = 0.5f * (1.0f + stretched.z);
    p.y = (1.0f - s) * std::sqrt(std::max(0.0f, 1.0f - p.x * p.x)) + s * p.y;
    const glm::vec3 normal =
        p.x * t1 + p.y * t2 + std::sqrt(std::max(0.0f, 1.0f - glm::dot(p, p))) * stretched;
    return glm::normalize(glm::vec3(alpha * normal.x, alpha * normal.y, std::max(1e-6f, normal.z)));
}

}  // namespace

Brdf make_brdf(const MaterialSample& material) {
    Brdf brdf;
    brdf.diffuse = (1.0f - material.metallic) * material.base_color;
    brdf.dielectric_f0 = material.dielectric_f0;
    brdf.dielectric_f90 = material.dielectric_f90;
    brdf.f0 = glm::mix(material.dielectric_f0, material.base_color, material.metallic);
    brdf.f90 = glm::vec3(glm::mix(material.dielectric_f90, 1.0f, material.metallic));
    brdf.alpha = std::max(kMinimumAlpha, material.roughness * material.roughness);
    return brdf;
}

bool has_specular(const Brdf& brdf) {
    return max_component(brdf.f0) > 0.0f || max_component(brdf.f90) > 0.0f;
}

bool has_specular(const Material& material) {
    return material.metallic > 0.0f || material.specular > 0.0f;
}

BrdfEvaluation evaluate(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec3& incoming) {
    if (!(outgoing.z > 0.0f) || !(incoming.z > 0.0f)) return {};
    if (!has_specular(brdf)) return lambert(brdf, incoming);
    const glm::vec3 half = glm::normalize(outgoing + incoming);
    return {evaluate_with_half(brdf, outgoing, incoming, half),
            pdf_with_half(brdf, outgoing, incoming, half)};
}

BrdfSample sample(const Brdf& brdf, const glm::vec3& outgoing, float u_lobe, const glm::vec2& u) {
    BrdfSample result;
    if (!(outgoing.z > 0.0f)) return result;
    const float chance = specular_probability(brdf, outgoing.z);
    if (u_lobe < chance) {
        const glm::vec3 half = sample_visible_normal(outgoing, brdf.alpha, u);
        result.incoming = 2.0f * glm::dot(outgoing, half) * half - outgoing;
        if (!(result.incoming.z > 0.0f)) return result;
        result.incoming = glm::normalize(result.incoming);
    } else {
        result.incoming = sample_cosine_hemisphere(u);
        if (!(result.incoming.z > 0.0f)) return result;
    }
    // Anew from both directions, so that value and pdf are bitwise those of evaluate().
    const BrdfEvaluation evaluation = evaluate(brdf, outgoing, result.incoming);
    result.value = evaluation.value;
    result.pdf = evaluation.pdf;
    return result;
}

BrdfSample sample_specular(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec2& u) {
    BrdfSample result;
    if (!(outgoing.z > 0.0f) || !has_specular(brdf)) return result;
    const glm::vec3 half = sample_visible_normal(outgoing, brdf.alpha, u);
    const glm::vec3 incoming = 2.0f * glm::dot(outgoing, half) * half - outgoing;
    if (!(incoming.z > 0.0f)) return result;
    result.incoming = glm::normalize(incoming);
    const BrdfEvaluation evaluation = evaluate_specular(brdf, outgoing, result.incoming);
    result.value = evaluation.value;
    result.pdf = evaluation.pdf;
    return result;
}

BrdfEvaluation evaluate_specular(const Brdf& brdf, const glm::vec3& outgoing, const glm::vec3& incoming) {
    if (!(outgoing.z > 0.0f) || !(incoming.z > 0.0f) || !has_specular(brdf)) return {};
    const glm::vec3 half = glm::normalize(outgoing + incoming);
    return {{glm::vec3(0.0f), evaluate_with_half(brdf, outgoing, incoming, half).specular},
            specular_pdf(brdf, outgoing, half)};
}

glm::vec3 approximate_albedo(const Brdf& brdf) {
    return brdf.diffuse + brdf.f0;
}

}  // namespace core
