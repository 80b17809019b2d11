#include "core/scene/gltf_accessors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <string_view>

namespace core {

namespace {

constexpr std::uint64_t kByte = 5120;
constexpr std::uint64_t kUnsignedByte = 5121;
constexpr std::uint64_t kShort = 5122;
constexpr std::uint64_t kUnsignedShort = 5123;
constexpr std::uint64_t kUnsignedInt = 5125;
constexpr std::uint64_t kFloat = 5126;

/// Elements that an accessor without any data may stand for; others are bounded by their buffers.
constexpr std::uint64_t kMaximumZeroCount = std::uint64_t{1} << 22;

std::size_t size_of_component(std::uint64_t type) {
    switch (type) {
        case kByte:
        case kUnsignedByte:
            return 1;
        case kShort:
        case kUnsignedShort:
            return 2;
        case kUnsignedInt:
        case kFloat:
            return 4;
        default:
            return 0;
    }
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

float component(const std::uint8_t* data, std::uint64_t type, bool normalized) {
    switch (type) {
        case kByte:
            return as_float<std::int8_t>(data, normalized);
        case kUnsignedByte:
            return as_float<std::uint8_t>(data, normalized);
        case kShort:
            return as_float<std::int16_t>(data, normalized);
        case kUnsignedShort:
            return as_float<std::uint16_t>(data, normalized);
        case kUnsignedInt:
            return static_cast<float>(load<std::uint32_t>(data));
        default:
            return load<float>(data);
    }
}

std::uint32_t unsigned_component(const std::uint8_t* data, std::uint64_t type) {
    if (type == kUnsignedByte) return *data;
    if (type == kUnsignedShort) return load<std::uint16_t>(data);
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

GltfAccessor::GltfAccessor(const GltfDocument& document, std::size_t index)
    : element_(document.element("accessors", index)) {
    const std::uint64_t count = element_.require("count").unsigned_integer();
    if (count == 0) element_.fail("count must be at least 1");
    component_type_ = element_.require("componentType").unsigned_integer();
    component_size_ = size_of_component(component_type_);
    if (component_size_ == 0) {
        element_.fail(fmt::format("componentType {} is none of 5120 to 5123, 5125, 5126", component_type_));
    }
    const std::string type = element_.require("type").text();
    component_count_ = components_of_type(type);
    if (component_count_ == 0) element_.fail(fmt::format("type '{}' is unknown", type));
    normalized_ = element_.boolean_or("normalized", false);
    element_size_ = component_size_ * static_cast<std::size_t>(component_count_);

    const auto sparse = element_.find("sparse");
    if (const auto view_index = element_.find("bufferView")) {
        const auto view =
            document.buffer_view(view_index->index(document.count("bufferViews"), "bufferViews"));
        stride_ = view.stride == 0 ? element_size_ : view.stride;
        if (stride_ < element_size_) {
            element_.fail(
                fmt::format("its buffer view's byteStride of {} is less than an element of {} bytes", stride_,
                            element_size_));
        }
        data_ = checked_data(view.bytes, element_.unsigned_or("byteOffset", 0), count, stride_, element_size_,
                             element_);
    } else if (count > kMaximumZeroCount) {
        element_.fail(fmt::format("has {} elements but no buffer view; at most {} zeros are made", count,
                                  kMaximumZeroCount));
    }
    count_ = static_cast<std::size_t>(count);
    if (sparse) read_sparse(document, *sparse);
}

void GltfAccessor::read_sparse(const GltfDocument& document, const JsonElement& sparse) {
    const std::uint64_t count = sparse.require("count").unsigned_integer();
    if (count == 0 || count > count_) {
        sparse.fail(fmt::format("count is {}; it must be from 1 to the accessor's {}", count, count_));
    }
    const JsonElement indices = sparse.require("indices");
    const JsonElement values = sparse.require("values");
    const std::uint64_t index_type = indices.require("componentType").unsigned_integer();
    if (index_type != kUnsignedByte && index_type != kUnsignedShort && index_type != kUnsignedInt) {
        indices.fail("componentType must be 5121, 5123 or 5125");
    }
    const std::size_t view_count = document.count("bufferViews");
    const std::size_t index_size = size_of_component(index_type);
    const auto index_view =
        document.buffer_view(indices.require("bufferView").index(view_count, "bufferViews"));
    const auto value_view =
        document.buffer_view(values.require("bufferView").index(view_count, "bufferViews"));
    const std::uint8_t* index_data = checked_data(index_view.bytes, indices.unsigned_or("byteOffset", 0),
                                                  count, index_size, index_size, indices);
    const std::uint8_t* value_data = checked_data(value_view.bytes, values.unsigned_or("byteOffset", 0),
                                                  count, element_size_, element_size_, values);
    sparse_.reserve(static_cast<std::size_t>(count));
    for (std::uint64_t i = 0; i < count; ++i) {
        const std::uint32_t index = unsigned_component(index_data + i * index_size, index_type);
        if (index >= count_) {
            indices.fail(fmt::format("index {} is {}, but the accessor has {} elements", i, index, count_));
        }
        if (!sparse_.empty() && index <= sparse_.back().index) {
            indices.fail(fmt::format("index {} is {}; indices must increase", i, index));
        }
        sparse_.push_back({index, value_data + i * element_size_});
    }
}

bool GltfAccessor::is_float() const {
    return component_type_ == kFloat;
}

bool GltfAccessor::is_unsigned_scalar() const {
    return component_count_ == 1 && !normalized_ &&
           (component_type_ == kUnsignedByte || component_type_ == kUnsignedShort ||
            component_type_ == kUnsignedInt);
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
    const int count = std::min(component_count_, 4);
    for (int i = 0; i < count; ++i) {
        result[i] =
            component(data + static_cast<std::size_t>(i) * component_size_, component_type_, normalized_);
    }
    return result;
}

std::uint32_t GltfAccessor::read_unsigned(std::size_t index) const {
    const std::uint8_t* data = find(index);
    return data ? unsigned_component(data, component_type_) : 0;
}

}  // namespace core
