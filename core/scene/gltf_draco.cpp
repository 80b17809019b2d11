#include "core/scene/gltf_draco.h"

#include <draco/compression/config/decoder_options.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/decoder_buffer.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "core/scene/gltf_accessors.h"

namespace core {

namespace {

/// What Draco keeps of a face while decoding: two entries a corner in its corner table, marks and lists of
/// the traversals, and the face itself; for each set of seams a corner table of its own.
constexpr std::size_t kBytesPerFace = 96;
constexpr std::size_t kBytesPerFaceAndSeams = 40;
/// Draco keeps a component as a symbol and as an integer beside its value.
constexpr std::size_t kBytesPerSymbol = 8;

/// Stands between Draco's decoders and the claims of the data: both steps are asked before they run.
class Gate {
public:
    Gate(GltfDocument& document, const JsonElement& primitive, const DracoExpectation& expected)
        : document_(document), primitive_(primitive), expected_(expected) {}

    /// Draco is not built to be thrown through, so what is wrong waits until it has returned.
    template <typename Check>
    bool passes(Check&& check) {
        try {
            check();
            return true;
        } catch (...) {
            refusal_ = std::current_exception();
            return false;
        }
    }
    void rethrow() const {
        if (refusal_) std::rethrow_exception(refusal_);
    }

    void check_counts(std::uint32_t faces, std::uint32_t vertices, std::size_t seam_sets) const {
        if (3 * std::uint64_t{faces} > expected_.index_count) {
            primitive_.fail(fmt::format("its Draco data claim {} triangles, but its accessor has {} indices",
                                        faces, expected_.index_count));
        }
        // Each vertex is the corner of some triangle, but where seams run, more of them than before.
        const std::size_t most = std::max(expected_.vertex_count, expected_.index_count);
        if (vertices > most) {
            primitive_.fail(fmt::format("its Draco data claim {} vertices, but its accessors have {}",
                                        vertices, expected_.vertex_count));
        }
        document_.charge_memory(faces, kBytesPerFace + kBytesPerFaceAndSeams * seam_sets, primitive_);
    }

    void check_attributes(const draco::PointCloud& cloud) const {
        check_counts(0, cloud.num_points(), 0);
        for (int i = 0; i < cloud.num_attributes(); ++i) {
            const draco::PointAttribute& attribute = *cloud.attribute(i);
            const auto component_count = static_cast<std::size_t>(attribute.num_components());
            // -1 for unknown types, which Draco then refuses.
            const auto size =
                static_cast<std::size_t>(std::max(draco::DataTypeLength(attribute.data_type()), 0));
            document_.charge_memory(cloud.num_points(), component_count * (size + kBytesPerSymbol),
                                    primitive_);
        }
    }

private:
    GltfDocument& document_;
    const JsonElement& primitive_;
    const DracoExpectation& expected_;
    std::exception_ptr refusal_;
};

/// The counts that Draco's own decoder is about to believe. Google, "Draco Bitstream Specification", version
/// 2.2: the sequential method begins with faces and points, edgebreaker with vertices, faces and the number
/// of attribute sets that have seams.
struct Counts {
    std::uint32_t faces = 0;
    std::uint32_t vertices = 0;
    std::uint8_t seam_sets = 0;
};

std::optional<Counts> peek_counts(draco::DecoderBuffer buffer, draco::MeshEncoderMethod method) {
    Counts counts;
    if (method == draco::MESH_SEQUENTIAL_ENCODING) {
        if (draco::DecodeVarint(&counts.faces, &buffer) && draco::DecodeVarint(&counts.vertices, &buffer)) {
            return counts;
        }
    } else if (draco::DecodeVarint(&counts.vertices, &buffer) &&
               draco::DecodeVarint(&counts.faces, &buffer) && buffer.Decode(&counts.seam_sets)) {
        return counts;
    }
    return std::nullopt;
}

/// One of Draco's decoders, which asks the gate.
template <typename Decoder, draco::MeshEncoderMethod method>
class GuardedDecoder : public Decoder {
public:
    explicit GuardedDecoder(Gate& gate) : gate_(gate) {}

protected:
    bool DecodeConnectivity() override {
        const std::optional<Counts> counts = peek_counts(*this->buffer(), method);
        return counts && gate_.passes([&] {
            gate_.check_counts(counts->faces, counts->vertices, counts->seam_sets);
        }) && Decoder::DecodeConnectivity();
    }

    /// Here all attributes are declared, and none has taken memory.
    bool DecodeAllAttributes() override {
        return gate_.passes([&] { gate_.check_attributes(*this->point_cloud()); }) &&
               Decoder::DecodeAllAttributes();
    }

private:
    Gate& gate_;
};

using EdgebreakerDecoder = GuardedDecoder<draco::MeshEdgebreakerDecoder, draco::MESH_EDGEBREAKER_ENCODING>;
using SequentialDecoder = GuardedDecoder<draco::MeshSequentialDecoder, draco::MESH_SEQUENTIAL_ENCODING>;

draco::DracoHeader read_header(draco::DecoderBuffer buffer, const JsonElement& primitive) {
    draco::DracoHeader header;
    if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok()) {
        primitive.fail("its Draco data do not begin with Draco's header");
    }
    if (header.version_major != 2 || header.version_minor != 2) {
        primitive.fail(fmt::format("its Draco data have version {}.{}; 2.2 is read", header.version_major,
                                   header.version_minor));
    }
    if (header.encoder_type != draco::TRIANGULAR_MESH) primitive.fail("its Draco data hold no triangle mesh");
    return header;
}

template <typename Decoder>
void run(Gate& gate, draco::DecoderBuffer& buffer, draco::Mesh& mesh, const JsonElement& primitive) {
    draco::Status status;
    try {
        Decoder decoder(gate);
        status = decoder.Decode(draco::DecoderOptions(), &buffer, &mesh);
    } catch (const std::exception& error) {
        primitive.fail(fmt::format("its Draco data are damaged ({})", error.what()));
    }
    gate.rethrow();
    if (!status.ok()) {
        primitive.fail(fmt::format("its Draco data are damaged ({})", status.error_msg_string()));
    }
}

std::vector<std::uint32_t> indices_of(const draco::Mesh& mesh, const JsonElement& primitive) {
    std::vector<std::uint32_t> indices;
    indices.reserve(std::size_t{3} * mesh.num_faces());
    for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f) {
        for (const draco::PointIndex& point : mesh.face(f)) {
            if (point.value() >= mesh.num_points()) {
                primitive.fail(fmt::format("its Draco data are damaged (triangle {} has vertex {} of {})",
                                           f.value(), point.value(), mesh.num_points()));
            }
            indices.push_back(point.value());
        }
    }
    return indices;
}

template <typename Component>
bool convert(const draco::PointAttribute& attribute, std::size_t point_count, std::size_t component_count,
             std::uint8_t* bytes) {
    std::vector<Component> element(component_count);
    for (std::size_t i = 0; i < point_count; ++i) {
        const auto point = static_cast<std::uint32_t>(i);
        const draco::AttributeValueIndex value = attribute.mapped_index(draco::PointIndex(point));
        if (value.value() >= attribute.size()) return false;
        if (!attribute.ConvertValue<Component>(value, static_cast<std::int8_t>(component_count),
                                               element.data())) {
            return false;
        }
        std::memcpy(bytes + i * component_count * sizeof(Component), element.data(),
                    component_count * sizeof(Component));
    }
    return true;
}

bool convert(const draco::PointAttribute& attribute, std::size_t point_count, const AccessorLayout& layout,
             std::uint8_t* bytes) {
    const auto component_count = static_cast<std::size_t>(layout.component_count);
    switch (layout.component_type) {
        case ComponentType::kByte:
            return convert<std::int8_t>(attribute, point_count, component_count, bytes);
        case ComponentType::kUnsignedByte:
            return convert<std::uint8_t>(attribute, point_count, component_count, bytes);
        case ComponentType::kShort:
            return convert<std::int16_t>(attribute, point_count, component_count, bytes);
        case ComponentType::kUnsignedShort:
            return convert<std::uint16_t>(attribute, point_count, component_count, bytes);
        case ComponentType::kUnsignedInt:
            return convert<std::uint32_t>(attribute, point_count, component_count, bytes);
        case ComponentType::kFloat:
            break;
    }
    return convert<float>(attribute, point_count, component_count, bytes);
}

/// One attribute in the type of its accessor.
std::vector<std::uint8_t> attribute_bytes(GltfDocument& document, const draco::Mesh& mesh,
                                          std::uint64_t unique_id, const std::string& name,
                                          const AccessorLayout& layout, const JsonElement& primitive) {
    const draco::PointAttribute* attribute =
        unique_id <= std::numeric_limits<std::uint32_t>::max()
            ? mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(unique_id))
            : nullptr;
    if (!attribute) {
        primitive.fail(fmt::format("its Draco data have no attribute {} for {}", unique_id, name));
    }
    if (attribute->num_components() != layout.component_count) {
        primitive.fail(fmt::format("{} has {} components in its Draco data and {} in {}", name,
                                   attribute->num_components(), layout.component_count,
                                   layout.element.path()));
    }
    document.charge_memory(mesh.num_points(), layout.element_size(), primitive);
    std::vector<std::uint8_t> bytes(mesh.num_points() * layout.element_size());
    if (!convert(*attribute, mesh.num_points(), layout, bytes.data())) {
        primitive.fail(fmt::format("values of {} in its Draco data do not fit the type of {}", name,
                                   layout.element.path()));
    }
    return bytes;
}

}  // namespace

DracoSource read_draco_source(const GltfDocument& document, const JsonElement& extension) {
    DracoSource source;
    source.buffer_view = extension.require("bufferView").index(document.count("bufferViews"), "bufferViews");
    const JsonElement attributes = extension.require("attributes");
    for (const std::string& name : attributes.keys()) {
        source.attributes.emplace(name, attributes.require(name.c_str()).unsigned_integer());
    }
    return source;
}

DracoMesh decode_draco(GltfDocument& document, const JsonElement& primitive, const DracoSource& source,
                       const DracoExpectation& expected) {
    const std::span<const std::uint8_t> bytes = document.buffer_view(source.buffer_view).bytes;
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const draco::DracoHeader header = read_header(buffer, primitive);
    Gate gate(document, primitive, expected);
    draco::Mesh mesh;
    if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING) {
        run<EdgebreakerDecoder>(gate, buffer, mesh, primitive);
    } else if (header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING) {
        run<SequentialDecoder>(gate, buffer, mesh, primitive);
    } else {
        primitive.fail(fmt::format("its Draco data use method {}, which is unknown", header.encoder_method));
    }

    DracoMesh result;
    result.indices = indices_of(mesh, primitive);
    result.point_count = mesh.num_points();
    for (const auto& [name, accessor] : expected.accessors) {
        const AccessorLayout layout = read_accessor_layout(document, accessor);
        result.attributes.emplace(
            name, attribute_bytes(document, mesh, source.attributes.at(name), name, layout, primitive));
    }
    return result;
}

}  // namespace core
