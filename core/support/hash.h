// core/support/hash.h: content hashes for caches and metadata: XXH3, 128 bits.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace core {

/// Accumulates bytes into a 128-bit hash. Not cryptographic.
class Hasher {
public:
    Hasher();
    ~Hasher();
    Hasher(const Hasher&) = delete;
    Hasher& operator=(const Hasher&) = delete;

    void add_bytes(const void* data, std::size_t size);

    /// Adds the object representation of a value without padding.
    template <typename T>
    void add(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        add_bytes(&value, sizeof(T));
    }

    /// Adds the length and the elements.
    template <typename T>
    void add_range(std::span<const T> values) {
        static_assert(std::is_trivially_copyable_v<T>);
        add(values.size());
        add_bytes(values.data(), values.size_bytes());
    }
    void add_text(std::string_view text) { add_range(std::span<const char>(text.data(), text.size())); }

    /// 32 hex digits of all that was added so far.
    std::string hex() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace core
