// core/scene/gltf_draco.h: primitives compressed with KHR_draco_mesh_compression.
//
// Fan Zhang and others, "KHR_draco_mesh_compression", ratified by the Khronos Group, 2018; bitstream 2.2 of
// Google's Draco, both of its methods for meshes (edgebreaker and sequential).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/scene/gltf_document.h"

namespace core {

/// Where a primitive's compressed data lie. Equal sources decode to equal meshes.
struct DracoSource {
    std::size_t buffer_view = 0;
    std::map<std::string, std::uint64_t> attributes;  ///< Draco's unique id by glTF name ("POSITION").
    auto operator<=>(const DracoSource&) const = default;
};

/// @param extension the primitive's KHR_draco_mesh_compression object. @throws InputError
DracoSource read_draco_source(const GltfDocument& document, const JsonElement& extension);

/// The decoded mesh, each attribute tightly packed in the type of the accessor that stands for it.
struct DracoMesh {
    std::vector<std::uint32_t> indices;  ///< Three a triangle, each below point_count.
    std::size_t point_count = 0;
    std::map<std::string, std::vector<std::uint8_t>> attributes;
};

/// What the glTF accessors say of a mesh before it is decoded.
struct DracoExpectation {
    std::size_t vertex_count = 0;
    std::size_t index_count = 0;
    std::map<std::string, std::size_t> accessors;  ///< By glTF name; those wanted of DracoSource::attributes.
};

/// Decodes a mesh. Its header must not claim more than the accessors do, and all memory that decoding takes
/// is charged to `document` before it is taken.
/// @param primitive for messages.
/// @throws InputError for data that are damaged or do not fit the accessors.
DracoMesh decode_draco(GltfDocument& document, const JsonElement& primitive, const DracoSource& source,
                       const DracoExpectation& expected);

}  // namespace core
