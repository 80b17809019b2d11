#include "core/scene/obj_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/image/tonemap.h"
#include "core/scene/mesh_assembly.h"
#include "core/scene/obj_materials.h"
#include "core/scene/polygon.h"
#include "core/scene/text_scanner.h"
#include "core/support/error.h"

namespace core {

namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// What one corner of a face refers to.
struct Corner {
    std::uint32_t position = kNone;
    std::uint32_t uv = kNone;
    std::uint32_t normal = kNone;
    bool operator==(const Corner&) const = default;
};

struct CornerHash {
    std::size_t operator()(const Corner& corner) const {
        std::uint64_t hash = 0x9e3779b97f4a7c15u;
        for (const std::uint32_t word : {corner.position, corner.uv, corner.normal}) {
            hash = (hash ^ word) * 0xff51afd7ed558ccdu;
            hash ^= hash >> 32;
        }
        return static_cast<std::size_t>(hash);
    }
};

/// Triangles of one object that share a material, and of which all corners have normals or none is used.
struct Part {
    std::uint32_t material_name = 0;
    bool smooth = false;
    std::vector<Corner> corners;  ///< Three a triangle.
};

struct Object {
    std::string name;
    std::vector<Part> parts;
    std::map<std::pair<std::uint32_t, bool>, std::size_t> part_of_key;
    std::size_t corner_count = 0;
};

/// Statements without a say in the picture.
constexpr std::array<std::string_view, 16> kIgnored = {
    "g",      "s",          "mg",        "bevel", "c_interp", "d_interp", "lod", "maplib",
    "usemap", "shadow_obj", "trace_obj", "ctech", "stech",    "call",     "csh", "scmp"};
/// Curves and surfaces, and their bodies.
constexpr std::array<std::string_view, 16> kFreeForm = {"vp",    "cstype", "deg",  "bmat", "step", "curv",
                                                        "curv2", "surf",   "parm", "trim", "hole", "scrv",
                                                        "sp",    "end",    "con",  "bsp"};

template <std::size_t size>
bool contains(const std::array<std::string_view, size>& words, std::string_view word) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

/// Statements of one kind that were skipped.
struct Skipped {
    std::size_t count = 0;
    std::size_t first_line = 0;
    std::string first;
};

class ObjReader {
public:
    ObjReader(std::span<const std::uint8_t> bytes, const std::filesystem::path& path,
              const LoadOptions& options)
        : scanner_(as_text(bytes), true),
          file_name_(path.filename().string()),
          default_name_(path.stem().string()),
          materials_(path, options.allow_external, scene_, warnings_),
          splitter_(bytes.size()) {
        objects_.emplace_back().name = default_name_;
    }

    Scene read() {
        do {
            const std::string_view keyword = scanner_.word_in_line();
            if (keyword.empty()) continue;
            if (keyword.front() == '#') {
                // A backslash at the end of a comment continues nothing.
                scanner_.rest_of_line();
                continue;
            }
            read_statement(keyword);
        } while (scanner_.next_line());
        scene_.name = file_name_;
        for (Object& object : objects_) {
            if (!object.parts.empty()) build(object);
        }
        if (scene_.meshes.empty()) {
            throw InputError(ErrorKind::kBadData,
                             fmt::format("'{}': holds {} vertices and no faces; a surface is needed",
                                         file_name_, positions_.size()));
        }
        warn_of_skipped();
        scene_.warnings = warnings_.all();
        return std::move(scene_);
    }

private:
    [[noreturn]] void fail(const std::string& reason) const {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("'{}': line {}: {}", file_name_, scanner_.line_number(), reason));
    }

    void read_statement(std::string_view keyword) {
        if (keyword == "v") {
            read_vertex();
        } else if (keyword == "vt") {
            const auto [values, count] = numbers(1, 3, "vt");
            uvs_.emplace_back(values[0], 1.0f - values[1]);
        } else if (keyword == "vn") {
            const auto [values, count] = numbers(3, 3, "vn");
            normals_.emplace_back(values[0], values[1], values[2]);
        } else if (keyword == "f" || keyword == "fo") {
            read_face();
        } else if (keyword == "o") {
            std::string name(scanner_.rest_of_line());
            objects_.emplace_back().name = name.empty() ? default_name_ : std::move(name);
        } else if (keyword == "usemtl") {
            use_material(std::string(scanner_.rest_of_line()));
        } else if (keyword == "mtllib") {
            const std::size_t line = scanner_.line_number();
            materials_.read_libraries(scanner_.rest_of_line(), line);
        } else if (keyword == "l" || keyword == "p") {
            count_skipped(lines_and_points_, keyword);
        } else if (contains(kFreeForm, keyword)) {
            count_skipped(free_form_, keyword);
        } else if (!contains(kIgnored, keyword)) {
            count_skipped(unknown_, keyword);
        }
    }

    /// The numbers to the end of the line, as floats, and how many there are.
    std::pair<std::array<float, 7>, std::size_t> numbers(std::size_t least, std::size_t most,
                                                         std::string_view keyword) {
        std::array<float, 7> values{};
        std::size_t count = 0;
        for (std::string_view word = scanner_.word_in_line(); !word.empty() && word.front() != '#';
             word = scanner_.word_in_line()) {
            if (count == most) fail(fmt::format("'{}' has more than {} numbers", keyword, most));
            const std::optional<double> value = parse_number(word);
            if (!value) fail(fmt::format("'{}' is followed by '{}', not a number", keyword, quotable(word)));
            values[count] = static_cast<float>(*value);
            // Normals without a direction are mended later.
            if (!std::isfinite(values[count]) && keyword != "vn") {
                fail(fmt::format("'{}' is followed by '{}', which no float holds", keyword, quotable(word)));
            }
            ++count;
        }
        if (count < least) fail(fmt::format("'{}' has {} numbers; it needs {}", keyword, count, least));
        return {values, count};
    }

    void read_vertex() {
        const auto [values, count] = numbers(3, 7, "v");
        if (count == 5) fail("'v' has 5 numbers; it takes x y z, with w, r g b or r g b a");
        if (positions_.size() == kNone) fail("there are more than 2^32 vertices");
        positions_.emplace_back(values[0], values[1], values[2]);
        if (count < 6 && colors_.empty()) return;
        colors_.resize(positions_.size(), glm::vec4(1.0f));
        if (count < 6) return;
        for (int i = 0; i < 3; ++i) {
            const float encoded = values[static_cast<std::size_t>(3 + i)];
            clamped_color_ = clamped_color_ || encoded < 0.0f || encoded > 1.0f;
            colors_.back()[i] = linear_from_srgb(std::clamp(encoded, 0.0f, 1.0f));
        }
    }

    /// One index of a corner. Positive ones count from the first, negative ones from the last so far.
    std::uint32_t index(std::string_view text, std::size_t defined, const char* what) const {
        const std::optional<std::int64_t> value = parse_integer(text);
        if (!value || *value == 0) {
            fail(fmt::format("'{}' is no {} index; they count from 1, or from -1 backwards", quotable(text),
                             what));
        }
        const auto count = static_cast<std::int64_t>(defined);
        if (*value > count || *value < -count) {
            fail(fmt::format("refers to {} {}, but only {} are defined above", what, *value, count));
        }
        return static_cast<std::uint32_t>(*value > 0 ? *value - 1 : count + *value);
    }

    Corner read_corner(std::string_view word) const {
        const auto field = [&]() {
            const std::size_t slash = std::min(word.find('/'), word.size());
            const std::string_view result = word.substr(0, slash);
            word.remove_prefix(std::min(slash + 1, word.size()));
            return result;
        };
        Corner corner;
        corner.position = index(field(), positions_.size(), "vertex");
        if (const std::string_view uv = field(); !uv.empty()) {
            corner.uv = index(uv, uvs_.size(), "texture coordinate");
        }
        if (const std::string_view normal = field(); !normal.empty()) {
            corner.normal = index(normal, normals_.size(), "normal");
        }
        if (!word.empty()) fail("a corner has more than v/vt/vn");
        return corner;
    }

    void read_face() {
        face_.clear();
        face_positions_.clear();
        bool smooth = true;
        for (std::string_view word = scanner_.word_in_line(); !word.empty() && word.front() != '#';
             word = scanner_.word_in_line()) {
            face_.push_back(read_corner(word));
            face_positions_.push_back(positions_[face_.back().position]);
            smooth = smooth && face_.back().normal != kNone;
        }
        if (face_.size() < 3) {
            fail(fmt::format("the face has {} corners; it needs 3 or more", face_.size()));
        }
        if (!splitter_.split(face_positions_, split_)) fail(splitter_.limits());
        Object& object = objects_.back();
        object.corner_count += 3 * split_.size();
        if (object.corner_count >= kNone) fail("the object has more than 2^32 corners; split it");
        Part& part = current_part(smooth);
        for (const glm::uvec3& triangle : split_) {
            for (int i = 0; i < 3; ++i) {
                Corner& corner = part.corners.emplace_back(face_[triangle[i]]);
                if (!smooth) corner.normal = kNone;
            }
        }
    }

    Part& current_part(bool smooth) {
        Object& object = objects_.back();
        const auto [entry, is_new] =
            object.part_of_key.try_emplace({current_material_, smooth}, object.parts.size());
        if (is_new) object.parts.push_back({current_material_, smooth, {}});
        return object.parts[entry->second];
    }

    void use_material(std::string name) {
        const auto [entry, is_new] =
            index_of_material_name_.try_emplace(name, static_cast<std::uint32_t>(material_names_.size()));
        if (is_new) material_names_.push_back(std::move(name));
        current_material_ = entry->second;
    }

    void count_skipped(Skipped& skipped, std::string_view keyword) {
        if (skipped.count++ > 0) return;
        skipped.first_line = scanner_.line_number();
        skipped.first = quotable(keyword);
    }

    void warn_of_skipped() {
        const auto warn = [&](const Skipped& skipped, const char* what) {
            if (skipped.count == 0) return;
            warnings_.add(fmt::format("{} {} are skipped, '{}' in line {} first", skipped.count, what,
                                      skipped.first, skipped.first_line));
        };
        warn(lines_and_points_, "statements for lines and points");
        warn(free_form_, "statements for free-form curves and surfaces");
        warn(unknown_, "statements that OBJ does not know");
        if (clamped_color_) warnings_.add("some colours of vertices are outside [0, 1] and are clamped");
    }

    void build(const Object& object) {
        Mesh mesh;
        mesh.name = object.name;
        std::vector<std::uint32_t> materials;
        for (const Part& part : object.parts) {
            const std::uint32_t material =
                materials_.index_of(material_names_[part.material_name], !colors_.empty());
            materials.push_back(material);
            append_part(mesh, geometry_of(part, scene_.materials[material], object.name));
        }
        finish_mesh(mesh);
        place_mesh(scene_, std::move(mesh), std::move(materials));
    }

    PrimitiveGeometry geometry_of(const Part& part, const Material& material, const std::string& name) {
        PrimitiveGeometry geometry;
        const bool has_uvs = std::any_of(part.corners.begin(), part.corners.end(),
                                         [](const Corner& corner) { return corner.uv != kNone; });
        std::unordered_map<Corner, std::uint32_t, CornerHash> vertices;
        geometry.triangles.reserve(part.corners.size() / 3);
        for (std::size_t i = 0; i < part.corners.size(); ++i) {
            const Corner& corner = part.corners[i];
            const auto next = static_cast<std::uint32_t>(geometry.positions.size());
            const auto [entry, is_new] = vertices.try_emplace(corner, next);
            if (i % 3 == 0) geometry.triangles.emplace_back();
            geometry.triangles.back()[static_cast<int>(i % 3)] = entry->second;
            if (!is_new) continue;
            geometry.positions.push_back(positions_[corner.position]);
            if (part.smooth) geometry.normals.push_back(normals_[corner.normal]);
            if (has_uvs) {
                geometry.uvs[0].push_back(corner.uv == kNone ? glm::vec2(0.0f) : uvs_[corner.uv]);
            }
            if (!colors_.empty()) {
                geometry.colors.push_back(corner.position < colors_.size() ? colors_[corner.position]
                                                                           : glm::vec4(1.0f));
            }
        }
        if (!part.smooth) {
            make_flat_normals(geometry);
        } else if (const std::size_t broken = mend_normals(geometry); broken > 0) {
            warnings_.add(
                fmt::format("object '{}': {} normals have no direction; they are made from the faces around",
                            quotable(name), broken));
        }
        if (material.normal_texture.present()) make_tangents(geometry, 0);
        return geometry;
    }

    TextScanner scanner_;
    std::string file_name_;
    std::string default_name_;
    Scene scene_;
    WarningList warnings_;
    ObjMaterials materials_;
    PolygonSplitter splitter_;

    std::vector<glm::vec3> positions_;
    std::vector<glm::vec4> colors_;  ///< Empty, or as long as `positions_` with those of the last line.
    std::vector<glm::vec2> uvs_;
    std::vector<glm::vec3> normals_;
    std::vector<Object> objects_;
    std::vector<std::string> material_names_ = {""};
    std::map<std::string, std::uint32_t> index_of_material_name_ = {{"", 0}};
    std::uint32_t current_material_ = 0;

    std::vector<Corner> face_;
    std::vector<glm::vec3> face_positions_;
    std::vector<glm::uvec3> split_;

    bool clamped_color_ = false;
    Skipped lines_and_points_, free_form_, unknown_;
};

}  // namespace

Scene read_obj(std::span<const std::uint8_t> bytes, const std::filesystem::path& path,
               const LoadOptions& options) {
    return ObjReader(bytes, path, options).read();
}

}  // namespace core
