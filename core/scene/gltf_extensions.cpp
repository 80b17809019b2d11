#include "core/scene/gltf_extensions.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string_view>

namespace core {

namespace {

constexpr std::string_view kReadExtensions[] = {
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
};

/// A known extension that is left out of the picture.
struct LostExtension {
    std::string_view name;
    std::string_view loss;
    /// What it is built on is shown without it; otherwise a file that requires it has nothing to show
    /// instead.
    bool approximated;
};
constexpr LostExtension kLostExtensions[] = {
    {"EXT_texture_avif", "AVIF images are not decoded; their fallbacks are used", false},
    {"EXT_texture_webp", "WebP images are not decoded; their fallbacks are used", false},
    {"KHR_animation_pointer", "animated properties other than those of nodes stand still", true},
    {"KHR_materials_anisotropy", "brushed surfaces reflect alike in all directions", true},
    {"KHR_materials_clearcoat", "clear coats are missing", true},
    {"KHR_materials_diffuse_transmission", "light does not pass through thin diffuse surfaces", true},
    {"KHR_materials_dispersion", "glass does not split colours", true},
    {"KHR_materials_iridescence", "thin-film colours are missing", true},
    {"KHR_materials_sheen", "the sheen of cloth is missing", true},
    {"KHR_materials_transmission", "transparent materials are opaque", true},
    {"KHR_materials_variants", "the default variant is shown", true},
    {"KHR_materials_volume", "absorption and refraction within volumes are missing", true},
    {"KHR_node_visibility", "hidden nodes are shown", false},
    {"KHR_texture_basisu", "Basis Universal images are not decoded; their fallbacks are used", false},
};

bool is_read(const std::string& name) {
    return std::find(std::begin(kReadExtensions), std::end(kReadExtensions), name) !=
           std::end(kReadExtensions);
}

const LostExtension* find_lost(const std::string& name) {
    const auto* found = std::find_if(std::begin(kLostExtensions), std::end(kLostExtensions),
                                     [&](const LostExtension& extension) { return extension.name == name; });
    return found != std::end(kLostExtensions) ? found : nullptr;
}

std::string warning_of(const std::string& name) {
    const LostExtension* lost = find_lost(name);
    return fmt::format("{} is ignored: {}", name, lost ? lost->loss : "whatever it adds is missing");
}

}  // namespace

std::vector<std::string> check_extensions(const JsonElement& root) {
    std::vector<std::string> warnings;
    const auto warn_unless_read = [&](const std::string& name) {
        if (!is_read(name)) warnings.push_back(warning_of(name));
    };
    if (const auto required = root.find("extensionsRequired")) {
        for (std::size_t i = 0; i < required->size(); ++i) {
            const std::string name = required->at(i).text();
            const LostExtension* lost = find_lost(name);
            if (!is_read(name) && !(lost && lost->approximated)) {
                required->at(i).fail(fmt::format(
                    "the file cannot be read without {}, which is not supported; export it without", name));
            }
            // Files may forget to list it as used.
            warn_unless_read(name);
        }
    }
    if (const auto used = root.find("extensionsUsed")) {
        for (std::size_t i = 0; i < used->size(); ++i) warn_unless_read(used->at(i).text());
    }
    return warnings;
}

bool lists_extension(const JsonElement& root, const char* name) {
    for (const char* list : {"extensionsRequired", "extensionsUsed"}) {
        const auto names = root.find(list);
        if (!names) continue;
        for (std::size_t i = 0; i < names->size(); ++i) {
            if (names->at(i).text() == name) return true;
        }
    }
    return false;
}

}  // namespace core
