#include "tests/support/render_scenes.h"

#include <algorithm>
#include <optional>

#include "core/trace/triangle_tracer.h"
#include "tests/support/analytic_scenes.h"

namespace tests {

namespace {

/// Three vertices of their own for each triangle, with the face's normal.
core::Mesh flat_shaded(const core::Mesh& mesh) {
    std::vector<glm::vec3> positions, normals;
    std::vector<glm::uvec3> triangles;
    for (const glm::uvec3& corners : mesh.triangles) {
        const auto first = static_cast<std::uint32_t>(positions.size());
        for (int c = 0; c < 3; ++c) positions.push_back(mesh.positions[corners[c]]);
        const glm::vec3 normal = glm::normalize(
            glm::cross(positions[first + 1] - positions[first], positions[first + 2] - positions[first]));
        normals.insert(normals.end(), 3, normal);
        triangles.emplace_back(first, first + 1, first + 2);
    }
    return make_mesh(mesh.name, std::move(positions), std::move(normals), {}, std::move(triangles));
}

core::Scene room() {
    core::Scene scene;
    scene.name = "room";
    const std::uint32_t white = add_material(scene, lambert(glm::vec3(0.75f)));
    const std::uint32_t red = add_material(scene, lambert({0.65f, 0.06f, 0.05f}));
    const std::uint32_t green = add_material(scene, lambert({0.12f, 0.45f, 0.1f}));
    const std::uint32_t wall = add_mesh(scene, box({1.1f, 1.1f, 0.05f}));
    const std::uint32_t block = add_mesh(scene, box(glm::vec3(0.3f)));
    const double half_pi = 1.5707963267948966;
    add_instance(scene, wall, translation({0, 0, -1.05}), white);
    add_instance(scene, wall, translation({0, -1.05, 0}) * rotation(half_pi, {1, 0, 0}), white);
    add_instance(scene, wall, translation({0, 1.05, 0}) * rotation(half_pi, {1, 0, 0}), white);
    add_instance(scene, wall, translation({-1.05, 0, 0}) * rotation(half_pi, {0, 1, 0}), red);
    add_instance(scene, wall, translation({1.05, 0, 0}) * rotation(half_pi, {0, 1, 0}), green);
    add_instance(scene, block, translation({0.4, -0.7, 0.1}) * rotation(0.4, {0, 1, 0}), white);
    add_instance(scene, block,
                 translation({-0.4, -0.4, -0.4}) * rotation(-0.3, {0, 1, 0}) * scaling({1, 2, 1}), white);
    return scene;
}

void add_lamp(core::Scene& scene, float radiance) {
    core::Material lamp = lambert(glm::vec3(0.3f));
    lamp.emission = glm::vec3(radiance);
    const std::uint32_t material = add_material(scene, lamp);
    const std::uint32_t mesh = add_mesh(scene, box({0.3f, 0.02f, 0.3f}));
    add_instance(scene, mesh, translation({0, 0.9, 0}), material);
}

}  // namespace

core::Scene furnace(float rho) {
    // Flat shading: with smooth normals on flat faces the BRDF sends light below the face, where it is lost.
    core::Scene scene = scene_of(flat_shaded(icosphere(2)));
    scene.materials[0] = lambert(glm::vec3(rho));
    scene.materials[0].emission = glm::vec3(1.0f - rho);
    return scene;
}

core::Scene lamp_in_sphere() {
    // Level 4: the polyhedron's mean distance is 0.3 % under 1, and irradiance rises with 1/d^2 while the
    // cosine stays 1 within 1e-3: 0.1 % of the mean, since the solid angle it fills is the whole sphere.
    core::Scene scene = scene_of(flat_shaded(icosphere(4)));
    scene.materials[0] = lambert(glm::vec3(0.5f));
    scene.lights.emplace_back(core::PointLight{"lamp", glm::vec3(0.0f), glm::vec3(3.14159265f)});
    return scene;
}

core::Scene mixed_room(float intensity) {
    core::Scene scene = room();
    add_lamp(scene, 5.0f * intensity);
    scene.lights.emplace_back(
        core::PointLight{"point", {-0.6f, 0.2f, 0.5f}, glm::vec3(0.7f, 0.6f, 0.5f) * intensity});
    scene.lights.emplace_back(core::make_sun(0.3f, 0.5f, 2.0f * intensity, 0.01f));
    scene.sky = core::Sky::constant(glm::vec3(0.3f, 0.4f, 0.6f) * intensity);
    return scene;
}

core::Scene area_lit_room() {
    core::Scene scene = room();
    add_lamp(scene, 5.0f);
    return scene;
}

core::Sky peaked_sky() {
    core::Image image(8, 4);
    for (const char* channel : {"R", "G", "B"}) {
        std::vector<float>& values = image.add_channel(channel);
        std::fill(values.begin(), values.end(), 1.0f);
        values[1 * 8 + 3] = 30.0f;
    }
    return core::Sky::latitude_longitude(image, 0.0f, "peaked");
}

core::Camera inside_camera() {
    return core::look_at({0.2, 0.1, 0.3}, {-0.5, -0.2, -0.8}, {0, 1, 0}, 1.2);
}

core::Camera room_camera() {
    return core::look_at({0, 0, 3.2}, {0, 0, 0}, {0, 1, 0}, 0.75);
}

core::Frame render(const core::Scene& scene, const core::Camera& camera, const RenderRequest& request) {
    std::optional<core::TriangleTracer> triangles;
    const core::Tracer& tracer = request.tracer ? *request.tracer : triangles.emplace(scene);
    core::PathTracer renderer({request.samples_per_pixel, request.bounces, request.light_sampling});
    return renderer.render({.scene = scene,
                            .camera = camera,
                            .tracer = tracer,
                            .primary = tracer,
                            .width = request.width,
                            .height = request.height,
                            .crop = {},
                            .seed = request.seed,
                            .aovs = request.aovs,
                            .time_budget_seconds = request.time_budget_seconds,
                            .progress = {},
                            .stop_requested = {}});
}

double mean_radiance(const core::Image& image) {
    double sum = 0.0;
    for (const char* channel : {"R", "G", "B"}) {
        for (const float value : *image.find(channel)) sum += static_cast<double>(value);
    }
    return sum / (3.0 * static_cast<double>(image.pixel_count()));
}

double mean_squared_error(const core::Image& a, const core::Image& b) {
    double sum = 0.0;
    for (const char* channel : {"R", "G", "B"}) {
        const std::vector<float>& first = *a.find(channel);
        const std::vector<float>& second = *b.find(channel);
        for (std::size_t i = 0; i < first.size(); ++i) {
            const double difference = static_cast<double>(first[i]) - static_cast<double>(second[i]);
            sum += difference * difference;
        }
    }
    return sum / (3.0 * static_cast<double>(a.pixel_count()));
}

}  // namespace tests
