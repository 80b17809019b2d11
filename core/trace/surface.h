// core/trace/surface.h: what is at a hit: position, frames, material; the same for every tracer.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "core/scene/brdf.h"
#include "core/scene/scene.h"
#include "core/trace/ray_stream.h"

namespace core {

/// An orthonormal frame with the shading normal as Z.
struct ShadingFrame {
    glm::vec3 tangent{1.0f, 0.0f, 0.0f};
    glm::vec3 bitangent{0.0f, 1.0f, 0.0f};
    glm::vec3 normal{0.0f, 0.0f, 1.0f};

    static ShadingFrame from_normal(const glm::vec3& normal);
    glm::vec3 to_world(const glm::vec3& v) const { return v.x * tangent + v.y * bitangent + v.z * normal; }
    glm::vec3 to_local(const glm::vec3& v) const {
        return {glm::dot(v, tangent), glm::dot(v, bitangent), glm::dot(v, normal)};
    }
};

/// Everything a lighting pass needs to know of a hit.
struct SurfacePoint {
    glm::vec3 position{0.0f};
    glm::vec3 geometric_normal{0.0f, 0.0f, 1.0f};  ///< Faces the ray.
    ShadingFrame frame;                            ///< Its normal lies on the ray's side: dot(n, -d) > 0.
    Brdf brdf;
    glm::vec3 emission{0.0f};  ///< cd/m^2.
    glm::vec3 base_color{0.0f};
    float roughness = 1.0f;
    float metallic = 0.0f;
    std::uint32_t instance = kNoIndex;
    std::uint32_t triangle = kNoIndex;
    float offset = 0.0f;  ///< As core::Hit::offset.

    /// Where a ray that leaves into the upper side starts.
    glm::vec3 origin_above(float extra_offset = 0.0f) const {
        const float distance = offset > extra_offset ? offset : extra_offset;
        return position + distance * geometric_normal;
    }
};

/// Derives the surface from a hit. @pre hit.hit()
SurfacePoint surface_at(const Scene& scene, const Ray& ray, const Hit& hit);

/// Whether a ray with `seed` sees this point of a MASK or BLEND material; true for opaque ones. The rule of
/// core::Tracer, shared by every tracer.
bool is_visible(const Scene& scene, std::uint32_t instance, std::uint32_t triangle,
                const glm::vec2& barycentrics, std::uint32_t seed);

/// Whether is_visible() may say no anywhere on one part of an instance: MASK and BLEND materials whose alpha
/// is not a constant that always shows.
bool may_be_invisible(const Scene& scene, std::uint32_t instance, std::uint32_t part);

/// Whether any instance has a material that is_visible() may say no to.
bool has_alpha(const Scene& scene);

}  // namespace core
