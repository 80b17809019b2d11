#include "core/scene/gltf_lights_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace core {

namespace {

constexpr double kPi = 3.14159265358979323846;

glm::dvec3 unit_direction(const glm::dvec3& vector, const JsonElement& node) {
    const double length = glm::length(vector);
    if (!(length > 0.0) || !std::isfinite(length)) {
        node.fail("its transform is singular; lights and cameras need a direction");
    }
    return vector / length;
}

std::string name_of(const JsonElement& node, const JsonElement& element) {
    const std::string name = node.text_or("name", "");
    return name.empty() ? element.text_or("name", "") : name;
}

glm::vec3 finite_position(const glm::dmat4& world_from_node, const JsonElement& node) {
    const glm::vec3 position(world_from_node[3]);
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(position[axis])) node.fail("its position is not finite");
    }
    return position;
}

double positive(const JsonElement& element, const char* key) {
    const double value = element.require(key).number();
    if (!(value > 0.0)) element.fail(fmt::format("{} is {}; it must be greater than 0", key, value));
    return value;
}

void read_clipping(const JsonElement& projection, Camera& camera) {
    camera.near_distance = projection.require("znear").number();
    if (camera.near_distance < 0.0) projection.fail("znear must not be negative");
    camera.far_distance = projection.number_or("zfar", camera.far_distance);
    if (camera.far_distance <= camera.near_distance) projection.fail("zfar must be greater than znear");
}

}  // namespace

Camera read_camera(const JsonElement& element, const JsonElement& node, const glm::dmat4& world_from_node) {
    Camera camera;
    camera.name = name_of(node, element);
    finite_position(world_from_node, node);
    const glm::dvec3 backward = unit_direction(glm::dvec3(world_from_node[2]), node);
    // x follows from y and z, so that a mirrored node does not mirror the picture.
    const glm::dvec3 right = unit_direction(glm::cross(glm::dvec3(world_from_node[1]), backward), node);
    camera.world_from_camera =
        glm::dmat4(glm::dvec4(right, 0.0), glm::dvec4(glm::cross(backward, right), 0.0),
                   glm::dvec4(backward, 0.0), world_from_node[3]);
    const std::string type = element.require("type").text();
    if (type == "perspective") {
        const JsonElement projection = element.require("perspective");
        camera.vertical_fov = positive(projection, "yfov");
        if (camera.vertical_fov >= kPi) projection.fail("yfov must be less than pi");
        read_clipping(projection, camera);
    } else if (type == "orthographic") {
        const JsonElement projection = element.require("orthographic");
        camera.orthographic = true;
        camera.magnification = {positive(projection, "xmag"), positive(projection, "ymag")};
        read_clipping(projection, camera);
    } else {
        element.fail(fmt::format("type '{}' is neither perspective nor orthographic", type));
    }
    return camera;
}

std::optional<Light> read_light(GltfDocument& document, const JsonElement& reference, const JsonElement& node,
                                const glm::dmat4& world_from_node) {
    const auto extension = document.root().extension("KHR_lights_punctual");
    if (!extension) reference.fail("the file itself has no KHR_lights_punctual with lights");
    const JsonElement lights = extension->require("lights");
    const JsonElement element = lights.at(reference.require("light").index(lights.size(), "lights"));

    const glm::dvec3 color = element.vec3_or("color", glm::dvec3(1.0));
    const double intensity = element.number_or("intensity", 1.0);
    glm::vec3 colored_intensity;
    for (int i = 0; i < 3; ++i) {
        colored_intensity[i] = static_cast<float>(intensity * color[i]);
        if (!(colored_intensity[i] >= 0.0f) || !std::isfinite(colored_intensity[i])) {
            element.fail("its intensity times its color must be finite and not negative");
        }
    }
    const std::string name = name_of(node, element);
    const glm::vec3 position = finite_position(world_from_node, node);
    const std::string type = element.require("type").text();
    if (type == "point") return PointLight{name, position, colored_intensity};

    const glm::vec3 direction(unit_direction(-glm::dvec3(world_from_node[2]), node));
    if (type == "directional") return DirectionalLight{name, direction, colored_intensity, 0.0f};
    if (type != "spot") {
        document.warn_once(
            fmt::format("{}: type '{}' is none of point, spot, directional; the light is left out",
                        element.path(), type));
        return std::nullopt;
    }
    double inner = 0.0;
    double outer = kPi / 4.0;
    if (const auto spot = element.find("spot")) {
        inner = spot->number_or("innerConeAngle", inner);
        outer = spot->number_or("outerConeAngle", outer);
        // The slack lets pi / 2 through when it was written as a float.
        if (!(inner >= 0.0 && inner < outer && outer <= kPi / 2.0 + 1e-6)) {
            spot->fail(
                fmt::format("innerConeAngle {} and outerConeAngle {} must be in order: 0 <= inner < outer "
                            "<= pi / 2",
                            inner, outer));
        }
    } else {
        document.warn_once(
            fmt::format("{}: 'spot' is missing; its cone has the default angles", element.path()));
    }
    SpotLight light;
    light.name = name;
    light.position = position;
    light.direction = direction;
    light.intensity = colored_intensity;
    light.cos_inner = static_cast<float>(std::cos(inner));
    light.cos_outer = static_cast<float>(std::max(std::cos(outer), 0.0));
    return light;
}

}  // namespace core
