// core/scene/gltf_primitive.h: one glTF primitive to triangles with complete vertices.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/gltf_document.h"
#include "core/scene/gltf_draco.h"
#include "core/scene/primitive_geometry.h"

namespace core {

inline constexpr std::size_t kNoAccessor = std::numeric_limits<std::size_t>::max();

/// The displacements of one morph target, as accessor indices.
struct MorphTarget {
    std::size_t position = kNoAccessor;
    std::size_t normal = kNoAccessor;
    std::size_t tangent = kNoAccessor;
    auto operator<=>(const MorphTarget&) const = default;
};

/// Which accessors a primitive's geometry is made of, and the compressed data that replace theirs. Equal
/// sources give equal triangles.
struct PrimitiveSource {
    std::uint64_t mode = 4;
    std::size_t indices = kNoAccessor;
    std::size_t position = kNoAccessor;
    std::size_t normal = kNoAccessor;
    std::size_t tangent = kNoAccessor;
    std::array<std::size_t, 2> uvs = {kNoAccessor, kNoAccessor};
    std::size_t color = kNoAccessor;
    std::vector<MorphTarget> targets;
    std::optional<DracoSource> draco;
    auto operator<=>(const PrimitiveSource&) const = default;
};

/// Reads the accessor indices of a primitive that draws triangles.
PrimitiveSource read_primitive_source(const GltfDocument& document, const JsonElement& primitive);

/// Decodes a primitive.
/// @param element of the primitive, for messages. @param weights of the morph targets; missing ones are 0.
/// @param tangent_uv_set texture coordinates that tangents follow; negative: no tangents.
/// @throws InputError for indices out of range, positions that are not finite, attributes of unequal length.
PrimitiveGeometry decode_primitive(GltfDocument& document, const JsonElement& element,
                                   const PrimitiveSource& source, const std::vector<double>& weights,
                                   int tangent_uv_set);

}  // namespace core
