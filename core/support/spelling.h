// core/support/spelling.h: the name that was meant, for messages about a wrong one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace core {

/// Insertions, deletions, replacements and swaps of neighbours between two words.
int edit_distance(std::string_view a, std::string_view b);

/// The candidate that was most likely meant; empty if none is close.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace core
