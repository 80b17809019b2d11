// core/scene/gltf_accessors.h: typed reading of glTF accessors.
//
// glTF 2.0 Specification, section 3.6.2: any component type, normalised or not, interleaved, sparse, or
// without a buffer view (zeros).
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "core/scene/gltf_document.h"

namespace core {

/// glTF's component types, with its own codes.
enum class ComponentType : std::uint64_t {
    kByte = 5120,
    kUnsignedByte = 5121,
    kShort = 5122,
    kUnsignedShort = 5123,
    kUnsignedInt = 5125,
    kFloat = 5126,
};

/// What an accessor says of its elements, without looking at any data.
struct AccessorLayout {
    JsonElement element;
    std::uint64_t count = 0;  ///< At least 1; not yet compared with anything.
    ComponentType component_type = ComponentType::kFloat;
    std::size_t component_size = 0;  ///< Bytes.
    int component_count = 0;
    bool normalized = false;

    std::size_t element_size() const { return component_size * static_cast<std::size_t>(component_count); }
};

/// @param index below count("accessors"). @throws InputError
AccessorLayout read_accessor_layout(const GltfDocument& document, std::size_t index);

/// A checked accessor: every element from 0 to count - 1 lies within its buffer.
class GltfAccessor {
public:
    /// @param index below count("accessors"). @throws InputError if it does not fit its buffer views.
    GltfAccessor(const GltfDocument& document, std::size_t index);

    /// Reads data that were decoded elsewhere, tightly packed, whatever buffer view and count the file gives.
    /// `decoded` must outlive it. @pre decoded.size() is a multiple of the layout's element_size().
    GltfAccessor(AccessorLayout layout, std::span<const std::uint8_t> decoded);

    const JsonElement& element() const { return layout_.element; }
    std::size_t count() const { return static_cast<std::size_t>(layout_.count); }
    int component_count() const { return layout_.component_count; }

    /// Whether components are floats, or integers with the normalised flag.
    bool is_float() const;
    bool is_normalized() const { return layout_.normalized; }

    /// An element as floats; integers are scaled if normalised. Missing components are 0, sparse
    /// substitutions are applied. @pre index < count()
    glm::vec4 read(std::size_t index) const;

    /// The first component as it stands. @pre index < count(), an unsigned integer type
    std::uint32_t read_unsigned(std::size_t index) const;
    bool is_unsigned_scalar() const;

private:
    struct Substitution {
        std::uint64_t index;
        const std::uint8_t* data;
    };
    void read_sparse(const GltfDocument& document, const JsonElement& sparse);
    const std::uint8_t* find(std::size_t index) const;

    AccessorLayout layout_;
    const std::uint8_t* data_ = nullptr;  ///< Null: zeros.
    std::size_t stride_ = 0;
    std::vector<Substitution> sparse_;  ///< Ascending index.
};

}  // namespace core
