#include "core/scene/gltf_primitive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "core/scene/gltf_accessors.h"
#include "core/scene/tangent_space.h"

namespace core {

namespace {

constexpr std::uint64_t kTriangles = 4;
constexpr std::uint64_t kTriangleStrip = 5;

/// An attribute's accessor, checked for type and length.
GltfAccessor open_attribute(const GltfDocument& document, const JsonElement& primitive, std::size_t index,
                            const char* name, int least_components, int most_components,
                            std::size_t vertex_count) {
    GltfAccessor accessor(document, index);
    if (accessor.component_count() < least_components || accessor.component_count() > most_components) {
        accessor.element().fail(fmt::format("has {} components; {} of {} needs {}",
                                            accessor.component_count(), name, primitive.path(),
                                            most_components));
    }
    if (accessor.count() != vertex_count) {
        accessor.element().fail(fmt::format("has {} elements; {} of {} needs {}, as many as POSITION",
                                            accessor.count(), name, primitive.path(), vertex_count));
    }
    return accessor;
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

/// Renumbers the triangles' vertices without gaps and returns the old number of each. Many exporters keep all
/// meshes' vertices in one accessor; copying all of it for each mesh would be quadratic.
std::vector<std::uint32_t> compact_vertices(std::vector<glm::uvec3>& triangles, std::size_t vertex_count) {
    std::vector<std::uint32_t> used;
    used.reserve(3 * triangles.size());
    for (const glm::uvec3& triangle : triangles) {
        used.insert(used.end(), {triangle.x, triangle.y, triangle.z});
    }
    const bool dense = vertex_count <= 4 * used.size();
    std::vector<std::uint32_t> new_of_old(dense ? vertex_count : 0, 0);
    if (dense) {
        for (const std::uint32_t vertex : used) new_of_old[vertex] = 1;
        used.clear();
        for (std::size_t old = 0; old < vertex_count; ++old) {
            if (new_of_old[old] == 0) continue;
            new_of_old[old] = static_cast<std::uint32_t>(used.size());
            used.push_back(static_cast<std::uint32_t>(old));
        }
    } else {
        std::sort(used.begin(), used.end());
        used.erase(std::unique(used.begin(), used.end()), used.end());
    }
    for (glm::uvec3& triangle : triangles) {
        for (int corner = 0; corner < 3; ++corner) {
            const std::uint32_t old = triangle[corner];
            triangle[corner] = dense ? new_of_old[old]
                                     : static_cast<std::uint32_t>(
                                           std::lower_bound(used.begin(), used.end(), old) - used.begin());
        }
    }
    return used;
}

bool finite(const glm::vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

glm::vec3 area_vector(const PrimitiveGeometry& geometry, const glm::uvec3& triangle) {
    const glm::dvec3 a(geometry.positions[triangle.x]);
    const glm::dvec3 cross = glm::cross(glm::dvec3(geometry.positions[triangle.y]) - a,
                                        glm::dvec3(geometry.positions[triangle.z]) - a);
    const double length = glm::length(cross);
    return length > 0.0 && std::isfinite(length) ? glm::vec3(cross / length) : glm::vec3(0.0f);
}

/// Normalises the file's normals; those that have no direction take that of the faces around them.
std::size_t mend_normals(PrimitiveGeometry& geometry) {
    std::vector<std::uint32_t> broken;
    for (std::size_t i = 0; i < geometry.normals.size(); ++i) {
        const glm::dvec3 normal(geometry.normals[i]);
        const double length = glm::length(normal);
        if (length > 0.0 && std::isfinite(length)) {
            geometry.normals[i] = glm::vec3(normal / length);
        } else {
            geometry.normals[i] = glm::vec3(0.0f);
            broken.push_back(static_cast<std::uint32_t>(i));
        }
    }
    if (broken.empty()) return 0;
    std::vector<glm::vec3> sums(geometry.normals.size(), glm::vec3(0.0f));
    for (const glm::uvec3& triangle : geometry.triangles) {
        const glm::vec3 face = area_vector(geometry, triangle);
        for (int corner = 0; corner < 3; ++corner) sums[triangle[corner]] += face;
    }
    for (const std::uint32_t vertex : broken) {
        const float length = glm::length(sums[vertex]);
        geometry.normals[vertex] = length > 0.0f ? sums[vertex] / length : glm::vec3(0.0f, 0.0f, 1.0f);
    }
    return broken.size();
}

/// Gives every corner its own copy of its vertex: `source[i]` is the vertex that new vertex i copies.
void gather_vertices(PrimitiveGeometry& geometry, const std::vector<std::uint32_t>& source) {
    const auto gather = [&](auto& values) {
        if (values.empty()) return;
        std::remove_reference_t<decltype(values)> copied;
        copied.reserve(source.size());
        for (const std::uint32_t vertex : source) copied.push_back(values[vertex]);
        values = std::move(copied);
    };
    gather(geometry.positions);
    gather(geometry.normals);
    gather(geometry.tangents);
    for (auto& uvs : geometry.uvs) gather(uvs);
    gather(geometry.colors);
}

/// Flat normals, as the specification demands where NORMAL is missing: no vertex is shared.
void make_flat_normals(PrimitiveGeometry& geometry) {
    std::vector<std::uint32_t> source;
    source.reserve(3 * geometry.triangles.size());
    for (glm::uvec3& triangle : geometry.triangles) {
        const auto first = static_cast<std::uint32_t>(source.size());
        source.insert(source.end(), {triangle.x, triangle.y, triangle.z});
        triangle = {first, first + 1, first + 2};
    }
    gather_vertices(geometry, source);
    geometry.normals.assign(source.size(), glm::vec3(0.0f, 0.0f, 1.0f));
    for (const glm::uvec3& triangle : geometry.triangles) {
        const glm::vec3 normal = area_vector(geometry, triangle);
        if (normal == glm::vec3(0.0f)) continue;
        for (int corner = 0; corner < 3; ++corner) geometry.normals[triangle[corner]] = normal;
    }
}

/// Makes tangents, and splits the vertices where texture coordinates are mirrored.
void make_tangents(PrimitiveGeometry& geometry, std::size_t uv_set) {
    const std::vector<glm::vec2>& uvs = geometry.uvs[uv_set];
    const std::size_t vertex_count = geometry.positions.size();
    if (uvs.empty()) {
        for (const glm::vec3& normal : geometry.normals) geometry.tangents.push_back(any_tangent(normal));
        return;
    }
    const std::vector<glm::vec4> corners =
        corner_tangents(geometry.positions, geometry.normals, uvs, geometry.triangles);
    geometry.tangents.assign(vertex_count, glm::vec4(0.0f));
    std::vector<std::uint32_t> source(vertex_count);
    for (std::size_t i = 0; i < vertex_count; ++i) source[i] = static_cast<std::uint32_t>(i);
    std::vector<std::uint32_t> twin(vertex_count, 0);
    for (std::size_t t = 0; t < geometry.triangles.size(); ++t) {
        for (int corner = 0; corner < 3; ++corner) {
            std::uint32_t& vertex = geometry.triangles[t][corner];
            const glm::vec4& tangent = corners[3 * t + static_cast<std::size_t>(corner)];
            if (geometry.tangents[vertex].w == 0.0f) {
                geometry.tangents[vertex] = tangent;
            } else if (geometry.tangents[vertex].w != tangent.w) {
                if (twin[vertex] == 0) {
                    twin[vertex] = static_cast<std::uint32_t>(source.size());
                    source.push_back(vertex);
                    geometry.tangents.push_back(tangent);
                }
                vertex = twin[vertex];
            }
        }
    }
    if (source.size() == vertex_count) return;
    const std::vector<glm::vec4> tangents = std::exchange(geometry.tangents, {});
    gather_vertices(geometry, source);
    geometry.tangents = tangents;
}

/// The file's tangents, normalised; broken ones become any perpendicular direction.
void mend_tangents(PrimitiveGeometry& geometry) {
    for (std::size_t i = 0; i < geometry.tangents.size(); ++i) {
        glm::vec4& tangent = geometry.tangents[i];
        const glm::dvec3 direction(tangent);
        const double length = glm::length(direction);
        if (!(length > 0.0) || !std::isfinite(length)) {
            tangent = any_tangent(geometry.normals[i]);
            continue;
        }
        tangent = glm::vec4(glm::vec3(direction / length), tangent.w < 0.0f ? -1.0f : 1.0f);
    }
}

/// Reads the attributes of the used vertices.
class VertexReader {
public:
    VertexReader(GltfDocument& document, const JsonElement& primitive, const PrimitiveSource& source,
                 const std::vector<double>& weights, std::size_t vertex_count)
        : document_(document),
          primitive_(primitive),
          source_(source),
          weights_(weights),
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
    template <typename Vector>
    void read_displaced(const std::vector<std::uint32_t>& used, std::size_t base,
                        std::size_t MorphTarget::*target_accessor, const char* name, int component_count,
                        std::vector<Vector>& result) const {
        const GltfAccessor accessor = open_attribute(document_, primitive_, base, name, component_count,
                                                     component_count, vertex_count_);
        result.reserve(used.size());
        for (const std::uint32_t vertex : used) result.emplace_back(accessor.read(vertex));
        for (std::size_t t = 0; t < std::min(source_.targets.size(), weights_.size()); ++t) {
            const std::size_t index = source_.targets[t].*target_accessor;
            const auto weight = static_cast<float>(weights_[t]);
            if (index == kNoAccessor || weight == 0.0f) continue;
            const GltfAccessor displacement =
                open_attribute(document_, primitive_, index, name, 3, 3, vertex_count_);
            for (std::size_t i = 0; i < used.size(); ++i) {
                result[i] += Vector(weight * displacement.read(used[i]));
            }
        }
    }

    void read_positions(const std::vector<std::uint32_t>& used, std::vector<glm::vec3>& positions) const {
        read_displaced(used, source_.position, &MorphTarget::position, "POSITION", 3, positions);
        for (std::size_t i = 0; i < positions.size(); ++i) {
            if (finite(positions[i])) continue;
            primitive_.fail(
                fmt::format("POSITION (accessor {}) of vertex {} is not finite", source_.position, used[i]));
        }
    }

    void read_uvs(const std::vector<std::uint32_t>& used, std::size_t set,
                  std::vector<glm::vec2>& uvs) const {
        const std::string name = fmt::format("TEXCOORD_{}", set);
        const GltfAccessor accessor =
            open_attribute(document_, primitive_, source_.uvs[set], name.c_str(), 2, 2, vertex_count_);
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
        const GltfAccessor accessor =
            open_attribute(document_, primitive_, source_.color, "COLOR_0", 3, 4, vertex_count_);
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
    std::size_t vertex_count_;
};

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
    return source;
}

PrimitiveGeometry decode_primitive(GltfDocument& document, const JsonElement& element,
                                   const PrimitiveSource& source, const std::vector<double>& weights,
                                   int tangent_uv_set) {
    const GltfAccessor position(document, source.position);
    if (!position.has_data() && element.extension("KHR_draco_mesh_compression")) {
        element.fail("holds Draco data without a fallback; export it uncompressed");
    }
    const std::size_t vertex_count = position.count();
    std::vector<std::uint32_t> indices;
    if (source.indices != kNoAccessor) {
        indices = read_indices(document, element, source.indices, vertex_count);
    } else {
        document.charge_memory(vertex_count, sizeof(std::uint32_t) + sizeof(glm::uvec3), element);
        indices.resize(vertex_count);
        for (std::size_t i = 0; i < vertex_count; ++i) indices[i] = static_cast<std::uint32_t>(i);
    }
    if (source.mode == kTriangles ? indices.size() % 3 != 0 : indices.size() < 3) {
        document.warn_once(fmt::format("{}: {} vertices do not make up whole triangles; the rest is ignored",
                                       element.path(), indices.size()));
    }

    PrimitiveGeometry geometry;
    geometry.triangles = make_triangles(source.mode, indices);
    const std::vector<std::uint32_t> used = compact_vertices(geometry.triangles, vertex_count);
    const std::size_t stored_vertices =
        source.normal == kNoAccessor ? 3 * geometry.triangles.size() : used.size();
    document.charge_memory(stored_vertices,
                           2 * sizeof(glm::vec3) + 2 * sizeof(glm::vec2) + 2 * sizeof(glm::vec4), element);
    const bool tangents = tangent_uv_set >= 0;
    VertexReader(document, element, source, weights, vertex_count).read(used, tangents, geometry);
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
