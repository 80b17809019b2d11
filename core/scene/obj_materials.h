// core/scene/obj_materials.h: the material libraries and pictures beside an OBJ file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "core/scene/mtl_file.h"
#include "core/scene/scene.h"
#include "core/scene/warning_list.h"

namespace core {

/// Reads libraries as they are named, and brings those materials into the scene that are used. Files are
/// found under the rules of gltf_uri. Missing libraries, missing pictures and pictures in other formats than
/// PNG and JPEG are warned about; paths that must not be followed and damaged pictures are errors.
class ObjMaterials {
public:
    /// @param path of the OBJ file. @param scene gets the materials, textures and images.
    ObjMaterials(const std::filesystem::path& path, bool allow_external, Scene& scene, WarningList& warnings);

    /// What follows `mtllib`: one name, with or without spaces, or several. @param line for messages
    void read_libraries(std::string_view names, std::size_t line);

    /// The index in the scene of a material; an empty name asks for plain_material(), which an unknown one
    /// gets, too.
    std::uint32_t index_of(const std::string& name, bool has_vertex_colors);

private:
    struct Source {
        std::filesystem::path folder;
        std::string file_name;
    };

    bool try_library(const std::string& name, std::size_t line);
    TextureUse use(const std::optional<MtlTexture>& texture, const Source& source);
    int image_of(const MtlTexture& texture, const Source& source);

    std::filesystem::path folder_;
    std::string file_name_;
    bool allow_external_;
    Scene& scene_;
    WarningList& warnings_;
    MtlLibrary library_;
    std::map<std::string, Source, std::less<>> source_of_material_;
    std::set<std::string> libraries_;
    std::size_t name_count_ = 0;
    std::map<std::string, std::uint32_t> index_of_name_;
    std::map<std::string, int> image_of_path_;  ///< -1: cannot be shown.
    std::map<std::pair<int, bool>, int> texture_of_image_;
};

}  // namespace core
