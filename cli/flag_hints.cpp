#include "cli/flag_hints.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/support/spelling.h"

namespace cli {

namespace {

/// Flags of the written interface whose part of the program is still to come.
struct LaterFlag {
    const char* name;
    const char* part;
};
constexpr std::array kLaterFlags = {
    LaterFlag{"--frames", "animation"},
    LaterFlag{"--fps", "animation"},
};

std::vector<std::string> verb_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
        names.push_back(verb->get_name());
    }
    return names;
}

std::vector<std::string> flag_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    return names;
}

}  // namespace

std::string explain_parse_error(const CLI::App& app, const CLI::ParseError& error,
                                const std::vector<std::string>& arguments) {
    const std::vector<std::string> verbs = verb_names(app);
    const auto verb_name = std::find_if(arguments.begin(), arguments.end(), [&](const std::string& argument) {
        return std::find(verbs.begin(), verbs.end(), argument) != verbs.end();
    });
    if (verb_name == arguments.end()) {
        if (arguments.empty()) return "no verb; try: fieldlight --help";
        const std::string hint = core::nearest(arguments.front(), verbs);
        return fmt::format("'{}' is not a verb{}; try: fieldlight --help", arguments.front(),
                           hint.empty() ? "" : ", did you mean '" + hint + "'?");
    }
    const CLI::App& verb = *app.get_subcommand(*verb_name);
    for (const std::string& argument : arguments) {
        if (argument.rfind("--", 0) != 0) continue;
        const std::string flag = argument.substr(0, argument.find('='));
        const std::vector<std::string> flags = flag_names(verb);
        if (std::find(flags.begin(), flags.end(), flag) != flags.end()) continue;
        for (const LaterFlag& later : kLaterFlags) {
            if (flag == later.name) {
                return fmt::format("{} {}: comes with {}, which is not built yet", verb.get_name(), flag,
                                   later.part);
            }
        }
        const std::string hint = core::nearest(flag, flags);
        return fmt::format("{} has no flag {}{}; try: fieldlight {} --help", verb.get_name(), flag,
                           hint.empty() ? "" : ", did you mean " + hint + "?", verb.get_name());
    }
    return fmt::format("{}: {}; try: fieldlight {} --help", verb.get_name(), error.what(), verb.get_name());
}

}  // namespace cli
