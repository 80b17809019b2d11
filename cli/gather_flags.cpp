#include "cli/gather_flags.h"

#include <fmt/format.h>

#include <array>
#include <iostream>
#include <vector>

#include "core/support/error.h"

namespace cli {

namespace {

constexpr std::array kQualities = {"draft", "medium", "high", "ultra"};

/// Each with its value at `quality`, and what the others set it to where they differ.
void list_settings(const std::string& quality) {
    std::array<std::vector<gather::SettingDescription>, kQualities.size()> rows;
    std::string frames;
    for (std::size_t q = 0; q < kQualities.size(); ++q) {
        const gather::Settings settings = gather::quality_settings(kQualities[q]);
        rows[q] = gather::describe_settings(settings);
        frames += fmt::format("{}{} {}", q == 0 ? "" : ", ", kQualities[q], settings.frames);
    }
    std::cout << fmt::format("--accumulate = {}  (1 ... {})\n    frames that are averaged\n    {}\n",
                             gather::quality_settings(quality).frames, kMostFrames, frames);
    const auto settings = gather::describe_settings(gather::quality_settings(quality));
    for (std::size_t i = 0; i < settings.size(); ++i) {
        std::string values;
        bool differ = false;
        for (std::size_t q = 0; q < kQualities.size(); ++q) {
            differ = differ || rows[q][i].value != rows[0][i].value;
            values += fmt::format("{}{} {}", q == 0 ? "" : ", ", kQualities[q], rows[q][i].value);
        }
        std::cout << fmt::format("{} = {}  ({})\n    {}\n", settings[i].name, settings[i].value,
                                 settings[i].values, settings[i].meaning);
        if (differ) std::cout << "    " << values << "\n";
    }
    throw CLI::Success();
}

std::string effect_names() {
    std::string names;
    for (std::size_t i = 0; i < gather::kEffectCount; ++i) {
        names += (names.empty() ? "" : ",") + std::string(gather::name_of(static_cast<gather::Effect>(i)));
    }
    return names;
}

}  // namespace

void GatherFlags::add_settings_to(CLI::App& verb) {
    own_ = {
        verb.add_option("--quality", quality_, "Of the gather: a row of settings")
            ->check(
                CLI::IsMember(std::vector<std::string>(kQualities.begin(), kQualities.end())).description(""))
            ->capture_default_str(),
        verb.add_option("--set", settings_,
                        "Of the gather: NAME=VALUE of one setting, as often as wanted; --help-settings "
                        "lists them")
            ->allow_extra_args(false)};
    verb.add_option("--bounces", bounces_,
                    "Indirect bounces; 0 is emission and direct light. The gather reaches 0 or 1 (default); "
                    "the path tracer has no limit unless one is given")
        ->check(CLI::Range(0, 1 << 20));
    // After --quality, which it follows.
    verb.add_flag_callback(
        "--help-settings", [this] { list_settings(quality_); },
        "List the settings of the gather with their values at --quality, where the others differ, and end");
}

void GatherFlags::add_to(CLI::App& verb) {
    add_settings_to(verb);
    own_.push_back(
        verb.add_option("--accumulate", frames_,
                        "Of the gather: frames that it averages; by default the quality's, 16 at medium")
            ->check(CLI::Range(1, kMostFrames)));
    own_.push_back(verb.add_option("--effects", effects_,
                                   "Of the gather: auto (what the scene calls for), all, or names with "
                                   "commas, and then what they leave out of light and alpha is not there: " +
                                       effect_names())
                       ->capture_default_str());
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
