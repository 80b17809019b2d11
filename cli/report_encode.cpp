#include "cli/report_encode.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <new>

namespace cli {

std::string base64(std::string_view bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[group >> (18 - 6 * k) & 63u] : '=';
    }
    return text;
}

std::string deflated(std::string_view bytes) {
    uLongf size = compressBound(static_cast<uLong>(bytes.size()));
    std::string result(size, '\0');
    const int status = compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                                 reinterpret_cast<const Bytef*>(bytes.data()),
                                 static_cast<uLong>(bytes.size()), Z_BEST_COMPRESSION);
    // The buffer is large enough by construction, so that memory is all that can be lacking.
    if (status != Z_OK) throw std::bad_alloc();
    result.resize(size);
    return result;
}

std::string encode_colors(std::span<const glm::vec3> colors) {
    std::string runs(12 * colors.size(), '\0');
    std::size_t at = 0;
    for (int channel = 0; channel < 3; ++channel) {
        for (int byte = 0; byte < 4; ++byte) {
            for (const glm::vec3& color : colors) {
                const auto bits = std::bit_cast<std::uint32_t>(color[channel]);
                runs[at++] = static_cast<char>(bits >> (8 * byte) & 0xFFu);
            }
        }
    }
    return base64(deflated(runs));
}

std::string encode_map(std::span<const float> values, float scale) {
    assert(scale > 0.0f);
    constexpr float kSteps = 65534.0f;
    std::string runs(2 * values.size(), '\0');
    for (std::size_t i = 0; i < values.size(); ++i) {
        const float step = std::round(std::clamp(values[i] / scale, 0.0f, 1.0f) * kSteps);
        const unsigned code = std::isfinite(values[i]) ? static_cast<unsigned>(step) : 65535u;
        runs[i] = static_cast<char>(code & 0xFFu);
        runs[values.size() + i] = static_cast<char>(code >> 8);
    }
    return base64(deflated(runs));
}

}  // namespace cli
