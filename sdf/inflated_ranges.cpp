#include "sdf/inflated_ranges.h"

#include <fmt/format.h>

#include <charconv>

namespace sdf {

std::string inflated_ranges(const std::vector<std::uint8_t>& inflated) {
    std::string text;
    for (std::size_t begin = 0; begin < inflated.size();) {
        if (!inflated[begin]) {
            ++begin;
            continue;
        }
        std::size_t last = begin;
        while (last + 1 < inflated.size() && inflated[last + 1]) ++last;
        if (!text.empty()) text += ',';
        text += last == begin ? fmt::format("{}", begin) : fmt::format("{}-{}", begin, last);
        begin = last + 1;
    }
    return text;
}

bool parse_inflated_ranges(std::string_view text, std::uint32_t count, std::vector<std::uint8_t>& inflated) {
    inflated.clear();
    if (text.empty()) return true;
    inflated.assign(count, 0);
    const char* cursor = text.data();
    const char* const end = text.data() + text.size();
    std::uint64_t lowest = 0;
    const auto number = [&](std::uint64_t& value) {
        const auto [next, error] = std::from_chars(cursor, end, value);
        cursor = next;
        return error == std::errc() && value < count;
    };
    for (;;) {
        std::uint64_t first = 0;
        if (!number(first) || first < lowest) return false;
        std::uint64_t last = first;
        if (cursor != end && *cursor == '-') {
            ++cursor;
            if (!number(last) || last < first) return false;
        }
        for (std::uint64_t i = first; i <= last; ++i) inflated[i] = 1;
        lowest = last + 1;
        if (cursor == end) return true;
        if (*cursor != ',') return false;
        ++cursor;
    }
}

}  // namespace sdf
