// sdf/inflated_ranges.h: which triangles carry the half-thickness, as text for metadata: "0-11,40,52-60".
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace sdf {

/// Ranges of set entries, ascending; empty where none is.
std::string inflated_ranges(const std::vector<std::uint8_t>& inflated);

/// The inverse; an empty text gives an empty vector. False if the text is malformed, not ascending, or names
/// triangles from `count` up.
bool parse_inflated_ranges(std::string_view text, std::uint32_t count, std::vector<std::uint8_t>& inflated);

}  // namespace sdf
