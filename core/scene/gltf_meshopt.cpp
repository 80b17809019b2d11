#include "core/scene/gltf_meshopt.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <string>

namespace core {

namespace {

MeshoptMode read_mode(const JsonElement& extension) {
    const std::string mode = extension.require("mode").text();
    if (mode == "ATTRIBUTES") return MeshoptMode::kAttributes;
    if (mode == "TRIANGLES") return MeshoptMode::kTriangles;
    if (mode == "INDICES") return MeshoptMode::kIndices;
    extension.fail(fmt::format("mode '{}' is none of ATTRIBUTES, TRIANGLES, INDICES", mode));
}

MeshoptFilter read_filter(const JsonElement& extension) {
    const std::string filter = extension.text_or("filter", "NONE");
    if (filter == "NONE") return MeshoptFilter::kNone;
    if (filter == "OCTAHEDRAL") return MeshoptFilter::kOctahedral;
    if (filter == "QUATERNION") return MeshoptFilter::kQuaternion;
    if (filter == "EXPONENTIAL") return MeshoptFilter::kExponential;
    extension.fail(fmt::format("filter '{}' is none of NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL", filter));
}

/// Index modes store 16 or 32 bits; the attribute codec works on groups of four bytes, and filters on
/// elements of their own size.
void check_stride(const MeshoptLayout& layout, const JsonElement& extension) {
    const std::size_t stride = layout.stride;
    if (layout.mode != MeshoptMode::kAttributes) {
        if (stride != 2 && stride != 4) {
            extension.fail(fmt::format("byteStride is {}; indices have 2 or 4", stride));
        }
        if (layout.filter != MeshoptFilter::kNone) extension.fail("only mode ATTRIBUTES may have a filter");
        return;
    }
    if (stride == 0 || stride > 256 || stride % 4 != 0) {
        extension.fail(fmt::format("byteStride is {}; it must be a multiple of 4 from 4 to 256", stride));
    }
    if (layout.filter == MeshoptFilter::kOctahedral && stride != 4 && stride != 8) {
        extension.fail(fmt::format("byteStride is {}; filter OCTAHEDRAL needs 4 or 8", stride));
    }
    if (layout.filter == MeshoptFilter::kQuaternion && stride != 8) {
        extension.fail(fmt::format("byteStride is {}; filter QUATERNION needs 8", stride));
    }
}

/// meshoptimizer's result: 0, or why not.
int decode(const MeshoptLayout& layout, std::span<const std::uint8_t> compressed, std::uint8_t* destination) {
    switch (layout.mode) {
        case MeshoptMode::kTriangles:
            return meshopt_decodeIndexBuffer(destination, layout.count, layout.stride, compressed.data(),
                                             compressed.size());
        case MeshoptMode::kIndices:
            return meshopt_decodeIndexSequence(destination, layout.count, layout.stride, compressed.data(),
                                               compressed.size());
        case MeshoptMode::kAttributes:
            break;
    }
    return meshopt_decodeVertexBuffer(destination, layout.count, layout.stride, compressed.data(),
                                      compressed.size());
}

void undo_filter(const MeshoptLayout& layout, std::uint8_t* data) {
    switch (layout.filter) {
        case MeshoptFilter::kNone:
            break;
        case MeshoptFilter::kOctahedral:
            meshopt_decodeFilterOct(data, layout.count, layout.stride);
            break;
        case MeshoptFilter::kQuaternion:
            meshopt_decodeFilterQuat(data, layout.count, layout.stride);
            break;
        case MeshoptFilter::kExponential:
            meshopt_decodeFilterExp(data, layout.count, layout.stride);
            break;
    }
}

}  // namespace

MeshoptLayout read_meshopt_layout(const JsonElement& view, const JsonElement& extension) {
    MeshoptLayout layout;
    layout.mode = read_mode(extension);
    layout.filter = read_filter(extension);
    layout.count = extension.require("count").unsigned_integer();
    layout.stride = extension.require("byteStride").unsigned_integer();
    check_stride(layout, extension);
    if (layout.count == 0) extension.fail("count must be at least 1");
    if (layout.mode == MeshoptMode::kTriangles && layout.count % 3 != 0) {
        extension.fail(fmt::format("count is {}; mode TRIANGLES needs a multiple of 3", layout.count));
    }
    const std::uint64_t view_stride = view.unsigned_or("byteStride", layout.stride);
    if (view_stride != layout.stride) {
        extension.fail(fmt::format("byteStride is {}, but that of {} is {}; they must be equal",
                                   layout.stride, view.path(), view_stride));
    }
    const std::uint64_t length = view.require("byteLength").unsigned_integer();
    // A quotient, since the product may overflow.
    if (length % layout.stride != 0 || length / layout.stride != layout.count) {
        extension.fail(fmt::format("{} elements of {} bytes are not the {} bytes of {}", layout.count,
                                   layout.stride, length, view.path()));
    }
    return layout;
}

std::vector<std::uint8_t> decode_meshopt(const MeshoptLayout& layout,
                                         std::span<const std::uint8_t> compressed,
                                         const JsonElement& extension) {
    std::vector<std::uint8_t> decoded(layout.count * layout.stride);
    if (decode(layout, compressed, decoded.data()) != 0) {
        extension.fail(
            fmt::format("its {} bytes are damaged: they do not decode to {} elements of {} bytes in the "
                        "given mode",
                        compressed.size(), layout.count, layout.stride));
    }
    undo_filter(layout, decoded.data());
    return decoded;
}

}  // namespace core
