// sdf/feature_ranges.h: which triangles are sheets or thin walls, as text for metadata: "0-11,40,52-60".
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sdf/sampled_field.h"

namespace sdf {

/// Ranges of triangles that are `feature`, ascending; empty where none is.
std::string feature_ranges(const std::vector<Feature>& features, Feature feature);

/// Sets the triangles of a text to `feature`, making `features` as long as `count` if there is one. False if
/// the text is malformed, not ascending, or names triangles from `count` up.
bool parse_feature_ranges(std::string_view text, Feature feature, std::uint32_t count,
                          std::vector<Feature>& features);

}  // namespace sdf
