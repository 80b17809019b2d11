#include "core/image/png.h"

#include <fmt/format.h>
#include <stb/stb_image_write.h>

#include <cassert>
#include <cstdint>
#include <limits>
#include <new>
#include <string>

#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "core/support/memory.h"

namespace core {

namespace {

void append(void* context, void* data, int size) {
    static_cast<std::string*>(context)->append(static_cast<const char*>(data),
                                               static_cast<std::size_t>(size));
}

/// stb counts bytes in int, one filter byte a row included.
bool is_encodable(int height, std::span<const std::uint8_t> rgb) {
    return rgb.size() + static_cast<std::size_t>(height) <=
           static_cast<std::size_t>(std::numeric_limits<int>::max());
}

}  // namespace

std::string encode_png(int width, int height, std::span<const std::uint8_t> rgb) {
    assert(width > 0 && height > 0);
    assert(rgb.size() == std::size_t{3} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    assert(is_encodable(height, rgb));
    // stb ends the program where its buffers cannot grow: the filtered rows, the deflated ones, which double
    // as they grow, its hash table, and the file twice.
    constexpr std::uint64_t kHashTableBytes = 8 << 20;
    require_memory(4 * rgb.size() + kHashTableBytes, fmt::format("a PNG of {} x {} pixels", width, height));
    std::string encoded;
    if (stbi_write_png_to_func(append, &encoded, width, height, 3, rgb.data(), 3 * width) == 0)
        throw std::bad_alloc();
    return encoded;
}

void write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgb) {
    if (!is_encodable(height, rgb)) {
        throw InputError(ErrorKind::kUsage,
                         fmt::format("'{}': {} x {} pixels are too many for a PNG; less than 2^31 "
                                     "bytes can be written",
                                     path.string(), width, height));
    }
    write_text_atomically(path, encode_png(width, height, rgb));
}

}  // namespace core
