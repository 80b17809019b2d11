#include "core/scene/gltf_accessors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <string_view>
#include <utility>

namespace core {

namespace {

/// Elements that an accessor without any data may stand for; others are bounded by their buffers.
constexpr std::uint64_t kMaximumZeroCount = std::uint64_t{1} << 22;

/// 0 for numbers that are no component type.
std::size_t size_of_component(ComponentType type) {
    switch (type) {
        case ComponentType::kByte:
        case ComponentType::kUnsignedByte:
            return 1;
        case ComponentType::kShort:
        case ComponentType::kUnsignedShort:
            return 2;
        case ComponentType::kUnsignedInt:
        case ComponentType::kFloat:
            return 4;
    }
    return 0;
}

int components_of_type(std::string_view type) {
    if (type == "SCALAR") return 1;
    if (type == "VEC2") return 2;
    if (type == "VEC3") return 3;
    if (type == "VEC4" || type == "MAT2") return 4;
    if (type == "MAT3") return 9;
    if (type == "MAT4") return 16;
    return 0;
}

template <typename T>
T load(const std::uint8_t* data) {
    T value;
    std::memcpy(&value, data, sizeof(T));
    return value;
}

template <typename T>
float as_float(const std::uint8_t* data, bool normalized) {
    const float value = static_cast<float>(load<T>(data));
    if (!normalized) return value;
    // Signed integers have one value below -1; the specification clamps it.
    return std::max(value / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
}

float component(const std::uint8_t* data, ComponentType type, bool normalized) {
    switch (type) {
        case ComponentType::kByte:
            return as_float<std::int8_t>(data, normalized);
        case ComponentType::kUnsignedByte:
            return as_float<std::uint8_t>(data, normalized);
        case ComponentType::kShort:
            return as_float<std::int16_t>(data, normalized);
        case ComponentType::kUnsignedShort:
            return as_float<std::uint16_t>(data, normalized);
        case ComponentType::kUnsignedInt:
            return static_cast<float>(load<std::uint32_t>(data));
        case ComponentType::kFloat:
            break;
    }
    return load<float>(data);
}

std::uint32_t unsigned_component(const std::uint8_t* data, ComponentType type) {
    if (type == ComponentType::kUnsignedByte) return *data;
    if (type == ComponentType::kUnsignedShort) return load<std::uint16_t>(data);
    return load<std::uint32_t>(data);
}

/// Checks that `count` elements fit into the bytes and returns the first.
const std::uint8_t* checked_data(std::span<const std::uint8_t> bytes, std::uint64_t offset,
                                 std::uint64_t count, std::size_t stride, std::size_t element_size,
                                 const JsonElement& element) {
    // The last element needs only its own size, not a whole stride.
    const bool fits = offset <= bytes.size() && bytes.size() - offset >= element_size &&
                      count - 1 <= (bytes.size() - offset - element_size) / stride;
    if (!fits) {
        element.fail(
            fmt::format("{} elements of {} bytes, {} apart, from byte {} do not fit its buffer "
                        "view of {} bytes",
                        count, element_size, stride, offset, bytes.size()));
    }
    return bytes.data() + offset;
}

}  // namespace

AccessorLayout read_accessor_layout(const GltfDocument& document, std::size_t index) {
    AccessorLayout layout{document.element("accessors", index)};
    const JsonElement& element = layout.element;
    layout.count = element.require("count").unsigned_integer();
    if (layout.count == 0) element.fail("count must be at least 1");
    const std::uint64_t component_type = element.require("componentType").unsigned_integer();
    layout.component_type = static_cast<ComponentType>(component_type);
    layout.component_size = size_of_component(layout.component_type);
    if (layout.component_size == 0) {
        element.fail(fmt::format("componentType {} is none of 5120 to 5123, 5125, 5126", component_type));
    }
    const std::string type = element.require("type").text();
    layout.component_count = components_of_type(type);
    if (layout.component_count == 0) element.fail(fmt::format("type '{}' is unknown", type));
    layout.normalized = element.boolean_or("normalized", false);
    return layout;
}

GltfAccessor::GltfAccessor(AccessorLayout layout, std::span<const std::uint8_t> decoded)
    : layout_(std::move(layout)), data_(decoded.data()), stride_(layout_.element_size()) {
    layout_.count = decoded.size() / layout_.element_size();
}

GltfAccessor::GltfAccessor(const GltfDocument& document, std::size_t index)
    : layout_(read_accessor_layout(document, index)) {
    const JsonElement& element = layout_.element;
    const std::size_t element_size = layout_.element_size();
    const auto sparse = element.find("sparse");
    if (const auto view_index = element.find("bufferView")) {
        const auto view =
            document.buffer_view(view_index->index(document.count("bufferViews"), "bufferViews"));
        stride_ = view.stride == 0 ? element_size : view.stride;
        if (stride_ < element_size) {
            element.fail(fmt::format("its buffer view's byteStride of {} is less than an element of {} bytes",
                                     stride_, element_size));
        }
        data_ = checked_data(view.bytes, element.unsigned_or("byteOffset", 0), layout_.count, stride_,
                             element_size, element);
    } else if (layout_.count > kMaximumZeroCount) {
        element.fail(fmt::format("has {} elements but no buffer view; at most {} zeros are made",
                                 layout_.count, kMaximumZeroCount));
    }
    if (sparse) read_sparse(document, *sparse);
}

void GltfAccessor::read_sparse(const GltfDocument& document, const JsonElement& sparse) {
    const std::uint64_t count = sparse.require("count").unsigned_integer();
    if (count == 0 || count > layout_.count) {
        sparse.fail(fmt::format("count is {}; it must be from 1 to the accessor's {}", count, layout_.count));
    }
    const JsonElement indices = sparse.require("indices");
    const JsonElement values = sparse.require("values");
    const auto index_type = static_cast<ComponentType>(indices.require("componentType").unsigned_integer());
    if (index_type != ComponentType::kUnsignedByte && index_type != ComponentType::kUnsignedShort &&
        index_type != ComponentType::kUnsignedInt) {
        indices.fail("componentType must be 5121, 5123 or 5125");
    }
    const std::size_t element_size = layout_.element_size();
    const std::size_t view_count = document.count("bufferViews");
    const std::size_t index_size = size_of_component(index_type);
    const auto index_view =
        document.buffer_view(indices.require("bufferView").index(view_count, "bufferViews"));
    const auto value_view =
        document.buffer_view(values.require("bufferView").index(view_count, "bufferViews"));
    const std::uint8_t* index_data = checked_data(index_view.bytes, indices.unsigned_or("byteOffset", 0),
                                                  count, index_size, index_size, indices);
    const std::uint8_t* value_data = checked_data(value_view.bytes, values.unsigned_or("byteOffset", 0),
                                                  count, element_size, element_size, values);
    sparse_.reserve(static_cast<std::size_t>(count));
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint32_t index = unsigned_component(index_data + i * index_size, index_type);
        if (index >= layout_.count) {
            indices.fail(
                fmt::format("index {} is {}, but the accessor has {} elements", i, index, layout_.count));
        }
        if (!sparse_.empty() && index <= sparse_.back().index) {
            indices.fail(fmt::format("index {} is {}; indices must increase", i, index));
        }
        sparse_.push_back({index, value_data + i * element_size});
    }
}

bool GltfAccessor::is_float() const {
    return layout_.component_type == ComponentType::kFloat;
}

bool GltfAccessor::is_unsigned_scalar() const {
    return layout_.component_count == 1 && !layout_.normalized &&
           (layout_.component_type == ComponentType::kUnsignedByte ||
            layout_.component_type == ComponentType::kUnsignedShort ||
            layout_.component_type == ComponentType::kUnsignedInt);
}

const std::uint8_t* GltfAccessor::find(std::size_t index) const {
    if (!sparse_.empty()) {
        const auto found =
            std::lower_bound(sparse_.begin(), sparse_.end(), index,
                             [](const Substitution& entry, std::size_t key) { return entry.index < key; });
        if (found != sparse_.end() && found->index == index) return found->data;
    }
    return data_ ? data_ + index * stride_ : nullptr;
}

glm::vec4 GltfAccessor::read(std::size_t index) const {
    glm::vec4 result(0.0f);
    const std::uint8_t* data = find(index);
    if (!data) return result;
    const int count = std::min(layout_.component_count, 4);
    for (int i = 0; i < count; ++i) {
        result[i] = component(data + static_cast<std::size_t>(i) * layout_.component_size,
                              layout_.component_type, layout_.normalized);
    }
    return result;
}

std::uint32_t GltfAccessor::read_unsigned(std::size_t index) const {
    const std::uint8_t* data = find(index);
    return data ? unsigned_component(data, layout_.component_type) : 0;
}

}  // namespace core
