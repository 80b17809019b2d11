#include "core/scene/scene_loader.h"

#include <fmt/format.h>

#include <array>
#include <span>
#include <string_view>

#include "core/scene/gltf_loader.h"
#include "core/scene/gltf_uri.h"
#include "core/scene/obj_file.h"
#include "core/scene/ply_file.h"
#include "core/scene/stl_file.h"
#include "core/scene/text_scanner.h"
#include "core/support/error.h"

namespace core {

namespace {

constexpr std::array<std::string_view, 5> kEndings = {".gltf", ".glb", ".obj", ".ply", ".stl"};

/// The ending that the first bytes ask for; empty where they could be several things.
std::string_view ending_by_content(std::span<const std::uint8_t> bytes) {
    const std::string_view text = as_text(bytes);
    if (text.substr(0, 4) == "glTF") return ".glb";
    if (text.substr(0, 4) == "ply\n" || text.substr(0, 4) == "ply\r") return ".ply";
    if (text.substr(0, 1) == "{") return ".gltf";
    return {};
}

}  // namespace

bool is_scene_file(const std::filesystem::path& path) {
    const std::string ending = lower_case(path.extension().string());
    for (const std::string_view known : kEndings) {
        if (ending == known) return true;
    }
    return false;
}

std::string scene_file_endings() {
    std::string text;
    for (std::size_t i = 0; i < kEndings.size(); ++i) {
        if (i > 0) text += i + 1 == kEndings.size() ? " or " : ", ";
        text += kEndings[i];
    }
    return text;
}

Scene load_scene_file(const std::filesystem::path& path, const LoadOptions& options) {
    const std::string file_name = path.filename().string();
    const std::string ending = lower_case(path.extension().string());
    if (!is_scene_file(path)) {
        throw InputError(ErrorKind::kUsage, fmt::format("'{}': is no scene that can be read; those end in {}",
                                                        file_name, scene_file_endings()));
    }
    if (ending == ".gltf" || ending == ".glb") return load_gltf(path, options);
    if (!options.scene.empty()) {
        throw InputError(ErrorKind::kUsage,
                         fmt::format("'{}': scene '{}' is asked for, but only glTF files hold several scenes",
                                     file_name, options.scene));
    }
    const std::vector<std::uint8_t> bytes = read_whole_file(path, fmt::format("scene '{}'", file_name));
    const std::string_view content = ending_by_content(bytes);
    if (!content.empty() && content != ending) {
        throw InputError(
            ErrorKind::kUsage,
            fmt::format("'{}': holds {} by its first bytes; rename it to end in that", file_name, content));
    }
    if (ending == ".obj") return read_obj(bytes, path, options);
    return ending == ".ply" ? read_ply(bytes, file_name) : read_stl(bytes, file_name);
}

}  // namespace core
