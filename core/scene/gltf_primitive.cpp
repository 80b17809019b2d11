#include "core/scene/gltf_primitive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/scene/gltf_accessors.h"

namespace core {

namespace {

constexpr std::uint64_t kTriangles = 4;
constexpr std::uint64_t kTriangleStrip = 5;

/// Checks an attribute's accessor for type and length.
void check_attribute(const GltfAccessor& accessor, const JsonElement& primitive, const char* name,
                     int least_components, int most_components, std::size_t vertex_count) {
    if (accessor.component_count() < least_components || accessor.component_count() > most_components) {
        accessor.element().fail(fmt::format("has {} components; {} of {} needs {}",
                                            accessor.component_count(), name, primitive.path(),
                                            most_components));
    }
    if (accessor.count() != vertex_count) {
        accessor.element().fail(fmt::format("has {} elements; {} of {} needs {}, as many as POSITION",
                                            accessor.count(), name, primitive.path(), vertex_count));
    }
}

std::vector<std::uint32_t> read_indices(GltfDocument& document, const JsonElement& primitive,
                                        std::size_t index, std::size_t vertex_count) {
    const GltfAccessor accessor(document, index);
    if (!accessor.is_unsigned_scalar()) {
        accessor.element().fail("indices must be SCALAR of componentType 5121, 5123 or 5125");
    }
    document.charge_memory(accessor.count(), sizeof(std::uint32_t) + sizeof(glm::uvec3), accessor.element());
    std::vector<std::uint32_t> indices(accessor.count());
    for (std::size_t i = 0; i < indices.size(); ++i) {
        indices[i] = accessor.read_unsigned(i);
        if (indices[i] >= vertex_count) {
            accessor.element().fail(fmt::format("index {} is {}, but {} has {} vertices", i, indices[i],
                                                primitive.path(), vertex_count));
        }
    }
    return indices;
}

/// The order of corners is the specification's, section 3.7.2.1: every triangle of a strip faces the same
/// way.
std::vector<glm::uvec3> make_triangles(std::uint64_t mode, const std::vector<std::uint32_t>& indices) {
    std::vector<glm::uvec3> triangles;
    const std::size_t count = indices.size();
    if (count < 3) return triangles;
    if (mode == kTriangles) {
        triangles.reserve(count / 3);
        for (std::size_t i = 0; i + 2 < count; i += 3) {
            triangles.emplace_back(indices[i], indices[i + 1], indices[i + 2]);
        }
        return triangles;
    }
    triangles.reserve(count - 2);
    for (std::size_t i = 0; i + 2 < count; ++i) {
        if (mode == kTriangleStrip) {
            const std::size_t odd = i % 2;
            triangles.emplace_back(indices[i], indices[i + 1 + odd], indices[i + 2 - odd]);
        } else {
            triangles.emplace_back(indices[i + 1], indices[i + 2], indices[0]);
        }
    }
    return triangles;
}

/// Reads the attributes of the used vertices.
class VertexReader {
public:
    /// @param draco the decoded mesh if the primitive is compressed, else null.
    VertexReader(GltfDocument& document, const JsonElement& primitive, const PrimitiveSource& source,
                 const std::vector<double>& weights, const DracoMesh* draco, std::size_t vertex_count)
        : document_(document),
          primitive_(primitive),
          source_(source),
          weights_(weights),
          draco_(draco),
          vertex_count_(vertex_count) {}

    void read(const std::vector<std::uint32_t>& used, bool tangents, PrimitiveGeometry& geometry) const {
        read_positions(used, geometry.positions);
        if (source_.normal != kNoAccessor) {
            read_displaced(used, source_.normal, &MorphTarget::normal, "NORMAL", 3, geometry.normals);
            // Tangents that come without normals belong to normals that are not there.
            if (tangents && source_.tangent != kNoAccessor) {
                read_displaced(used, source_.tangent, &MorphTarget::tangent, "TANGENT", 4, geometry.tangents);
            }
        }
        for (std::size_t set = 0; set < 2; ++set) {
            if (source_.uvs[set] != kNoAccessor) read_uvs(used, set, geometry.uvs[set]);
        }
        if (source_.color != kNoAccessor) read_colors(used, geometry.colors);
    }

private:
    GltfAccessor open(std::size_t index, const char* name, int least_components, int most_components) const {
        if (draco_) {
            const auto decoded = draco_->attributes.find(name);
            if (decoded != draco_->attributes.end()) {
                GltfAccessor accessor(read_accessor_layout(document_, index), decoded->second);
                check_attribute(accessor, primitive_, name, least_components, most_components, vertex_count_);
                return accessor;
            }
        }
        return open_plain(index, name, least_components, most_components);
    }

    /// Morph targets are never in the compressed data, whatever their attribute is called.
    GltfAccessor open_plain(std::size_t index, const char* name, int least_components,
                            int most_components) const {
        GltfAccessor accessor(document_, index);
        check_attribute(accessor, primitive_, name, least_components, most_components, vertex_count_);
        return accessor;
    }

    template <typename Vector>
    void read_displaced(const std::vector<std::uint32_t>& used, std::size_t base,
                        std::size_t MorphTarget::*target_accessor, const char* name, int component_count,
                        std::vector<Vector>& result) const {
        const GltfAccessor accessor = open(base, name, component_count, component_count);
        result.reserve(used.size());
        for (const std::uint32_t vertex : used) result.emplace_back(accessor.read(vertex));
        for (std::size_t t = 0; t < std::min(source_.targets.size(), weights_.size()); ++t) {
            const std::size_t index = source_.targets[t].*target_accessor;
            const auto weight = static_cast<float>(weights_[t]);
            if (index == kNoAccessor || weight == 0.0f) continue;
            document_.charge_memory(used.size(), sizeof(glm::vec3), primitive_);
            const GltfAccessor displacement = open_plain(index, name, 3, 3);
            for (std::size_t i = 0; i < used.size(); ++i) {
                result[i] += Vector(weight * displacement.read(used[i]));
            }
        }
    }

    void read_positions(const std::vector<std::uint32_t>& used, std::vector<glm::vec3>& positions) const {
        read_displaced(used, source_.position, &MorphTarget::position, "POSITION", 3, positions);
        for (std::size_t i = 0; i < positions.size(); ++i) {
            if (is_finite(positions[i])) continue;
            primitive_.fail(
                fmt::format("POSITION (accessor {}) of vertex {} is not finite", source_.position, used[i]));
        }
    }

    void read_uvs(const std::vector<std::uint32_t>& used, std::size_t set,
                  std::vector<glm::vec2>& uvs) const {
        const std::string name = fmt::format("TEXCOORD_{}", set);
        const GltfAccessor accessor = open(source_.uvs[set], name.c_str(), 2, 2);
        uvs.reserve(used.size());
        bool broken = false;
        for (const std::uint32_t vertex : used) {
            const glm::vec2 uv(accessor.read(vertex));
            const bool usable = std::isfinite(uv.x) && std::isfinite(uv.y);
            uvs.push_back(usable ? uv : glm::vec2(0.0f));
            broken = broken || !usable;
        }
        if (broken)
            document_.warn_once(primitive_.path() + ": " + name + " is not finite in places; 0 there");
    }

    /// The specification demands colours in [0, 1].
    void read_colors(const std::vector<std::uint32_t>& used, std::vector<glm::vec4>& colors) const {
        const GltfAccessor accessor = open(source_.color, "COLOR_0", 3, 4);
        if (!accessor.is_float() && !accessor.is_normalized()) {
            accessor.element().fail("COLOR_0 must be float or normalized");
        }
        colors.reserve(used.size());
        for (const std::uint32_t vertex : used) {
            glm::vec4 color = accessor.read(vertex);
            if (accessor.component_count() == 3) color.a = 1.0f;
            for (int i = 0; i < 4; ++i) {
                color[i] = color[i] > 0.0f ? std::min(color[i], 1.0f) : 0.0f;
            }
            colors.push_back(color);
        }
    }

    GltfDocument& document_;
    const JsonElement& primitive_;
    const PrimitiveSource& source_;
    const std::vector<double>& weights_;
    const DracoMesh* draco_;
    std::size_t vertex_count_;
};

/// The primitive's compressed data, with its accessors' word for how much they may hold.
DracoMesh decode_compressed(GltfDocument& document, const JsonElement& element,
                            const PrimitiveSource& source) {
    if (source.mode != kTriangles && source.mode != kTriangleStrip) {
        element.fail("holds Draco data, which need mode TRIANGLES or TRIANGLE_STRIP");
    }
    if (source.indices == kNoAccessor) element.fail("holds Draco data, but no indices accessor");
    DracoExpectation expected;
    expected.vertex_count = read_accessor_layout(document, source.position).count;
    expected.index_count = read_accessor_layout(document, source.indices).count;
    // A strip has a triangle an index, past the first two.
    if (source.mode == kTriangleStrip) expected.index_count *= 3;
    const auto expect = [&](const char* name, std::size_t accessor) {
        if (accessor != kNoAccessor && source.draco->attributes.contains(name)) {
            expected.accessors.emplace(name, accessor);
        }
    };
    expect("POSITION", source.position);
    expect("NORMAL", source.normal);
    expect("TANGENT", source.tangent);
    expect("TEXCOORD_0", source.uvs[0]);
    expect("TEXCOORD_1", source.uvs[1]);
    expect("COLOR_0", source.color);
    return decode_draco(document, element, *source.draco, expected);
}

}  // namespace

PrimitiveSource read_primitive_source(const GltfDocument& document, const JsonElement& primitive) {
    const std::size_t accessor_count = document.count("accessors");
    const auto accessor_of = [&](const JsonElement& object, const char* key) {
        const auto member = object.find(key);
        return member ? member->index(accessor_count, "accessors") : kNoAccessor;
    };
    const JsonElement attributes = primitive.require("attributes");
    PrimitiveSource source;
    source.mode = primitive.unsigned_or("mode", kTriangles);
    source.indices = accessor_of(primitive, "indices");
    source.position = accessor_of(attributes, "POSITION");
    source.normal = accessor_of(attributes, "NORMAL");
    source.tangent = accessor_of(attributes, "TANGENT");
    source.uvs = {accessor_of(attributes, "TEXCOORD_0"), accessor_of(attributes, "TEXCOORD_1")};
    source.color = accessor_of(attributes, "COLOR_0");
    if (const auto targets = primitive.find("targets")) {
        for (std::size_t i = 0; i < targets->size(); ++i) {
            const JsonElement target = targets->at(i);
            source.targets.push_back({accessor_of(target, "POSITION"), accessor_of(target, "NORMAL"),
                                      accessor_of(target, "TANGENT")});
        }
    }
    if (const auto extension = primitive.extension("KHR_draco_mesh_compression")) {
        source.draco = read_draco_source(document, *extension);
    }
    return source;
}

PrimitiveGeometry decode_primitive(GltfDocument& document, const JsonElement& element,
                                   const PrimitiveSource& source, const std::vector<double>& weights,
                                   int tangent_uv_set) {
    std::optional<DracoMesh> draco;
    if (source.draco) draco = decode_compressed(document, element, source);
    const std::size_t vertex_count =
        draco ? draco->point_count : GltfAccessor(document, source.position).count();
    std::vector<std::uint32_t> indices;
    if (draco) {
        document.charge_memory(draco->indices.size(), sizeof(std::uint32_t) + sizeof(glm::uvec3), element);
        indices = std::move(draco->indices);
    } else if (source.indices != kNoAccessor) {
        indices = read_indices(document, element, source.indices, vertex_count);
    } else {
        document.charge_memory(vertex_count, sizeof(std::uint32_t) + sizeof(glm::uvec3), element);
        indices.resize(vertex_count);
        for (std::size_t i = 0; i < vertex_count; ++i) indices[i] = static_cast<std::uint32_t>(i);
    }
    // Draco decodes strips to single triangles, too.
    const std::uint64_t mode = draco ? kTriangles : source.mode;
    if (mode == kTriangles ? indices.size() % 3 != 0 : indices.size() < 3) {
        document.warn_once(fmt::format("{}: {} vertices do not make up whole triangles; the rest is ignored",
                                       element.path(), indices.size()));
    }

    PrimitiveGeometry geometry;
    geometry.triangles = make_triangles(mode, indices);
    const std::vector<std::uint32_t> used = compact_vertices(geometry.triangles, vertex_count);
    const std::size_t stored_vertices =
        source.normal == kNoAccessor ? 3 * geometry.triangles.size() : used.size();
    document.charge_memory(stored_vertices,
                           2 * sizeof(glm::vec3) + 2 * sizeof(glm::vec2) + 2 * sizeof(glm::vec4), element);
    const bool tangents = tangent_uv_set >= 0;
    VertexReader(document, element, source, weights, draco ? &*draco : nullptr, vertex_count)
        .read(used, tangents, geometry);
    if (source.normal == kNoAccessor) {
        make_flat_normals(geometry);
    } else if (const std::size_t broken = mend_normals(geometry); broken > 0) {
        document.warn_once(fmt::format(
            "{}: {} normals have no direction; they are made from the faces around", element.path(), broken));
    }
    if (!geometry.tangents.empty()) {
        mend_tangents(geometry);
    } else if (tangents) {
        make_tangents(geometry, static_cast<std::size_t>(tangent_uv_set));
    }
    return geometry;
}

}  // namespace core
