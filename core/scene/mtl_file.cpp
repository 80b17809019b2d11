#include "core/scene/mtl_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "core/scene/mesh_assembly.h"
#include "core/scene/text_scanner.h"
#include "core/support/error.h"

namespace core {

namespace {

/// What a picture would have shown that is not read.
constexpr std::array<std::string_view, 18> kLeftOutStatements = {
    "map_Ka", "map_Ks", "map_Ns",   "map_d",  "map_Tr", "map_bump", "map_Bump", "bump",   "disp",
    "decal",  "refl",   "map_refl", "map_Pr", "map_Pm", "map_Ps",   "map_disp", "map_Pc", "map_Disp"};

/// The statements of one material, as they stand.
struct Statements {
    std::string name;
    std::optional<glm::dvec3> diffuse, specular, emission;
    std::optional<double> exponent, opacity, transparency, roughness, metallic;
    std::int64_t illumination = 2;
    std::optional<MtlTexture> color_texture, emission_texture, normal_texture, opacity_texture;
};

class MtlReader {
public:
    MtlReader(std::span<const std::uint8_t> bytes, const std::string& file_name, MtlLibrary& library,
              WarningList& warnings)
        : scanner_(as_text(bytes)), file_name_(file_name), library_(library), warnings_(warnings) {}

    void read() {
        do {
            const std::string_view keyword = scanner_.word_in_line();
            if (keyword.empty() || keyword.front() == '#') continue;
            if (keyword == "newmtl") {
                finish();
                current_.emplace().name = scanner_.rest_of_line();
                if (current_->name.empty()) fail("newmtl needs a name");
                continue;
            }
            if (!current_) fail(fmt::format("'{}' stands before any newmtl", quotable(keyword)));
            read_statement(keyword);
        } while (scanner_.next_line());
        finish();
        if (left_out_.empty()) return;
        std::string names;
        for (const std::string_view name : left_out_)
            names += (names.empty() ? "" : ", ") + std::string(name);
        warnings_.add(fmt::format("'{}': {} are not read", file_name_, names));
    }

private:
    [[noreturn]] void fail(const std::string& reason) const {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("'{}': line {}: {}", file_name_, scanner_.line_number(), reason));
    }

    void read_statement(std::string_view keyword) {
        if (keyword == "Kd") {
            current_->diffuse = color(keyword);
        } else if (keyword == "Ks") {
            current_->specular = color(keyword);
        } else if (keyword == "Ke") {
            current_->emission = color(keyword);
        } else if (keyword == "Ns") {
            current_->exponent = number(keyword);
        } else if (keyword == "Pr") {
            current_->roughness = number(keyword);
        } else if (keyword == "Pm") {
            current_->metallic = number(keyword);
        } else if (keyword == "Tr") {
            current_->transparency = number(keyword);
        } else if (keyword == "d") {
            read_opacity();
        } else if (keyword == "illum") {
            current_->illumination = static_cast<std::int64_t>(std::clamp(number(keyword), 0.0, 100.0));
        } else if (keyword == "map_Kd") {
            current_->color_texture = texture(keyword);
        } else if (keyword == "map_Ke") {
            current_->emission_texture = texture(keyword);
        } else if (keyword == "norm") {
            current_->normal_texture = texture(keyword);
        } else if (keyword == "map_d") {
            current_->opacity_texture = texture(keyword);
        } else {
            const auto* known = std::find(kLeftOutStatements.begin(), kLeftOutStatements.end(), keyword);
            if (known != kLeftOutStatements.end()) left_out_.insert(*known);
        }
    }

    double number(std::string_view keyword) {
        const std::string_view word = scanner_.word_in_line();
        const std::optional<double> value = parse_number(word);
        if (!value || !std::isfinite(*value)) {
            fail(fmt::format("{} must be followed by a number, not '{}'", keyword, quotable(word)));
        }
        return *value;
    }

    /// One number stands for three.
    std::optional<glm::dvec3> color(std::string_view keyword) {
        TextScanner ahead = scanner_;
        const std::string_view form = ahead.word_in_line();
        if (form == "spectral" || form == "xyz") {
            warnings_.add(fmt::format("'{}': line {}: {} {} is not read; r g b is", file_name_,
                                      scanner_.line_number(), keyword, form));
            return std::nullopt;
        }
        glm::dvec3 result(number(keyword));
        ahead = scanner_;
        if (ahead.word_in_line().empty()) return result;
        result.y = number(keyword);
        result.z = number(keyword);
        return result;
    }

    void read_opacity() {
        TextScanner ahead = scanner_;
        if (ahead.word_in_line() == "-halo") scanner_ = ahead;
        current_->opacity = number("d");
    }

    MtlTexture texture(std::string_view keyword) {
        MtlTexture result;
        result.line = scanner_.line_number();
        glm::dvec2 scale(1.0);
        glm::dvec2 offset(0.0);
        for (;;) {
            TextScanner ahead = scanner_;
            const std::string_view option = ahead.word_in_line();
            if (option.size() < 2 || option.front() != '-') break;
            scanner_ = ahead;
            if (option == "-s") {
                scale = vector(scale);
            } else if (option == "-o") {
                offset = vector(offset);
            } else if (option == "-t") {
                vector({});
            } else if (option == "-clamp") {
                result.clamp = scanner_.word_in_line() == "on";
            } else {
                scanner_.word_in_line();
                if (option == "-mm") scanner_.word_in_line();
            }
        }
        result.file = scanner_.rest_of_line();
        if (result.file.empty()) fail(fmt::format("{} names no file", keyword));
        // Libraries made on Windows.
        std::replace(result.file.begin(), result.file.end(), '\\', '/');
        result.uv_from_mesh_uv[0].x = static_cast<float>(scale.x);
        result.uv_from_mesh_uv[1].y = static_cast<float>(scale.y);
        // The file's v runs upwards, ours downwards.
        result.uv_from_mesh_uv[2] = glm::vec2(offset.x, 1.0 - scale.y - offset.y);
        for (int column = 0; column < 3; ++column) {
            const glm::vec2& v = result.uv_from_mesh_uv[column];
            if (!std::isfinite(v.x) || !std::isfinite(v.y)) fail("-s or -o is too large for a float");
        }
        return result;
    }

    /// From one to three numbers, of which the third is of no use to pictures.
    glm::dvec2 vector(glm::dvec2 values) {
        for (int i = 0; i < 3; ++i) {
            TextScanner ahead = scanner_;
            const std::optional<double> value = parse_number(ahead.word_in_line());
            if (!value) return values;
            if (i < 2) values[i] = *value;
            scanner_ = ahead;
        }
        return values;
    }

    double unit(const char* key, double value) {
        if (value >= 0.0 && value <= 1.0) return value;
        warn(fmt::format("{} is {}; it must be in [0, 1] and is clamped", key, value));
        return value > 0.0 ? 1.0 : 0.0;
    }

    void warn(const std::string& text) {
        warnings_.add(fmt::format("'{}': material '{}': {}", file_name_, quotable(current_->name), text));
    }

    void finish() {
        if (!current_) return;
        MtlMaterial result;
        result.material.name = current_->name;
        result.material.double_sided = true;
        read_colors(result.material);
        read_highlight(result.material);
        read_alpha(result.material);
        result.color = current_->color_texture;
        result.emission = current_->emission_texture;
        result.normal = current_->normal_texture;
        result.emission_is_texture_alone = !current_->emission;
        if (!library_.try_emplace(current_->name, std::move(result)).second) {
            warn("is there a second time; the first counts");
        }
        current_.reset();
    }

    void read_colors(Material& material) {
        const double unsaid = current_->color_texture ? 1.0 : kPlainAlbedo;
        const glm::dvec3 diffuse = current_->diffuse.value_or(glm::dvec3(unsaid));
        const glm::dvec3 emission =
            current_->emission.value_or(glm::dvec3(current_->emission_texture ? 1.0 : 0.0));
        for (int i = 0; i < 3; ++i) {
            material.base_color[i] = static_cast<float>(unit("Kd", diffuse[i]));
            material.emission[i] = static_cast<float>(std::max(emission[i], 0.0));
            if (!std::isfinite(material.emission[i]))
                fail("Ke of the material above is too large for a float");
        }
        if (std::min({emission.x, emission.y, emission.z}) < 0.0) {
            warn("Ke must not be negative; that counts as 0");
        }
        if (current_->color_texture && diffuse == glm::dvec3(0.0)) {
            warn("Kd is black, which hides its map_Kd; the two are multiplied");
        }
    }

    void read_highlight(Material& material) {
        const bool physical = current_->roughness || current_->metallic;
        material.metallic = static_cast<float>(unit("Pm", current_->metallic.value_or(0.0)));
        double roughness = 1.0;
        if (current_->roughness) {
            roughness = unit("Pr", *current_->roughness);
        } else if (current_->exponent) {
            roughness = std::pow(2.0 / (std::max(*current_->exponent, 0.0) + 2.0), 0.25);
        }
        material.roughness = static_cast<float>(roughness);
        if (physical && !current_->specular) return;
        glm::dvec3 specular = current_->specular.value_or(glm::dvec3(0.0));
        if (!physical && current_->illumination < 2) specular = glm::dvec3(0.0);
        for (int i = 0; i < 3; ++i) specular[i] = unit("Ks", specular[i]);
        const double strength = std::min(1.0, 2.0 * std::max({specular.x, specular.y, specular.z}));
        material.specular = static_cast<float>(strength);
        if (strength > 0.0) material.specular_color = glm::vec3(2.0 / strength * specular);
    }

    void read_alpha(Material& material) {
        double alpha = 1.0;
        if (current_->opacity) {
            alpha = unit("d", *current_->opacity);
        } else if (current_->transparency) {
            alpha = 1.0 - unit("Tr", *current_->transparency);
        }
        material.base_color.a = static_cast<float>(alpha);
        if (alpha == 0.0) warn("is wholly transparent by its d or Tr");
        const std::optional<MtlTexture>& map = current_->opacity_texture;
        const bool in_color_texture =
            map && current_->color_texture && map->file == current_->color_texture->file;
        if (map && !in_color_texture) left_out_.insert("map_d");
        if (alpha < 1.0 || in_color_texture) material.alpha_mode = AlphaMode::kBlend;
    }

    TextScanner scanner_;
    const std::string& file_name_;
    MtlLibrary& library_;
    WarningList& warnings_;
    std::optional<Statements> current_;
    std::set<std::string_view> left_out_;
};

}  // namespace

void read_mtl(std::span<const std::uint8_t> bytes, const std::string& file_name, MtlLibrary& library,
              WarningList& warnings) {
    MtlReader(bytes, file_name, library, warnings).read();
}

}  // namespace core
