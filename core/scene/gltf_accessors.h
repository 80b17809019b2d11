// core/scene/gltf_accessors.h: typed reading of glTF accessors.
//
// glTF 2.0 Specification, section 3.6.2: any component type, normalised or not, interleaved, sparse, or
// without a buffer view (zeros).
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "core/scene/gltf_document.h"

namespace core {

/// A checked accessor: every element from 0 to count - 1 lies within its buffer.
class GltfAccessor {
public:
    /// @param index below count("accessors"). @throws InputError if it does not fit its buffer views.
    GltfAccessor(const GltfDocument& document, std::size_t index);

    const JsonElement& element() const { return element_; }
    std::size_t count() const { return count_; }
    int component_count() const { return component_count_; }
    bool has_data() const { return data_ != nullptr || !sparse_.empty(); }

    /// Whether components are floats, or integers with the normalised flag.
    bool is_float() const;
    bool is_normalized() const { return normalized_; }

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

    JsonElement element_;
    std::size_t count_ = 0;
    std::uint64_t component_type_ = 0;
    std::size_t component_size_ = 0;
    int component_count_ = 0;
    std::size_t element_size_ = 0;
    bool normalized_ = false;
    const std::uint8_t* data_ = nullptr;  ///< Null: zeros.
    std::size_t stride_ = 0;
    std::vector<Substitution> sparse_;  ///< Ascending index.
};

}  // namespace core
