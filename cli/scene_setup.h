// cli/scene_setup.h: from a file and flags to a lit scene and a camera; shared by the verbs that need one.
#pragma once

#include <filesystem>
#include <string>

#include "cli/options.h"
#include "core/scene/scene.h"

namespace cli {

/// The flags that say what is looked at and what lights it.
struct SceneOptions {
    std::filesystem::path file;
    std::string scene;  ///< Name or number; empty: the file's own choice.
    std::string sky;    ///< none, R,G,B, or a file; empty: none, or the stated default in an unlit scene.
    double sky_rotation_degrees = 0.0;
    std::string sun;               ///< AZIMUTH,ELEVATION,LUX[,DIAMETER_DEG]; empty: none beside the file's.
    std::string camera;            ///< Name or number; empty: the first, or one that frames the scene.
    std::string eye, look_at, up;  ///< X,Y,Z.
    double fov_degrees = 45.0;     ///< Vertical, with --eye.
};

/// The sun's apparent diameter where --sun does not say.
inline constexpr double kSunDiameterDegrees = 0.53;

/// Radiance of the sky that a scene without any light gets, cd/m^2, from everywhere.
inline constexpr float kDefaultSkyRadiance = 1.0f;

/// The file, as the verb's first argument.
void add_scene_file(CLI::App& verb, SceneOptions& options);
/// Which of the file's scenes, and what lights it beside the file's own lights.
void add_scene_options(CLI::App& verb, SceneOptions& options);
void add_camera_options(CLI::App& verb, SceneOptions& options);

/// Loads the file, adds sky and sun, and says on stderr what was assumed and what the loader warns of.
/// @throws core::InputError
core::Scene load_scene(const Program& program, const SceneOptions& options);

/// The camera that the flags ask for. @param aspect width over height, for framing.
core::Camera choose_camera(const Program& program, const SceneOptions& options, const core::Scene& scene,
                           double aspect);

/// Comma-separated numbers. @throws core::InputError naming `flag` unless there are between `least` and
/// `most` finite ones.
std::vector<double> parse_numbers(const std::string& flag, const std::string& text, std::size_t least,
                                  std::size_t most);

/// WIDTHxHEIGHT. @throws core::InputError naming --size
glm::ivec2 parse_size(const std::string& text);

}  // namespace cli
