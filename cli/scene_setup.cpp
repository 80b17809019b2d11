#include "cli/scene_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "core/scene/scene_loader.h"
#include "core/support/error.h"

namespace cli {

namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

core::InputError usage_error(const std::string& message) {
    return core::InputError(core::ErrorKind::kUsage, message);
}

glm::dvec3 parse_vector(const std::string& flag, const std::string& text) {
    const std::vector<double> numbers = parse_numbers(flag, text, 3, 3);
    return {numbers[0], numbers[1], numbers[2]};
}

bool looks_like_file(const std::string& text) {
    const std::string extension = std::filesystem::path(text).extension().string();
    return extension == ".exr" || extension == ".hdr";
}

void add_sky(const Program& program, const SceneOptions& options, core::Scene& scene) {
    if (options.sky.empty()) {
        if (!options.sun.empty() || !scene.lights.empty() || core::has_emissive_surface(scene)) return;
        scene.sky = core::Sky::constant(glm::vec3(kDefaultSkyRadiance));
        scene.sky_description = fmt::format("{0},{0},{0}", kDefaultSkyRadiance);
        note(program,
             fmt::format("'{}' has no light: added a constant sky of {} cd/m^2 (--sky, --sun change that)",
                         scene.name, kDefaultSkyRadiance));
        return;
    }
    scene.sky_description = options.sky;
    if (options.sky == "none") return;
    if (looks_like_file(options.sky)) {
        scene.sky = core::Sky::read(options.sky,
                                    static_cast<float>(options.sky_rotation_degrees * kRadiansPerDegree));
        // The picture matters to the pixels, its folder does not.
        scene.sky_description = std::filesystem::path(options.sky).filename().string();
        return;
    }
    const glm::dvec3 radiance = parse_vector("--sky", options.sky);
    if (std::min({radiance.x, radiance.y, radiance.z}) < 0.0) {
        throw usage_error(fmt::format("--sky {}: radiance cannot be negative", options.sky));
    }
    scene.sky = core::Sky::constant(glm::vec3(radiance));
}

void add_sun(const SceneOptions& options, core::Scene& scene) {
    if (options.sun.empty()) return;
    const std::vector<double> numbers = parse_numbers("--sun", options.sun, 3, 4);
    const double diameter = numbers.size() > 3 ? numbers[3] : kSunDiameterDegrees;
    if (numbers[1] < -90.0 || numbers[1] > 90.0 || numbers[2] < 0.0 || diameter < 0.0 || diameter > 180.0) {
        throw usage_error(fmt::format(
            "--sun {}: elevation is in [-90, 90], lux at least 0, diameter in [0, 180]", options.sun));
    }
    scene.lights.emplace_back(core::make_sun(static_cast<float>(numbers[0] * kRadiansPerDegree),
                                             static_cast<float>(numbers[1] * kRadiansPerDegree),
                                             static_cast<float>(numbers[2]),
                                             static_cast<float>(diameter * kRadiansPerDegree)));
}

}  // namespace

std::vector<double> parse_numbers(const std::string& flag, const std::string& text, std::size_t least,
                                  std::size_t most) {
    std::vector<double> numbers;
    bool good = true;
    for (std::size_t begin = 0; good && begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        double value = 0.0;
        const auto [rest, error] = std::from_chars(text.data() + begin, text.data() + end, value);
        good = error == std::errc() && rest == text.data() + end && std::isfinite(value);
        numbers.push_back(value);
        begin = end + 1;
    }
    if (!good || numbers.size() < least || numbers.size() > most) {
        throw usage_error(
            fmt::format("{} {}: takes {} numbers with commas between", flag, text,
                        least == most ? std::to_string(least) : fmt::format("{} to {}", least, most)));
    }
    return numbers;
}

glm::ivec2 parse_size(const std::string& text) {
    constexpr int kMaxDimension = 1 << 15;
    const std::size_t cross = text.find('x');
    const char* end = text.data() + text.size();
    int width = 0, height = 0;
    if (cross != std::string::npos) {
        const auto first = std::from_chars(text.data(), text.data() + cross, width);
        const auto second = std::from_chars(text.data() + cross + 1, end, height);
        if (first.ptr != text.data() + cross || second.ptr != end) width = height = 0;
    }
    if (width < 1 || height < 1 || width > kMaxDimension || height > kMaxDimension) {
        throw usage_error(fmt::format("--size {}: takes WIDTHxHEIGHT, such as 1280x720, each from 1 to {}",
                                      text, kMaxDimension));
    }
    return {width, height};
}

void add_scene_file(CLI::App& verb, SceneOptions& options) {
    verb.add_option("SCENE", options.file, "A " + core::scene_file_endings() + " file")->required();
}

void add_scene_options(CLI::App& verb, SceneOptions& options) {
    verb.add_option("--scene", options.scene, "Name or number of the glTF scene");
    verb.add_option(
        "--sky", options.sky,
        "none, R,G,B in cd/m^2, or a latitude-longitude .hdr or .exr; a scene without any light gets "
        "1,1,1");
    verb.add_option("--sky-rotation", options.sky_rotation_degrees, "Degrees about +Y")
        ->capture_default_str();
    verb.add_option(
        "--sun", options.sun,
        "AZIMUTH,ELEVATION,LUX[,DIAMETER]: degrees from +Z towards +X, degrees above the horizon, lx, "
        "degrees (default 0.53)");
}

void add_camera_options(CLI::App& verb, SceneOptions& options) {
    verb.add_option("--camera", options.camera, "Name or number of a camera of the file");
    CLI::Option* eye = verb.add_option("--eye", options.eye, "X,Y,Z of the camera");
    verb.add_option("--look-at", options.look_at, "X,Y,Z that it looks at")->needs(eye);
    verb.add_option("--up", options.up, "X,Y,Z that is up (default 0,1,0)")->needs(eye);
    verb.add_option("--fov", options.fov_degrees, "Vertical field of view in degrees, with --eye")
        ->needs(eye)
        ->check(CLI::Range(0.01, 179.0))
        ->capture_default_str();
}

core::Scene load_scene(const Program& program, const SceneOptions& options) {
    core::Scene scene = core::load_scene_file(options.file, {options.scene, program.common.allow_external});
    for (const std::string& warning : scene.warnings) warn(program, warning);
    add_sun(options, scene);
    add_sky(program, options, scene);
    return scene;
}

core::Camera choose_camera(const Program& program, const SceneOptions& options, const core::Scene& scene,
                           double aspect) {
    if (!options.eye.empty()) {
        if (!options.camera.empty()) throw usage_error("--eye and --camera exclude each other");
        if (options.look_at.empty()) throw usage_error("--eye needs --look-at X,Y,Z");
        const glm::dvec3 eye = parse_vector("--eye", options.eye);
        const glm::dvec3 target = parse_vector("--look-at", options.look_at);
        const glm::dvec3 up =
            options.up.empty() ? glm::dvec3(0.0, 1.0, 0.0) : parse_vector("--up", options.up);
        const glm::dvec3 view = target - eye;
        if (!(glm::length(view) > 0.0))
            throw usage_error("--look-at is where --eye is; it must be elsewhere");
        if (!(glm::length(glm::cross(view, up)) > 1e-9 * glm::length(view) * glm::length(up))) {
            throw usage_error("--up is along the view; choose another, such as --up 0,0,1");
        }
        return core::look_at(eye, target, up, options.fov_degrees * kRadiansPerDegree);
    }
    if (!options.camera.empty()) {
        for (const core::Camera& camera : scene.cameras) {
            if (camera.name == options.camera) return camera;
        }
        std::size_t index = 0;
        const char* end = options.camera.data() + options.camera.size();
        const auto [rest, error] = std::from_chars(options.camera.data(), end, index);
        if (error == std::errc() && rest == end && index < scene.cameras.size()) return scene.cameras[index];
        std::string names;
        for (const core::Camera& camera : scene.cameras) names += (names.empty() ? "" : ", ") + camera.name;
        throw usage_error(fmt::format("--camera {}: '{}' has {} camera(s){}{}", options.camera, scene.name,
                                      scene.cameras.size(), names.empty() ? "" : ": ", names));
    }
    if (!scene.cameras.empty()) return scene.cameras.front();
    note(program,
         fmt::format("'{}' has no camera: framed from the front (--eye, --look-at change that)", scene.name));
    return core::framing(core::world_bounds(scene), aspect);
}

}  // namespace cli
