// cli/flag_hints.h: what to say to somebody who mistyped a flag.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace cli {

/// One line that names what was wrong on the command line and the nearest thing that would be right.
std::string explain_parse_error(const CLI::App& app, const CLI::ParseError& error,
                                const std::vector<std::string>& arguments);

}  // namespace cli
