#include "tests/fuzz/exercise_scene.h"

#include <cstdio>
#include <cstdlib>
#include <limits>

#include "core/render/path_tracer.h"
#include "core/trace/triangle_tracer.h"
#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"

namespace fuzz {

namespace {

/// Scenes beyond these are only looked at: a bake costs a thousand loads.
constexpr std::uint64_t kMostTriangles = 64;
constexpr std::size_t kMostMeshes = 2;
constexpr std::size_t kMostInstances = 8;

/// A promise of a header that is broken is a finding, in builds without assertions too.
void promise(bool kept, const char* what) {
    if (kept) return;
    std::fprintf(stderr, "core::Scene breaks its promise: %s\n", what);
    std::abort();
}

void check_mesh(const core::Mesh& mesh) {
    const std::size_t vertex_count = mesh.positions.size();
    promise(mesh.normals.size() == vertex_count, "one normal a vertex");
    promise(mesh.tangents.empty() || mesh.tangents.size() == vertex_count, "one tangent a vertex, or none");
    for (const auto& uvs : mesh.uvs) {
        promise(uvs.empty() || uvs.size() == vertex_count, "one uv a vertex, or none");
    }
    promise(mesh.colors.empty() || mesh.colors.size() == vertex_count, "one colour a vertex, or none");
    promise(mesh.part_of_triangle.size() == mesh.triangles.size(), "one part a triangle");
    for (const glm::uvec3& triangle : mesh.triangles) {
        for (int corner = 0; corner < 3; ++corner) {
            promise(triangle[corner] < vertex_count, "indices in range");
        }
    }
    std::size_t covered = 0;
    for (const core::MeshPart& part : mesh.parts) {
        promise(part.first_triangle == covered, "parts in order");
        covered += part.triangle_count;
    }
    promise(covered == mesh.triangles.size(), "parts cover all triangles");
}

void check_scene(const core::Scene& scene) {
    for (const core::Mesh& mesh : scene.meshes) check_mesh(mesh);
    for (const core::Instance& instance : scene.instances) {
        promise(instance.mesh < scene.meshes.size(), "instances name meshes");
        promise(instance.materials.size() == scene.meshes[instance.mesh].parts.size(), "one material a part");
        for (const std::uint32_t material : instance.materials) {
            promise(material < scene.materials.size(), "instances name materials");
        }
    }
    for (const core::Texture& texture : scene.textures) {
        promise(texture.image < scene.images.size(), "textures name images");
    }
}

void sample_textures(const core::Scene& scene) {
    constexpr float kEdges[] = {0.0f,   -0.0f,       0.5f,   1.0f,
                                -1e-7f, 0.99999994f, 2.0f,   -1e9f,
                                1e-40f, 1.5e30f,     -3e38f, std::numeric_limits<float>::quiet_NaN()};
    for (const core::Texture& texture : scene.textures) {
        for (const float u : kEdges) {
            for (const float v : kEdges) {
                core::sample_texture(texture, scene.images[texture.image], {u, v}, true);
            }
        }
    }
}

void render(const core::Scene& scene, const core::Camera& camera, const core::Tracer& tracer) {
    core::PathTracer({.samples_per_pixel = 1, .bounces = 2})
        .render({.scene = scene,
                 .camera = camera,
                 .tracer = tracer,
                 .primary = tracer,
                 .width = 3,
                 .height = 2,
                 .crop = {},
                 .seed = 1,
                 .aovs = {"Depth", "Normal", "Albedo"},
                 .time_budget_seconds = 0.0,
                 .progress = {},
                 .stop_requested = {}});
}

}  // namespace

void exercise_scene(const core::Scene& scene) {
    check_scene(scene);
    const core::DoubleBounds bounds = core::world_bounds(scene);
    core::scene_hash(scene);
    core::has_emissive_surface(scene);
    sample_textures(scene);
    const std::uint64_t triangle_count = core::drawn_triangle_count(scene);
    if (triangle_count == 0 || triangle_count > kMostTriangles || scene.meshes.size() > kMostMeshes ||
        scene.instances.size() > kMostInstances) {
        return;
    }
    const core::Camera camera = scene.cameras.empty() ? core::framing(bounds, 1.5) : scene.cameras.front();
    render(scene, camera, core::TriangleTracer(scene));
    sdf::BakeSettings settings;
    settings.resolution = 6;
    settings.max_dimension = 16;
    const sdf::BakeResult baked = sdf::bake_scene(scene, settings, {});
    render(scene, camera, sdf::SdfTracer(scene, sdf::grids_by_mesh(scene, baked)));
}

}  // namespace fuzz
