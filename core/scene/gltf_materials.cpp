#include "core/scene/gltf_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/support/parallel.h"

namespace core {

namespace {

class MaterialReader {
public:
    explicit MaterialReader(GltfDocument& document) : document_(document) {}

    GltfMaterials read() {
        for (std::size_t i = 0; i < document_.count("materials"); ++i) {
            result_.materials.push_back(read_material(document_.element("materials", i)));
        }
        decode_images();
        return std::move(result_);
    }

private:
    Material read_material(const JsonElement& element) {
        Material material;
        material.name = element.text_or("name", "");
        if (const auto pbr = element.find("pbrMetallicRoughness")) read_metallic_roughness(*pbr, material);
        if (const auto normal = element.find("normalTexture")) {
            material.normal_texture = read_texture_use(*normal);
            material.normal_scale = static_cast<float>(normal->number_or("scale", 1.0));
        }
        // Occlusion is for renderers that do not trace it; only its reference is checked.
        if (const auto occlusion = element.find("occlusionTexture")) texture_index(*occlusion);
        read_emission(element, material);
        read_alpha(element, material);
        material.double_sided = element.boolean_or("doubleSided", false);
        material.unlit = element.extension("KHR_materials_unlit").has_value();
        if (const auto ior = element.extension("KHR_materials_ior")) read_ior(*ior, material);
        if (const auto specular = element.extension("KHR_materials_specular")) {
            read_specular(*specular, material);
        }
        return material;
    }

    void read_metallic_roughness(const JsonElement& pbr, Material& material) {
        const glm::dvec4 color = pbr.vec4_or("baseColorFactor", glm::dvec4(1.0));
        for (int i = 0; i < 4; ++i) material.base_color[i] = unit(pbr, "baseColorFactor", color[i]);
        if (const auto texture = pbr.find("baseColorTexture")) {
            material.base_color_texture = read_texture_use(*texture);
        }
        material.metallic = unit(pbr, "metallicFactor", pbr.number_or("metallicFactor", 1.0));
        material.roughness = unit(pbr, "roughnessFactor", pbr.number_or("roughnessFactor", 1.0));
        if (const auto texture = pbr.find("metallicRoughnessTexture")) {
            material.metallic_roughness_texture = read_texture_use(*texture);
        }
    }

    void read_emission(const JsonElement& element, Material& material) {
        double strength = 1.0;
        if (const auto extension = element.extension("KHR_materials_emissive_strength")) {
            strength =
                non_negative(*extension, "emissiveStrength", extension->number_or("emissiveStrength", 1.0));
        }
        const glm::dvec3 factor = element.vec3_or("emissiveFactor", glm::dvec3(0.0));
        for (int i = 0; i < 3; ++i) {
            material.emission[i] =
                static_cast<float>(strength * non_negative(element, "emissiveFactor", factor[i]));
            if (!std::isfinite(material.emission[i])) element.fail("its emission is too large for a float");
        }
        if (const auto texture = element.find("emissiveTexture")) {
            material.emission_texture = read_texture_use(*texture);
        }
    }

    void read_alpha(const JsonElement& element, Material& material) {
        const std::string mode = element.text_or("alphaMode", "OPAQUE");
        if (mode == "MASK") {
            material.alpha_mode = AlphaMode::kMask;
        } else if (mode == "BLEND") {
            material.alpha_mode = AlphaMode::kBlend;
        } else if (mode != "OPAQUE") {
            element.fail(fmt::format("alphaMode '{}' is none of OPAQUE, MASK, BLEND", mode));
        }
        material.alpha_cutoff =
            static_cast<float>(non_negative(element, "alphaCutoff", element.number_or("alphaCutoff", 0.5)));
    }

    void read_ior(const JsonElement& extension, Material& material) {
        const double ior = extension.number_or("ior", 1.5);
        // 0 is the extension's way to ask for full reflection.
        if (ior != 0.0 && ior < 1.0)
            extension.fail(fmt::format("ior is {}; it must be 0 or at least 1", ior));
        material.ior = static_cast<float>(std::min(ior, 1e6));
    }

    void read_specular(const JsonElement& extension, Material& material) {
        material.specular = unit(extension, "specularFactor", extension.number_or("specularFactor", 1.0));
        if (const auto texture = extension.find("specularTexture")) {
            material.specular_texture = read_texture_use(*texture);
        }
        const glm::dvec3 color = extension.vec3_or("specularColorFactor", glm::dvec3(1.0));
        for (int i = 0; i < 3; ++i) {
            material.specular_color[i] =
                static_cast<float>(std::min(non_negative(extension, "specularColorFactor", color[i]), 1e6));
        }
        if (const auto texture = extension.find("specularColorTexture")) {
            material.specular_color_texture = read_texture_use(*texture);
        }
    }

    float unit(const JsonElement& element, const char* key, double value) {
        if (value >= 0.0 && value <= 1.0) return static_cast<float>(value);
        document_.warn_once(
            fmt::format("{}: {} is {}; it must be in [0, 1] and is clamped", element.path(), key, value));
        return value > 0.0 ? 1.0f : 0.0f;
    }

    double non_negative(const JsonElement& element, const char* key, double value) {
        if (value >= 0.0) return value;
        document_.warn_once(
            fmt::format("{}: {} is {}; it must not be negative and counts as 0", element.path(), key, value));
        return 0.0;
    }

    std::size_t texture_index(const JsonElement& info) {
        return info.require("index").index(document_.count("textures"), "textures");
    }

    TextureUse read_texture_use(const JsonElement& info) {
        TextureUse use;
        const std::size_t gltf_texture = texture_index(info);
        std::uint64_t uv_set = info.unsigned_or("texCoord", 0);
        if (const auto transform = info.extension("KHR_texture_transform")) {
            uv_set = transform->unsigned_or("texCoord", uv_set);
            read_transform(*transform, use);
        }
        if (uv_set > 1) {
            document_.warn_once(
                fmt::format("{}: texCoord is {}; only TEXCOORD_0 and TEXCOORD_1 are read, so the "
                            "texture is left out",
                            info.path(), uv_set));
            return use;
        }
        use.uv_set = static_cast<int>(uv_set);
        use.texture = used_texture(gltf_texture);
        return use;
    }

    /// Scale, then rotation, then offset. The rotation turns texture coordinates counter-clockwise as seen in
    /// the picture, whose v runs downwards.
    static void read_transform(const JsonElement& transform, TextureUse& use) {
        const glm::dvec2 offset = transform.vec2_or("offset", glm::dvec2(0.0));
        const glm::dvec2 scale = transform.vec2_or("scale", glm::dvec2(1.0));
        const double rotation = transform.number_or("rotation", 0.0);
        const double sine = std::sin(rotation);
        const double cosine = std::cos(rotation);
        use.uv_from_mesh_uv[0] = glm::vec2(scale.x * cosine, -scale.x * sine);
        use.uv_from_mesh_uv[1] = glm::vec2(scale.y * sine, scale.y * cosine);
        use.uv_from_mesh_uv[2] = glm::vec2(offset);
    }

    /// The index in the result of a glTF texture; -1 if it has no image that can be read.
    int used_texture(std::size_t gltf_texture) {
        const auto known = texture_of_gltf_.find(gltf_texture);
        if (known != texture_of_gltf_.end()) return known->second;
        const JsonElement element = document_.element("textures", gltf_texture);
        int index = -1;
        if (const auto source = element.find("source")) {
            Texture texture;
            texture.image = used_image(source->index(document_.count("images"), "images"));
            if (const auto sampler = element.find("sampler")) {
                read_sampler(
                    document_.element("samplers", sampler->index(document_.count("samplers"), "samplers")),
                    texture);
            }
            index = static_cast<int>(result_.textures.size());
            result_.textures.push_back(texture);
        } else {
            document_.warn_once(
                fmt::format("{}: has no image in a format that is read, so it is left out", element.path()));
        }
        texture_of_gltf_.emplace(gltf_texture, index);
        return index;
    }

    static void read_sampler(const JsonElement& sampler, Texture& texture) {
        constexpr std::uint64_t kNearest = 9728;
        constexpr std::uint64_t kLinear = 9729;
        const std::uint64_t filter = sampler.unsigned_or("magFilter", kLinear);
        if (filter != kNearest && filter != kLinear) {
            sampler.fail(fmt::format("magFilter is {}; it must be 9728 or 9729", filter));
        }
        texture.nearest = filter == kNearest;
        texture.wrap_u = read_wrap(sampler, "wrapS");
        texture.wrap_v = read_wrap(sampler, "wrapT");
    }

    static TextureWrap read_wrap(const JsonElement& sampler, const char* key) {
        const std::uint64_t wrap = sampler.unsigned_or(key, 10497);
        switch (wrap) {
            case 10497:
                return TextureWrap::kRepeat;
            case 33071:
                return TextureWrap::kClampToEdge;
            case 33648:
                return TextureWrap::kMirroredRepeat;
            default:
                sampler.fail(fmt::format("{} is {}; it must be 10497, 33071 or 33648", key, wrap));
        }
    }

    std::uint32_t used_image(std::size_t gltf_image) {
        const auto next = static_cast<std::uint32_t>(gltf_images_.size());
        const auto [entry, is_new] = image_of_gltf_.try_emplace(gltf_image, next);
        if (is_new) gltf_images_.push_back(gltf_image);
        return entry->second;
    }

    void decode_images() {
        result_.images.resize(gltf_images_.size());
        std::vector<std::exception_ptr> errors(gltf_images_.size());
        parallel_for(gltf_images_.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                try {
                    const JsonElement element = document_.element("images", gltf_images_[i]);
                    const std::vector<std::uint8_t> encoded = document_.read_image(gltf_images_[i]);
                    result_.images[i] = decode_texture_image(
                        encoded, fmt::format("{} {}", document_.file_name(), element.path()));
                    result_.images[i].name = element.text_or("name", "");
                } catch (...) {
                    errors[i] = std::current_exception();
                }
            }
        });
        // The first in the file's order, whichever thread was faster.
        for (const std::exception_ptr& error : errors) {
            if (error) std::rethrow_exception(error);
        }
    }

    GltfDocument& document_;
    GltfMaterials result_;
    std::map<std::size_t, int> texture_of_gltf_;
    std::map<std::size_t, std::uint32_t> image_of_gltf_;
    std::vector<std::size_t> gltf_images_;
};

}  // namespace

GltfMaterials load_materials(GltfDocument& document) {
    return MaterialReader(document).read();
}

}  // namespace core
