#include "core/scene/stl_file.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>

#include "core/scene/mesh_assembly.h"
#include "core/scene/text_scanner.h"
#include "core/support/error.h"

namespace core {

namespace {

constexpr std::size_t kHeaderSize = 80;
constexpr std::size_t kPrefixSize = kHeaderSize + 4;
constexpr std::size_t kFacetSize = 50;
constexpr std::size_t kMostFacets = std::numeric_limits<std::uint32_t>::max() / 3;

std::uint32_t read_u32(const std::uint8_t* bytes) {
    return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8 |
           static_cast<std::uint32_t>(bytes[2]) << 16 | static_cast<std::uint32_t>(bytes[3]) << 24;
}

glm::vec3 read_vector(const std::uint8_t* bytes) {
    return {std::bit_cast<float>(read_u32(bytes)), std::bit_cast<float>(read_u32(bytes + 4)),
            std::bit_cast<float>(read_u32(bytes + 8))};
}

/// Text begins with `solid`, and then with a facet or the end. Headers of binary files begin with `solid`,
/// too, but nothing like that follows.
bool is_text(std::span<const std::uint8_t> bytes) {
    TextScanner scanner(as_text(bytes));
    if (lower_case(scanner.word()) != "solid") return false;
    if (bytes.size() >= kPrefixSize) {
        const std::uint64_t facet_count = read_u32(bytes.data() + kHeaderSize);
        if (bytes.size() == kPrefixSize + facet_count * kFacetSize) return false;
    }
    scanner.next_line();
    const std::string second = lower_case(scanner.word());
    // A file that is cut off in its first line is the text's case, not that of a binary header.
    return second == "facet" || second == "endsolid" || bytes.size() < kPrefixSize;
}

/// The facets of one solid.
class Solid {
public:
    Solid(std::string name, const std::string& file_name) : name_(std::move(name)), file_name_(file_name) {}

    std::size_t facet_count() const { return geometry_.triangles.size(); }

    /// @param place of the facet, for messages.
    void add(const glm::vec3& normal, const glm::vec3 (&corners)[3], const std::string& place) {
        for (int i = 0; i < 3; ++i) {
            if (is_finite(corners[i])) continue;
            throw InputError(ErrorKind::kBadData,
                             fmt::format("'{}': {}: vertex {} is not finite; every coordinate must be a "
                                         "number that a float holds",
                                         file_name_, place, i + 1));
        }
        const auto first = static_cast<std::uint32_t>(geometry_.positions.size());
        geometry_.positions.insert(geometry_.positions.end(), std::begin(corners), std::end(corners));
        geometry_.triangles.emplace_back(first, first + 1, first + 2);
        const glm::dvec3 a(corners[0]);
        const glm::dvec3 winding = glm::cross(glm::dvec3(corners[1]) - a, glm::dvec3(corners[2]) - a);
        if (glm::dot(winding, glm::dvec3(normal)) < 0.0) ++contrary_normal_count_;
    }

    void place(Scene& scene) {
        if (contrary_normal_count_ > 0) {
            scene.warnings.push_back(
                fmt::format("solid '{}': {} of {} facets state a normal that their corners are not in "
                            "counter-clockwise order about; the order of the corners counts",
                            name_, contrary_normal_count_, facet_count()));
        }
        make_flat_normals(geometry_);
        Mesh mesh;
        mesh.name = name_;
        append_part(mesh, std::move(geometry_));
        finish_mesh(mesh);
        place_mesh(scene, std::move(mesh), {0});
    }

private:
    std::string name_;
    const std::string& file_name_;
    PrimitiveGeometry geometry_;
    std::size_t contrary_normal_count_ = 0;
};

class TextReader {
public:
    TextReader(std::span<const std::uint8_t> bytes, const std::string& file_name)
        : scanner_(as_text(bytes)), file_name_(file_name) {}

    void read(Scene& scene, const std::string& default_name) {
        std::size_t facet_count = 0;
        for (std::string_view word = scanner_.word(); !word.empty(); word = scanner_.word()) {
            if (lower_case(word) != "solid") fail(word, "solid");
            const std::string name(scanner_.rest_of_line());
            Solid solid(name.empty() ? default_name : name, file_name_);
            read_facets(solid, facet_count);
            if (solid.facet_count() > 0) solid.place(scene);
        }
    }

private:
    void read_facets(Solid& solid, std::size_t& facet_count) {
        for (;;) {
            const std::string_view word = scanner_.word();
            const std::string keyword = lower_case(word);
            if (keyword == "endsolid") {
                scanner_.rest_of_line();
                return;
            }
            if (keyword != "facet") fail(word, "facet or endsolid");
            if (++facet_count > kMostFacets) {
                throw InputError(ErrorKind::kBadData,
                                 fmt::format("'{}': line {}: is facet {}; at most {} can be read", file_name_,
                                             scanner_.line_number(), facet_count, kMostFacets));
            }
            const std::size_t line = scanner_.line_number();
            expect("normal");
            const glm::vec3 normal = vector();
            expect("outer");
            expect("loop");
            glm::vec3 corners[3];
            for (glm::vec3& corner : corners) {
                expect("vertex");
                corner = vector();
            }
            expect("endloop");
            expect("endfacet");
            solid.add(normal, corners, fmt::format("line {}: facet {}", line, facet_count));
        }
    }

    void expect(std::string_view keyword) {
        const std::string_view word = scanner_.word();
        if (lower_case(word) != keyword) fail(word, keyword);
    }

    glm::vec3 vector() {
        glm::vec3 result;
        for (int i = 0; i < 3; ++i) {
            const std::string_view word = scanner_.word();
            const std::optional<double> number = parse_number(word);
            if (!number) fail(word, "a number");
            result[i] = static_cast<float>(*number);
        }
        return result;
    }

    [[noreturn]] void fail(std::string_view found, std::string_view wanted) const {
        throw InputError(
            ErrorKind::kBadData,
            fmt::format("'{}': line {}: {} where {} must stand", file_name_, scanner_.line_number(),
                        found.empty() ? "the file ends" : fmt::format("'{}' stands", quotable(found)),
                        wanted));
    }

    TextScanner scanner_;
    const std::string& file_name_;
};

void read_binary(std::span<const std::uint8_t> bytes, const std::string& file_name, const std::string& name,
                 Scene& scene) {
    const auto refuse = [&](const std::string& reason) {
        throw InputError(ErrorKind::kBadData, fmt::format("'{}': {}", file_name, reason));
    };
    if (bytes.size() < kPrefixSize) {
        refuse(
            fmt::format("has {} bytes; binary STL begins with a header of 80 and a count of 4, text with "
                        "'solid'",
                        bytes.size()));
    }
    const std::uint64_t facet_count = read_u32(bytes.data() + kHeaderSize);
    const std::uint64_t byte_count = kPrefixSize + facet_count * kFacetSize;
    if (bytes.size() < byte_count) {
        refuse(
            fmt::format("is no STL text, and as binary STL it is cut short or damaged: its count of {} "
                        "facets takes {} bytes, but it has {}",
                        facet_count, byte_count, bytes.size()));
    }
    if (facet_count > kMostFacets) {
        refuse(fmt::format("has {} facets; at most {} can be read", facet_count, kMostFacets));
    }
    if (bytes.size() > byte_count) {
        scene.warnings.push_back(fmt::format("{} bytes after the last of {} facets are ignored",
                                             bytes.size() - byte_count, facet_count));
    }
    Solid solid(name, file_name);
    for (std::size_t i = 0; i < facet_count; ++i) {
        const std::uint8_t* facet = bytes.data() + kPrefixSize + i * kFacetSize;
        const glm::vec3 corners[3] = {read_vector(facet + 12), read_vector(facet + 24),
                                      read_vector(facet + 36)};
        solid.add(read_vector(facet), corners, fmt::format("facet {}", i + 1));
    }
    if (facet_count > 0) solid.place(scene);
}

}  // namespace

Scene read_stl(std::span<const std::uint8_t> bytes, const std::string& file_name) {
    Scene scene;
    scene.name = file_name;
    scene.materials.push_back(plain_material(false));
    const std::string name = std::filesystem::path(file_name).stem().string();
    if (is_text(bytes)) {
        TextReader(bytes, file_name).read(scene, name);
    } else {
        read_binary(bytes, file_name, name, scene);
    }
    if (scene.meshes.empty()) {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("'{}': holds no facets; there is nothing to show", file_name));
    }
    return scene;
}

}  // namespace core
