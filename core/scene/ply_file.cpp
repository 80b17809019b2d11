#include "core/scene/ply_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string_view>
#include <utility>

#include "core/image/tonemap.h"
#include "core/scene/mesh_assembly.h"
#include "core/scene/ply_header.h"
#include "core/scene/polygon.h"
#include "core/support/error.h"

namespace core {

namespace {

/// What a column of `vertex` is for.
enum Slot {
    kX,
    kY,
    kZ,
    kNx,
    kNy,
    kNz,
    kRed,
    kGreen,
    kBlue,
    kAlpha,
    kU,
    kV,
    kSlotCount,
    kUnused = kSlotCount
};

struct SlotName {
    std::string_view name;
    Slot slot;
};
constexpr SlotName kSlotNames[] = {{"x", kX},
                                   {"y", kY},
                                   {"z", kZ},
                                   {"nx", kNx},
                                   {"ny", kNy},
                                   {"nz", kNz},
                                   {"red", kRed},
                                   {"green", kGreen},
                                   {"blue", kBlue},
                                   {"alpha", kAlpha},
                                   {"r", kRed},
                                   {"g", kGreen},
                                   {"b", kBlue},
                                   {"a", kAlpha},
                                   {"diffuse_red", kRed},
                                   {"s", kU},
                                   {"t", kV},
                                   {"u", kU},
                                   {"v", kV},
                                   {"diffuse_green", kGreen},
                                   {"texture_u", kU},
                                   {"texture_v", kV},
                                   {"texture_s", kU},
                                   {"texture_t", kV},
                                   {"diffuse_blue", kBlue},
                                   {"diffuse_alpha", kAlpha}};

Slot slot_of(std::string_view name) {
    for (const SlotName& known : kSlotNames) {
        if (known.name == name) return known.slot;
    }
    return kUnused;
}

/// The values after the header, one by one.
class DataReader {
public:
    DataReader(std::span<const std::uint8_t> bytes, TextScanner& scanner, PlyFormat format,
               const std::string& file_name)
        : bytes_(bytes),
          offset_(scanner.offset()),
          scanner_(scanner),
          format_(format),
          file_name_(file_name) {}

    /// Where the next values belong, for messages. @pre the element outlives the reading of it
    void enter(const PlyElement& element, std::uint64_t row) {
        element_ = &element;
        row_ = row;
    }

    [[noreturn]] void fail(const std::string& reason) const {
        throw InputError(
            ErrorKind::kBadData,
            fmt::format("'{}': {}{} {}: {}", file_name_,
                        format_ == PlyFormat::kText ? fmt::format("line {}: ", scanner_.line_number())
                                                    : std::string(),
                        quotable(element_->name), row_, reason));
    }

    /// Refuses counts that the rest of the file cannot hold.
    void check_count(const PlyElement& element) {
        enter(element, 0);
        if (element.count == 0) return;
        if (element.properties.empty()) fail("its rows have no properties");
        std::uint64_t row_bytes = 0;
        for (const PlyProperty& property : element.properties) {
            row_bytes += format_ == PlyFormat::kText ? 2
                         : property.is_list          ? byte_count(property.count_type)
                                                     : byte_count(property.type);
        }
        // The last value of a text needs nothing after it.
        const std::uint64_t left = bytes_left() + (format_ == PlyFormat::kText ? 1 : 0);
        const std::uint64_t most = left / std::max<std::uint64_t>(row_bytes, 1);
        if (element.count <= most) return;
        fail(fmt::format("there are {} of it by the header, but the {} bytes that are left hold at most {}",
                         element.count, bytes_left(), most));
    }

    double number(const PlyProperty& property) { return read(property.type, property); }

    std::uint64_t list_length(const PlyProperty& property) {
        const double length = read(property.count_type, property);
        if (length < 0.0) fail(fmt::format("'{}' has {} entries", quotable(property.name), length));
        const std::uint64_t entry_bytes = format_ == PlyFormat::kText ? 2 : byte_count(property.type);
        const std::uint64_t most = (bytes_left() + 1) / entry_bytes;
        if (length > static_cast<double>(most)) {
            fail(fmt::format("'{}' has {} entries, but {} bytes are left", quotable(property.name), length,
                             bytes_left()));
        }
        return static_cast<std::uint64_t>(length);
    }

    void skip(const PlyProperty& property) {
        const std::uint64_t count = property.is_list ? list_length(property) : 1;
        for (std::uint64_t i = 0; i < count; ++i) number(property);
    }

private:
    std::size_t bytes_left() const {
        return bytes_.size() - (format_ == PlyFormat::kText ? scanner_.offset() : offset_);
    }

    double read(PlyType type, const PlyProperty& property) {
        return format_ == PlyFormat::kText ? read_text(type, property) : read_binary(type, property);
    }

    double read_text(PlyType type, const PlyProperty& property) {
        const std::string_view word = scanner_.word();
        if (word.empty()) fail(fmt::format("the file ends before '{}'", quotable(property.name)));
        const std::optional<double> value = parse_number(word);
        if (!value) {
            fail(fmt::format("'{}' is '{}', not a number", quotable(property.name), quotable(word)));
        }
        if (is_integer(type) && !(*value >= smallest_value(type) && *value <= largest_value(type) &&
                                  *value == std::floor(*value))) {
            fail(fmt::format("'{}' is {}, but its type holds integers from {} to {}", quotable(property.name),
                             quotable(word), smallest_value(type), largest_value(type)));
        }
        return *value;
    }

    double read_binary(PlyType type, const PlyProperty& property) {
        const std::size_t size = byte_count(type);
        if (size > bytes_left()) {
            fail(fmt::format("the file ends before or within '{}'", quotable(property.name)));
        }
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < size; ++i) {
            const std::size_t place = format_ == PlyFormat::kLittleEndian ? size - 1 - i : i;
            bits = bits << 8 | bytes_[offset_ + place];
        }
        offset_ += size;
        switch (type) {
            case PlyType::kInt8:
                return static_cast<std::int8_t>(bits);
            case PlyType::kInt16:
                return static_cast<std::int16_t>(bits);
            case PlyType::kInt32:
                return static_cast<std::int32_t>(bits);
            case PlyType::kFloat32:
                return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
            case PlyType::kFloat64:
                return std::bit_cast<double>(bits);
            default:
                return static_cast<double>(bits);
        }
    }

    std::span<const std::uint8_t> bytes_;
    std::size_t offset_;
    TextScanner& scanner_;
    PlyFormat format_;
    const std::string& file_name_;
    const PlyElement* element_ = nullptr;
    std::uint64_t row_ = 0;
};

class PlyReader {
public:
    PlyReader(std::span<const std::uint8_t> bytes, const std::string& file_name)
        : scanner_(as_text(bytes)),
          file_name_(file_name),
          header_(read_ply_header(scanner_, file_name)),
          data_(bytes, scanner_, header_.format, file_name),
          splitter_(bytes.size()) {}

    Scene read() {
        for (const PlyElement& element : header_.elements) {
            data_.check_count(element);
            if (element.name == "vertex") {
                read_vertices(element);
            } else if (element.name == "face" || element.name == "tristrips") {
                read_polygons(element);
            } else {
                for (std::uint64_t row = 0; row < element.count; ++row) {
                    data_.enter(element, row);
                    for (const PlyProperty& property : element.properties) data_.skip(property);
                }
            }
        }
        if (geometry_.triangles.empty()) {
            throw InputError(
                ErrorKind::kBadData,
                fmt::format("'{}': holds {} vertices and no faces; a surface is needed, so points must be "
                            "meshed first",
                            file_name_, geometry_.positions.size()));
        }
        return finished();
    }

private:
    void read_vertices(const PlyElement& element) {
        std::array<const PlyProperty*, kSlotCount + 1> properties{};
        std::vector<Slot> slots;
        for (const PlyProperty& property : element.properties) {
            Slot slot = property.is_list ? kUnused : slot_of(property.name);
            if (properties[slot] != nullptr) slot = kUnused;
            properties[slot] = &property;
            slots.push_back(slot);
        }
        const auto has = [&](std::initializer_list<Slot> wanted) {
            return std::all_of(wanted.begin(), wanted.end(), [&](Slot s) { return properties[s]; });
        };
        if (!has({kX, kY, kZ})) data_.fail("its rows lack x, y or z");
        if (element.count > std::numeric_limits<std::uint32_t>::max()) {
            data_.fail("there are more than 2^32 of it");
        }
        const bool has_normals = has({kNx, kNy, kNz});
        const bool has_colors = has({kRed, kGreen, kBlue});
        const bool has_uvs = has({kU, kV});
        std::array<double, kSlotCount + 1> values{};
        values[kAlpha] = 1.0;
        for (std::uint64_t row = 0; row < element.count; ++row) {
            data_.enter(element, row);
            for (std::size_t i = 0; i < slots.size(); ++i) {
                const PlyProperty& property = element.properties[i];
                if (slots[i] == kUnused) {
                    data_.skip(property);
                } else if (slots[i] >= kRed && slots[i] <= kAlpha) {
                    values[slots[i]] = color_channel(data_.number(property), property.type, slots[i]);
                } else {
                    values[slots[i]] = data_.number(property);
                }
            }
            geometry_.positions.emplace_back(values[kX], values[kY], values[kZ]);
            if (has_normals) geometry_.normals.emplace_back(values[kNx], values[kNy], values[kNz]);
            if (has_colors) {
                geometry_.colors.emplace_back(values[kRed], values[kGreen], values[kBlue], values[kAlpha]);
            }
            if (has_uvs) geometry_.uvs[0].push_back(uv(values[kU], values[kV]));
        }
    }

    static double color_channel(double value, PlyType type, Slot slot) {
        if (!is_integer(type)) return value > 0.0 ? std::min(value, 1.0) : 0.0;
        // Wider types than two bytes still hold 0 to 255.
        const double white = byte_count(type) == 2 ? largest_value(type) : 255.0;
        const double encoded = std::clamp(value / white, 0.0, 1.0);
        return slot == kAlpha ? encoded : linear_from_srgb(encoded);
    }

    static glm::vec2 uv(double u, double v) {
        const glm::vec2 result(u, 1.0 - v);
        return std::isfinite(result.x) && std::isfinite(result.y) ? result : glm::vec2(0.0f);
    }

    void read_polygons(const PlyElement& element) {
        const PlyProperty* list = nullptr;
        for (const PlyProperty& property : element.properties) {
            if (property.name == "vertex_indices" || property.name == "vertex_index") list = &property;
        }
        if (element.count == 0) return;
        if (list == nullptr || !list->is_list || !is_integer(list->type)) {
            data_.fail("its rows lack a list of integers 'vertex_indices'");
        }
        if (geometry_.positions.empty()) data_.fail("stands before any vertex; vertices come first");
        std::vector<std::int64_t> indices;
        for (std::uint64_t row = 0; row < element.count; ++row) {
            data_.enter(element, row);
            for (const PlyProperty& property : element.properties) {
                if (&property != list) {
                    data_.skip(property);
                    continue;
                }
                const std::uint64_t length = data_.list_length(property);
                indices.clear();
                for (std::uint64_t i = 0; i < length; ++i) {
                    indices.push_back(static_cast<std::int64_t>(data_.number(property)));
                }
            }
            if (element.name == "face") {
                add_face(indices);
            } else {
                add_strips(indices);
            }
        }
    }

    std::uint32_t checked_index(std::int64_t index) const {
        if (index < 0 || index >= static_cast<std::int64_t>(geometry_.positions.size())) {
            data_.fail(
                fmt::format("refers to vertex {}; there are {}, from 0", index, geometry_.positions.size()));
        }
        if (!is_finite(geometry_.positions[static_cast<std::size_t>(index)])) {
            data_.fail(
                fmt::format("vertex {} is not finite; every coordinate must be a number that a float "
                            "holds",
                            index));
        }
        return static_cast<std::uint32_t>(index);
    }

    void add_face(const std::vector<std::int64_t>& indices) {
        if (indices.size() < 3) {
            data_.fail(fmt::format("has {} corners; a face needs 3 or more", indices.size()));
        }
        corners_.clear();
        for (const std::int64_t index : indices)
            corners_.push_back(geometry_.positions[checked_index(index)]);
        if (!splitter_.split(corners_, split_)) data_.fail(splitter_.limits());
        for (const glm::uvec3& triangle : split_) {
            geometry_.triangles.emplace_back(indices[triangle.x], indices[triangle.y], indices[triangle.z]);
        }
    }

    /// Strips run on until an index of -1. Every second triangle is turned, so that all face the same way.
    void add_strips(const std::vector<std::int64_t>& indices) {
        if (!splitter_.charge_triangles(indices.size())) data_.fail(splitter_.limits());
        std::uint32_t previous[2] = {0, 0};
        std::size_t length = 0;
        for (const std::int64_t index : indices) {
            if (index == -1) {
                length = 0;
                continue;
            }
            const std::uint32_t vertex = checked_index(index);
            if (length >= 2 && previous[0] != previous[1] && vertex != previous[0] && vertex != previous[1]) {
                const std::size_t odd = length % 2;
                geometry_.triangles.emplace_back(previous[odd], previous[1 - odd], vertex);
            }
            previous[0] = previous[1];
            previous[1] = vertex;
            ++length;
        }
    }

    Scene finished() {
        Scene scene;
        scene.name = file_name_;
        gather_vertices(geometry_, compact_vertices(geometry_.triangles, geometry_.positions.size()));
        if (geometry_.normals.empty()) {
            make_flat_normals(geometry_);
        } else if (const std::size_t broken = mend_normals(geometry_); broken > 0) {
            scene.warnings.push_back(
                fmt::format("{} normals have no direction; they are made from the faces around", broken));
        }
        if (header_.names_textures) {
            scene.warnings.emplace_back("textures named in comments ('TextureFile') are not read");
        }
        scene.materials.push_back(plain_material(!geometry_.colors.empty()));
        const auto transparent = std::count_if(geometry_.colors.begin(), geometry_.colors.end(),
                                               [](const glm::vec4& color) { return color.a < 1.0f; });
        if (transparent > 0) {
            scene.materials[0].alpha_mode = AlphaMode::kBlend;
            scene.warnings.push_back(fmt::format("{} of {} vertices are transparent by their alpha",
                                                 transparent, geometry_.colors.size()));
        }
        Mesh mesh;
        mesh.name = std::filesystem::path(file_name_).stem().string();
        append_part(mesh, std::move(geometry_));
        finish_mesh(mesh);
        place_mesh(scene, std::move(mesh), {0});
        return scene;
    }

    TextScanner scanner_;
    const std::string& file_name_;
    PlyHeader header_;
    DataReader data_;
    PolygonSplitter splitter_;
    PrimitiveGeometry geometry_;
    std::vector<glm::vec3> corners_;
    std::vector<glm::uvec3> split_;
};

}  // namespace

Scene read_ply(std::span<const std::uint8_t> bytes, const std::string& file_name) {
    return PlyReader(bytes, file_name).read();
}

}  // namespace core
