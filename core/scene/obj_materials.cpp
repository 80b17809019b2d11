#include "core/scene/obj_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "core/scene/gltf_uri.h"
#include "core/scene/mesh_assembly.h"
#include "core/scene/text_scanner.h"
#include "core/support/error.h"

namespace core {

namespace {

/// Each is looked for on disk, which takes time even where there is none.
constexpr std::size_t kMostLibraryNames = 1000;
constexpr std::size_t kMostPictures = 10'000;

/// A longer line can only be several names.
constexpr std::size_t kLongestFileName = 255;

/// The bytes of a file, or nothing if there is none.
std::optional<std::vector<std::uint8_t>> read_if_there(const std::string& name,
                                                       const std::filesystem::path& folder,
                                                       bool allow_external, const std::string& what) {
    try {
        return read_named_file(name, folder, allow_external, what);
    } catch (const InputError& error) {
        if (error.kind() != ErrorKind::kNoInput) throw;
        return std::nullopt;
    }
}

}  // namespace

ObjMaterials::ObjMaterials(const std::filesystem::path& path, bool allow_external, Scene& scene,
                           WarningList& warnings)
    : folder_(path.parent_path()),
      file_name_(path.filename().string()),
      allow_external_(allow_external),
      scene_(scene),
      warnings_(warnings) {}

void ObjMaterials::read_libraries(std::string_view names, std::size_t line) {
    std::string all(names);
    std::replace(all.begin(), all.end(), '\\', '/');
    if (all.empty()) {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("'{}': line {}: mtllib names no file", file_name_, line));
    }
    TextScanner scanner(all);
    std::vector<std::string> parts;
    for (std::string_view word = scanner.word(); !word.empty(); word = scanner.word()) {
        parts.emplace_back(word);
    }
    name_count_ += parts.size();
    if (name_count_ > kMostLibraryNames) {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("'{}': line {}: names more than {} material libraries", file_name_, line,
                                     kMostLibraryNames));
    }
    if (all.size() <= kLongestFileName && try_library(all, line)) return;
    for (const std::string& part : parts) {
        if ((parts.size() > 1 || all.size() > kLongestFileName) && try_library(part, line)) continue;
        warnings_.add(
            fmt::format("line {}: material library '{}' does not exist; its materials are plain grey", line,
                        quotable(part)));
    }
}

bool ObjMaterials::try_library(const std::string& name, std::size_t line) {
    const std::filesystem::path relative = std::filesystem::path(name).lexically_normal();
    if (libraries_.count(relative.string()) > 0) return true;
    const std::string what = fmt::format("'{}': line {}: material library", file_name_, line);
    const auto bytes = read_if_there(name, folder_, allow_external_, what);
    if (!bytes) return false;
    libraries_.insert(relative.string());
    MtlLibrary read;
    const Source source{folder_ / relative.parent_path(), relative.filename().string()};
    read_mtl(*bytes, source.file_name, read, warnings_);
    for (auto& [material, contents] : read) {
        if (library_.try_emplace(material, std::move(contents)).second) {
            source_of_material_.try_emplace(material, source);
        }
    }
    return true;
}

std::uint32_t ObjMaterials::index_of(const std::string& name, bool has_vertex_colors) {
    const auto next = static_cast<std::uint32_t>(scene_.materials.size());
    const auto [entry, is_new] = index_of_name_.try_emplace(name, next);
    if (!is_new) return entry->second;
    const auto found = library_.find(name);
    if (found == library_.end()) {
        Material plain = plain_material(has_vertex_colors);
        if (!name.empty()) {
            plain.name = name;
            // Where the library is missing, that was said.
            if (!library_.empty()) {
                warnings_.add(
                    fmt::format("material '{}' is in no library and becomes plain grey", quotable(name)));
            }
        }
        scene_.materials.push_back(std::move(plain));
        return entry->second;
    }
    const MtlMaterial& described = found->second;
    const Source& source = source_of_material_.find(name)->second;
    Material material = described.material;
    material.base_color_texture = use(described.color, source);
    material.emission_texture = use(described.emission, source);
    material.normal_texture = use(described.normal, source);
    if (described.emission_is_texture_alone && !material.emission_texture.present()) {
        material.emission = glm::vec3(0.0f);
    }
    scene_.materials.push_back(std::move(material));
    return entry->second;
}

TextureUse ObjMaterials::use(const std::optional<MtlTexture>& texture, const Source& source) {
    TextureUse result;
    if (!texture) return result;
    const int image = image_of(*texture, source);
    if (image < 0) return result;
    const auto next = static_cast<int>(scene_.textures.size());
    const auto [entry, is_new] = texture_of_image_.try_emplace({image, texture->clamp}, next);
    if (is_new) {
        Texture& added = scene_.textures.emplace_back();
        added.image = static_cast<std::uint32_t>(image);
        if (texture->clamp) added.wrap_u = added.wrap_v = TextureWrap::kClampToEdge;
    }
    result.texture = entry->second;
    result.uv_from_mesh_uv = texture->uv_from_mesh_uv;
    return result;
}

int ObjMaterials::image_of(const MtlTexture& texture, const Source& source) {
    const std::string key = (source.folder / texture.file).lexically_normal().string();
    const auto [entry, is_new] = image_of_path_.try_emplace(key, -1);
    if (!is_new) return entry->second;
    const std::string what = fmt::format("'{}': line {}: texture", source.file_name, texture.line);
    if (image_of_path_.size() > kMostPictures) {
        throw InputError(ErrorKind::kBadData, fmt::format("{} '{}' is one of more than {}; fewer are read",
                                                          what, quotable(texture.file), kMostPictures));
    }
    const auto bytes = read_if_there(texture.file, source.folder, allow_external_, what);
    if (!bytes || !is_texture_image(*bytes)) {
        warnings_.add(fmt::format("{} '{}' {}; the colour beside it stands alone", what,
                                  quotable(texture.file),
                                  bytes ? "is neither PNG nor JPEG" : "does not exist"));
        return -1;
    }
    entry->second = static_cast<int>(scene_.images.size());
    scene_.images.push_back(
        decode_texture_image(*bytes, fmt::format("{} '{}'", what, quotable(texture.file))));
    scene_.images.back().name = texture.file;
    return entry->second;
}

}  // namespace core
