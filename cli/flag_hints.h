// cli/flag_hints.h: what to say to somebody who mistyped a flag.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

/// Edits (insert, delete, replace, swap neighbours) that turn one word into the other.
int edit_distance(std::string_view a, std::string_view b);

/// The candidate closest to `word`, or "" where none is close enough to be what was meant.
std::string nearest(std::string_view word, const std::vector<std::string>& candidates);

/// One line that names what was wrong on the command line and the nearest thing that would be right.
std::string explain_parse_error(const CLI::App& app, const CLI::ParseError& error,
                                const std::vector<std::string>& arguments);

}  // namespace cli
