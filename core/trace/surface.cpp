#include "core/trace/surface.h"

#include <algorithm>
#include <cmath>

#include "core/math/random.h"

namespace core {
namespace {

/// Least cosine that a shading normal keeps to the viewer and to the geometric normal. Far above the rounding
/// of a dot product (1e-7), far below anything seen (0.006 degrees).
constexpr float kLeastCosine = 1e-4f;

/// `v` with unit length at any scale, or `fallback` where `v` has no direction.
glm::vec3 normalized_or(const glm::vec3& v, const glm::vec3& fallback) {
    const float ordinary = glm::dot(v, v);
    if (ordinary > 1e-20f && ordinary < 1e20f) return v * (1.0f / std::sqrt(ordinary));
    const glm::dvec3 wide(v);
    const double length_squared = glm::dot(wide, wide);
    // Also false for NaN.
    if (!(length_squared > 0.0 && std::isfinite(length_squared))) return fallback;
    return glm::vec3(wide * (1.0 / std::sqrt(length_squared)));
}

bool uses_coordinates(const Mesh& mesh, const Material& material) {
    return !mesh.colors.empty() || material.base_color_texture.present() ||
           material.metallic_roughness_texture.present() || material.normal_texture.present() ||
           material.emission_texture.present() || material.specular_texture.present() ||
           material.specular_color_texture.present();
}

struct VertexWeights {
    const glm::uvec3& corners;
    glm::vec3 weights;

    template <typename T>
    T interpolate(const std::vector<T>& values) const {
        return weights.x * values[corners.x] + weights.y * values[corners.y] + weights.z * values[corners.z];
    }
};

/// Tilts the front-side normal by the material's normal map.
glm::vec3 mapped_normal(const Scene& scene, const Material& material, const Instance& placed,
                        const Mesh& mesh, const VertexWeights& at, const SurfaceCoordinates& coordinates,
                        const glm::vec3& normal) {
    const glm::mat3 linear(placed.world_from_local);
    glm::vec3 tangent = linear * glm::vec3(at.interpolate(mesh.tangents));
    tangent = normalized_or(tangent - glm::dot(tangent, normal) * normal, glm::vec3(0.0f));
    // A tangent along the normal leaves the map without axes.
    if (tangent == glm::vec3(0.0f)) return normal;
    // A mirror turns the cross product round, but not the picture on the surface.
    const float mirror = glm::determinant(glm::dmat3(placed.world_from_local)) < 0.0 ? -1.0f : 1.0f;
    const float handedness = mesh.tangents[at.corners.x].w < 0.0f ? -mirror : mirror;
    const glm::vec3 bitangent = handedness * glm::cross(normal, tangent);
    const glm::vec3 mapped = sample_tangent_normal(scene, material, coordinates);
    return normalized_or(mapped.x * tangent + mapped.y * bitangent + mapped.z * normal, normal);
}

/// The shading normal before any bending, on the side the winding calls front.
glm::vec3 smooth_front_normal(const Instance& placed, const Mesh& mesh, const VertexWeights& at,
                              const glm::vec3& geometric_front) {
    glm::vec3 normal =
        normalized_or(placed.normal_from_local * at.interpolate(mesh.normals), geometric_front);
    if (glm::dot(normal, geometric_front) < 0.0f) {
        // Either smoothing went past the horizon, which bending mends, or the file's normals contradict its
        // winding altogether; then they are meant the other way round.
        bool contradicts = true;
        for (int corner = 0; corner < 3; ++corner) {
            const glm::vec3 vertex_normal = placed.normal_from_local * mesh.normals[at.corners[corner]];
            contradicts = contradicts && glm::dot(vertex_normal, geometric_front) < 0.0f;
        }
        if (contradicts) normal = -normal;
    }
    return normal;
}

/// Raises `normal` until its cosine to `towards` (unit) is kLeastCosine.
glm::vec3 raised(const glm::vec3& normal, const glm::vec3& towards) {
    const float cosine = glm::dot(normal, towards);
    if (cosine >= kLeastCosine) return normal;
    // Twice the bound, so that rounding cannot end below it.
    return normalized_or(normal + (2.0f * kLeastCosine - cosine) * towards, towards);
}

}  // namespace

ShadingFrame ShadingFrame::from_normal(const glm::vec3& n) {
    // Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
    const float sign = std::copysign(1.0f, n.z);
    const float a = -1.0f / (sign + n.z);
    const float b = n.x * n.y * a;
    return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

SurfacePoint surface_at(const Scene& scene, const Ray& ray, const Hit& hit) {
    const Instance& placed = scene.instances[hit.instance];
    const Mesh& mesh = scene.meshes[placed.mesh];
    const Material& material = scene.materials[placed.materials[mesh.part_of_triangle[hit.triangle]]];

    SurfacePoint point;
    point.position = glm::vec3(glm::dvec3(ray.origin) + double(hit.t) * glm::dvec3(ray.direction));
    point.geometric_normal = hit.normal;
    point.instance = hit.instance;
    point.triangle = hit.triangle;
    point.offset = hit.offset;

    const VertexWeights at{
        mesh.triangles[hit.triangle],
        {1.0f - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics.x, hit.barycentrics.y}};
    SurfaceCoordinates coordinates;
    if (uses_coordinates(mesh, material)) {
        coordinates = surface_coordinates(mesh, hit.triangle, hit.barycentrics);
    }

    const glm::vec3 geometric_front = hit.front ? hit.normal : -hit.normal;
    glm::vec3 normal = smooth_front_normal(placed, mesh, at, geometric_front);
    if (material.normal_texture.present() && !mesh.tangents.empty()) {
        normal = mapped_normal(scene, material, placed, mesh, at, coordinates, normal);
    }
    if (!hit.front) normal = -normal;
    // A shading normal that turns away from the viewer or from the surface would put the viewer under its
    // own horizon, where a BRDF is zero: black rims. The second step raises the first one's cosine too,
    // because the viewer is on the geometric normal's side.
    normal = raised(raised(normal, hit.normal), -ray.direction);
    point.frame = ShadingFrame::from_normal(normal);

    const MaterialSample sample = sample_material(scene, material, coordinates);
    point.brdf = make_brdf(sample);
    point.emission = sample.emission;
    point.base_color = sample.base_color;
    point.roughness = sample.roughness;
    point.metallic = sample.metallic;
    return point;
}

bool is_visible(const Scene& scene, std::uint32_t instance, std::uint32_t triangle,
                const glm::vec2& barycentrics, std::uint32_t seed) {
    const Material& material = scene.material_of(instance, triangle);
    if (material.alpha_mode == AlphaMode::kOpaque) return true;
    const Mesh& mesh = scene.meshes[scene.instances[instance].mesh];
    const float alpha = sample_alpha(scene, material, surface_coordinates(mesh, triangle, barycentrics));
    if (material.alpha_mode == AlphaMode::kMask) return alpha >= material.alpha_cutoff;
    return unit_float(hash_words(seed, instance, triangle)) < alpha;
}

bool may_be_invisible(const Scene& scene, std::uint32_t instance, std::uint32_t part) {
    const Instance& placed = scene.instances[instance];
    const Material& material = scene.materials[placed.materials[part]];
    if (material.alpha_mode == AlphaMode::kOpaque) return false;
    if (material.base_color_texture.present() || !scene.meshes[placed.mesh].colors.empty()) return true;
    const float visible_from = material.alpha_mode == AlphaMode::kMask ? material.alpha_cutoff : 1.0f;
    return material.base_color.a < visible_from;
}

bool has_alpha(const Scene& scene) {
    for (std::uint32_t instance = 0; instance < scene.instances.size(); ++instance) {
        const auto part_count = static_cast<std::uint32_t>(scene.instances[instance].materials.size());
        for (std::uint32_t part = 0; part < part_count; ++part) {
            if (may_be_invisible(scene, instance, part)) return true;
        }
    }
    return false;
}

}  // namespace core
