#include "sdf/feature_ranges.h"

#include <fmt/format.h>

#include <charconv>

namespace sdf {

std::string feature_ranges(const std::vector<Feature>& features, Feature feature) {
    std::string text;
    for (std::size_t begin = 0; begin < features.size();) {
        if (features[begin] != feature) {
            ++begin;
            continue;
        }
        std::size_t last = begin;
        while (last + 1 < features.size() && features[last + 1] == feature) ++last;
        if (!text.empty()) text += ',';
        text += last == begin ? fmt::format("{}", begin) : fmt::format("{}-{}", begin, last);
        begin = last + 1;
    }
    return text;
}

bool parse_feature_ranges(std::string_view text, Feature feature, std::uint32_t count,
                          std::vector<Feature>& features) {
    if (text.empty()) return true;
    features.resize(count, Feature::kSurface);
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
        for (std::uint64_t i = first; i <= last; ++i) features[i] = feature;
        lowest = last + 1;
        if (cursor == end) return true;
        if (*cursor != ',') return false;
        ++cursor;
    }
}

}  // namespace sdf
