#include "cli/gather_flags.h"

#include <fmt/format.h>

#include <iostream>

#include "core/support/error.h"

namespace cli {

namespace {

void list_settings() {
    for (const auto& setting : gather::describe_settings(gather::Settings{})) {
        std::cout << fmt::format("{} = {}  ({})\n    {}\n", setting.name, setting.value, setting.values,
                                 setting.meaning);
    }
    throw CLI::Success();
}

}  // namespace

void GatherFlags::add_to(CLI::App& verb) {
    own_ = {verb.add_option("--quality", quality_, "Of the gather: a row of settings")
                ->check(CLI::IsMember({"draft", "medium", "high", "ultra"}).description(""))
                ->capture_default_str(),
            verb.add_option("--set", settings_,
                            "Of the gather: NAME=VALUE of one setting, as often as wanted; --help-settings "
                            "lists them")
                ->allow_extra_args(false),
            verb.add_option("--accumulate", frames_,
                            "Of the gather: frames that it averages; by default the quality's, 16 at medium")
                ->check(CLI::Range(1, kMostFrames)),
            verb.add_option("--effects", effects_,
                            "Of the gather: auto (what the scene calls for), all, or names with commas")
                ->capture_default_str()};
    verb.add_option("--bounces", bounces_,
                    "Indirect bounces; 0 is emission and direct light. The gather reaches 0 or 1 (default); "
                    "the path tracer has no limit unless one is given")
        ->check(CLI::Range(0, 1 << 20));
    verb.add_flag_callback("--help-settings", list_settings,
                           "List the settings of the gather with their values at medium quality, and end");
}

std::vector<std::string> GatherFlags::given() const {
    std::vector<std::string> names;
    for (const CLI::Option* option : own_) {
        if (option->count() > 0) names.push_back(option->get_name());
    }
    return names;
}

gather::Settings GatherFlags::settings() const {
    gather::Settings settings = gather::quality_settings(quality_);
    if (frames_) settings.frames = *frames_;
    if (bounces_) settings.bounces = *bounces_;
    const auto fail = [](const std::string& message) {
        throw core::InputError(core::ErrorKind::kUsage, message);
    };
    if (settings.bounces > 1) {
        fail(fmt::format("--bounces {}: the gather reaches 0 or 1; more are of --renderer path",
                         settings.bounces));
    }
    for (const std::string& setting : settings_) {
        const std::size_t equals = setting.find('=');
        if (equals == std::string::npos) {
            fail(
                fmt::format("--set {}: takes NAME=VALUE, such as screen_probes.spatial_filter=off", setting));
        }
        gather::set_setting(settings, setting.substr(0, equals), setting.substr(equals + 1));
    }
    return settings;
}

}  // namespace cli
