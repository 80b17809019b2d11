#include "core/scene/gltf_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/support/memory.h"
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
        load_images();
        return std::move(result_);
    }

private:
    /// An image of the file, or the roughness made from its A.
    struct ImageSource {
        std::size_t gltf_image;
        std::optional<float> glossiness;
    };

    Material read_material(const JsonElement& element) {
        Material material;
        material.name = element.text_or("name", "");
        material.unlit = element.extension("KHR_materials_unlit").has_value();
        const auto specular_glossiness = element.extension("KHR_materials_pbrSpecularGlossiness");
        // Where both are given this one wins, but what is unlit has its colour from the core material.
        if (specular_glossiness && !material.unlit) {
            read_specular_glossiness(*specular_glossiness, material);
        } else {
            read_core_surface(element, material);
        }
        if (const auto normal = element.find("normalTexture")) {
            material.normal_texture = read_texture_use(*normal);
            material.normal_scale = static_cast<float>(normal->number_or("scale", 1.0));
        }
        // Occlusion is for renderers that do not trace it; only its reference is checked.
        if (const auto occlusion = element.find("occlusionTexture")) texture_index(*occlusion);
        read_emission(element, material);
        read_alpha(element, material);
        material.double_sided = element.boolean_or("doubleSided", false);
        return material;
    }

    void read_core_surface(const JsonElement& element, Material& material) {
        if (const auto pbr = element.find("pbrMetallicRoughness")) read_metallic_roughness(*pbr, material);
        if (const auto ior = element.extension("KHR_materials_ior")) read_ior(*ior, material);
        if (const auto specular = element.extension("KHR_materials_specular")) {
            read_specular(*specular, material);
        }
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

    /// The conversion that KHR_materials_specular publishes, which loses nothing: a dielectric whose F0 is
    /// the specular colour, since an index of refraction of 0 makes the factor before it 1. What that coat
    /// keeps is missing from the diffuse layer below, as the archived extension asks with 1 - max(specular).
    void read_specular_glossiness(const JsonElement& extension, Material& material) {
        const glm::dvec4 diffuse = extension.vec4_or("diffuseFactor", glm::dvec4(1.0));
        for (int i = 0; i < 4; ++i) material.base_color[i] = unit(extension, "diffuseFactor", diffuse[i]);
        if (const auto texture = extension.find("diffuseTexture")) {
            material.base_color_texture = read_texture_use(*texture);
        }
        const glm::dvec3 specular = extension.vec3_or("specularFactor", glm::dvec3(1.0));
        for (int i = 0; i < 3; ++i) {
            material.specular_color[i] = unit(extension, "specularFactor", specular[i]);
        }
        material.ior = 0.0f;
        material.metallic = 0.0f;
        const float glossiness =
            unit(extension, "glossinessFactor", extension.number_or("glossinessFactor", 1.0));
        material.roughness = 1.0f - glossiness;
        const auto texture = extension.find("specularGlossinessTexture");
        if (!texture) return;
        material.specular_color_texture = read_texture_use(*texture);
        if (!material.specular_color_texture.present() || glossiness == 0.0f) return;
        // The factor is within the texture that is made.
        material.roughness = 1.0f;
        material.metallic_roughness_texture = material.specular_color_texture;
        material.metallic_roughness_texture.texture =
            roughness_texture(material.specular_color_texture.texture, glossiness);
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

    /// The index in the result of a texture whose G is 1 - glossiness x A of another one.
    int roughness_texture(int texture, float glossiness) {
        const auto next = static_cast<int>(result_.textures.size());
        const auto [entry, is_new] = roughness_of_.try_emplace({texture, glossiness}, next);
        if (is_new) {
            Texture roughness = result_.textures[static_cast<std::size_t>(texture)];
            const ImageSource source{images_[roughness.image].gltf_image, glossiness};
            roughness.image = static_cast<std::uint32_t>(images_.size());
            images_.push_back(source);
            result_.textures.push_back(roughness);
        }
        return entry->second;
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
        const auto known = image_of_gltf_.find(gltf_image);
        if (known != image_of_gltf_.end()) return known->second;
        const auto next = static_cast<std::uint32_t>(images_.size());
        const auto [entry, is_new] = image_of_source_.try_emplace(document_.image_source(gltf_image), next);
        if (is_new) images_.push_back({gltf_image, std::nullopt});
        image_of_gltf_.emplace(gltf_image, entry->second);
        return entry->second;
    }

    /// The name of an image in messages.
    std::string image_name(std::size_t gltf_image) const {
        return fmt::format("{} {}", document_.file_name(), document_.element("images", gltf_image).path());
    }

    /// Counts what the images unpack to beyond what files of their size usually do.
    void charge_images() {
        constexpr std::size_t kUsualExpansion = 64;
        std::uint64_t all_decoded = 0;
        for (const ImageSource& source : images_) {
            if (source.glossiness) continue;
            const std::vector<std::uint8_t> encoded = document_.read_image(source.gltf_image);
            const glm::ivec2 size = texture_image_size(encoded, image_name(source.gltf_image));
            const std::size_t decoded =
                4 * static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
            const std::size_t usual = kUsualExpansion * encoded.size();
            document_.charge_memory(decoded > usual ? decoded - usual : 0, 1,
                                    document_.element("images", source.gltf_image));
            all_decoded += decoded;
        }
        require_memory(all_decoded, fmt::format("'{}': {} textures", document_.file_name(), images_.size()));
    }

    void load_images() {
        charge_images();
        result_.images.resize(images_.size());
        for_each_image([&](std::size_t i) {
            if (!images_[i].glossiness) result_.images[i] = decode_image(images_[i].gltf_image);
        });
        const auto decoded_of = [&](const ImageSource& source) -> const TextureImage& {
            return result_.images[image_of_gltf_.at(source.gltf_image)];
        };
        for (const ImageSource& source : images_) {
            if (!source.glossiness) continue;
            document_.charge_memory(decoded_of(source).rgba.size(), 1,
                                    document_.element("images", source.gltf_image));
        }
        for_each_image([&](std::size_t i) {
            if (!images_[i].glossiness) return;
            result_.images[i] = roughness_image(decoded_of(images_[i]), *images_[i].glossiness);
        });
    }

    template <typename Load>
    void for_each_image(const Load& load) const {
        std::vector<std::exception_ptr> errors(images_.size());
        parallel_for(images_.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                try {
                    load(i);
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

    TextureImage decode_image(std::size_t gltf_image) const {
        TextureImage image = decode_texture_image(document_.read_image(gltf_image), image_name(gltf_image));
        image.name = document_.element("images", gltf_image).text_or("name", "");
        return image;
    }

    /// Glossiness is linear in A, so filtering this image is filtering that one.
    static TextureImage roughness_image(const TextureImage& source, float glossiness) {
        TextureImage image = source;
        image.name += " (roughness)";
        for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
            const auto alpha = static_cast<float>(source.rgba[i + 3]);
            image.rgba[i] = 0;
            image.rgba[i + 1] = static_cast<std::uint8_t>(std::lround(255.0f - glossiness * alpha));
            image.rgba[i + 2] = 0;
            image.rgba[i + 3] = 255;
        }
        return image;
    }

    GltfDocument& document_;
    GltfMaterials result_;
    std::map<std::size_t, int> texture_of_gltf_;
    std::map<std::size_t, std::uint32_t> image_of_gltf_;
    std::map<std::string, std::uint32_t> image_of_source_;
    std::map<std::pair<int, float>, int> roughness_of_;  ///< By texture and glossiness.
    std::vector<ImageSource> images_;                    ///< What each of the result's images is made from.
};

}  // namespace

GltfMaterials load_materials(GltfDocument& document) {
    return MaterialReader(document).read();
}

}  // namespace core
