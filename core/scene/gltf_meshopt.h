// core/scene/gltf_meshopt.h: buffer views compressed with EXT_meshopt_compression.
//
// Arseny Kapoulkine and others, "EXT_meshopt_compression", ratified by the Khronos Group, 2021: all modes and
// filters. The codecs are meshoptimizer's, which reads untrusted data without leaving its buffers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/scene/gltf_json.h"

namespace core {

enum class MeshoptMode : std::uint8_t { kAttributes, kTriangles, kIndices };
enum class MeshoptFilter : std::uint8_t { kNone, kOctahedral, kQuaternion, kExponential };

/// What a compressed view holds once decoded: `count` elements, `stride` bytes apart.
struct MeshoptLayout {
    MeshoptMode mode = MeshoptMode::kAttributes;
    MeshoptFilter filter = MeshoptFilter::kNone;
    std::size_t count = 0;
    std::size_t stride = 0;
};

/// Reads the extension's object of a buffer view and checks it against the view.
/// @throws InputError for anything the extension forbids; count x stride is the view's byteLength.
MeshoptLayout read_meshopt_layout(const JsonElement& view, const JsonElement& extension);

/// Decodes count x stride bytes. The result may be any garbage if the data are damaged in a way that the
/// codec cannot see, so it needs the checks of uncompressed data.
/// @param extension for messages. @throws InputError
std::vector<std::uint8_t> decode_meshopt(const MeshoptLayout& layout,
                                         std::span<const std::uint8_t> compressed,
                                         const JsonElement& extension);

}  // namespace core
