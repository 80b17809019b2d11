#include "core/scene/scene.h"

#include <fmt/format.h>

#include <cmath>
#include <span>
#include <utility>

#include "core/support/error.h"
#include "core/support/hash.h"

namespace core {

namespace {

/// Determinant over the product of the column lengths, under which a linear map counts as singular. Double
/// rounding of a few chained products leaves about 1e-15.
constexpr double kSmallestRelativeVolume = 1e-12;

template <typename Matrix>
bool all_finite(const Matrix& matrix) {
    for (int column = 0; column < Matrix::length(); ++column) {
        for (int row = 0; row < Matrix::col_type::length(); ++row) {
            if (!std::isfinite(matrix[column][row])) return false;
        }
    }
    return true;
}

bool invertible(const glm::dmat3& linear) {
    double lengths = 1.0;
    for (int column = 0; column < 3; ++column) lengths *= glm::length(linear[column]);
    // Not: determinant / lengths, which is 0 / 0 for a zero column.
    return std::abs(glm::determinant(linear)) > kSmallestRelativeVolume * lengths;
}

void add_use(Hasher& hasher, const TextureUse& use) {
    hasher.add(use.texture);
    if (!use.present()) return;
    hasher.add(use.uv_set);
    hasher.add(use.uv_from_mesh_uv);
}

void add_material(Hasher& hasher, const Material& material) {
    hasher.add(material.base_color);
    add_use(hasher, material.base_color_texture);
    hasher.add(material.metallic);
    hasher.add(material.roughness);
    add_use(hasher, material.metallic_roughness_texture);
    add_use(hasher, material.normal_texture);
    hasher.add(material.normal_scale);
    hasher.add(material.emission);
    add_use(hasher, material.emission_texture);
    hasher.add(material.alpha_mode);
    hasher.add(material.alpha_cutoff);
    hasher.add(material.double_sided);
    hasher.add(material.unlit);
    hasher.add(material.ior);
    hasher.add(material.specular);
    add_use(hasher, material.specular_texture);
    hasher.add(material.specular_color);
    add_use(hasher, material.specular_color_texture);
}

void add_mesh(Hasher& hasher, const Mesh& mesh) {
    hasher.add_range(std::span<const glm::vec3>(mesh.positions));
    hasher.add_range(std::span<const glm::vec3>(mesh.normals));
    hasher.add_range(std::span<const glm::vec4>(mesh.tangents));
    for (const auto& uvs : mesh.uvs) hasher.add_range(std::span<const glm::vec2>(uvs));
    hasher.add_range(std::span<const glm::vec4>(mesh.colors));
    hasher.add_range(std::span<const glm::uvec3>(mesh.triangles));
    hasher.add_range(std::span<const std::uint32_t>(mesh.part_of_triangle));
}

struct LightHash {
    Hasher& hasher;

    void operator()(const PointLight& light) const {
        hasher.add(light.position);
        hasher.add(light.intensity);
    }
    void operator()(const SpotLight& light) const {
        hasher.add(light.position);
        hasher.add(light.direction);
        hasher.add(light.intensity);
        hasher.add(light.cos_inner);
        hasher.add(light.cos_outer);
    }
    void operator()(const DirectionalLight& light) const {
        hasher.add(light.direction);
        hasher.add(light.illuminance);
        hasher.add(light.angular_radius);
    }
};

}  // namespace

Instance make_instance(std::string name, std::uint32_t mesh, std::vector<std::uint32_t> materials,
                       const glm::dmat4& world_from_local) {
    Instance instance;
    instance.name = std::move(name);
    instance.mesh = mesh;
    instance.materials = std::move(materials);
    instance.world_from_local = world_from_local;
    if (!all_finite(world_from_local)) {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("instance '{}': the transform is not finite; every element of a node's "
                                     "matrix, translation, rotation and scale must be a finite number",
                                     instance.name));
    }
    const glm::dmat3 linear(world_from_local);
    if (invertible(linear)) {
        instance.local_from_world = glm::inverse(world_from_local);
        instance.normal_from_local = glm::mat3(glm::transpose(glm::inverse(linear)));
        if (all_finite(instance.local_from_world) && all_finite(instance.normal_from_local)) return instance;
    }
    throw InputError(ErrorKind::kBadData,
                     fmt::format("instance '{}': the transform is singular and flattens the mesh; every "
                                 "scale must be other than zero",
                                 instance.name));
}

DoubleBounds world_bounds(const Scene& scene) {
    DoubleBounds bounds;
    for (const Instance& instance : scene.instances) {
        const Bounds& local = scene.meshes[instance.mesh].bounds;
        bounds.include(
            transformed({glm::dvec3(local.minimum), glm::dvec3(local.maximum)}, instance.world_from_local));
    }
    return bounds;
}

std::uint64_t drawn_triangle_count(const Scene& scene) {
    std::uint64_t count = 0;
    for (const Instance& instance : scene.instances) count += scene.meshes[instance.mesh].triangles.size();
    return count;
}

bool has_emissive_surface(const Scene& scene) {
    for (const Instance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes[instance.mesh];
        for (std::size_t part = 0; part < mesh.parts.size(); ++part) {
            if (mesh.parts[part].triangle_count == 0) continue;
            const Material& material = scene.materials[instance.materials[part]];
            if (material.emissive() && !material.unlit) return true;
        }
    }
    return false;
}

std::string scene_hash(const Scene& scene) {
    Hasher hasher;
    hasher.add(scene.meshes.size());
    for (const Mesh& mesh : scene.meshes) add_mesh(hasher, mesh);
    hasher.add(scene.instances.size());
    for (const Instance& instance : scene.instances) {
        hasher.add(instance.mesh);
        hasher.add_range(std::span<const std::uint32_t>(instance.materials));
        hasher.add(instance.world_from_local);
    }
    hasher.add(scene.materials.size());
    for (const Material& material : scene.materials) add_material(hasher, material);
    hasher.add(scene.textures.size());
    for (const Texture& texture : scene.textures) {
        hasher.add(texture.image);
        hasher.add(texture.wrap_u);
        hasher.add(texture.wrap_v);
        hasher.add(texture.nearest);
    }
    hasher.add(scene.images.size());
    for (const TextureImage& image : scene.images) {
        hasher.add(image.width);
        hasher.add(image.height);
        hasher.add_range(std::span<const std::uint8_t>(image.rgba));
    }
    hasher.add(scene.lights.size());
    for (const Light& light : scene.lights) {
        hasher.add(light.index());
        std::visit(LightHash{hasher}, light);
    }
    scene.sky.add_to(hasher);
    return hasher.hex();
}

SurfaceCoordinates surface_coordinates(const Mesh& mesh, std::uint32_t triangle,
                                       const glm::vec2& barycentrics) {
    const glm::uvec3& corner = mesh.triangles[triangle];
    const float w1 = barycentrics.x;
    const float w2 = barycentrics.y;
    const float w0 = 1.0f - w1 - w2;
    SurfaceCoordinates result;
    for (std::size_t set = 0; set < mesh.uvs.size(); ++set) {
        const auto& uvs = mesh.uvs[set];
        if (!uvs.empty()) result.uv[set] = w0 * uvs[corner.x] + w1 * uvs[corner.y] + w2 * uvs[corner.z];
    }
    if (!mesh.colors.empty()) {
        result.color = w0 * mesh.colors[corner.x] + w1 * mesh.colors[corner.y] + w2 * mesh.colors[corner.z];
    }
    return result;
}

}  // namespace core
