// Every knob is listed, read and written, and refuses what it cannot be.
#include "gather/settings.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "core/support/error.h"

namespace {

TEST(GatherSettings, EveryKnobTakesItsOwnValueBack) {
    for (const char* quality : {"draft", "medium", "high", "ultra"}) {
        gather::Settings settings = gather::quality_settings(quality);
        for (const gather::SettingDescription& knob : gather::describe_settings(settings)) {
            gather::set_setting(settings, knob.name, knob.value);
            EXPECT_FALSE(knob.meaning.empty()) << knob.name;
        }
        const auto before = gather::describe_settings(gather::quality_settings(quality));
        const auto after = gather::describe_settings(settings);
        for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i].value, before[i].value);
    }
}

/// A legal value that `knob` does not have: of words another, of a range one end or the other.
std::string another_value(const gather::SettingDescription& knob) {
    const std::size_t dots = knob.values.find(" ... ");
    if (dots != std::string::npos) {
        const std::string least = knob.values.substr(0, dots);
        return least == knob.value ? knob.values.substr(dots + 5) : least;
    }
    std::istringstream words(knob.values);
    for (std::string word; std::getline(words, word, '|');) {
        if (word != knob.value) return word;
    }
    return {};
}

TEST(GatherSettings, EachKnobSetsItselfAndNoOther) {
    const auto before = gather::describe_settings(gather::Settings{});
    for (std::size_t k = 0; k < before.size(); ++k) {
        SCOPED_TRACE(before[k].name);
        gather::Settings settings;
        gather::set_setting(settings, before[k].name, another_value(before[k]));
        const auto now = gather::describe_settings(settings);
        for (std::size_t i = 0; i < now.size(); ++i) EXPECT_EQ(now[i].value != before[i].value, i == k);
    }
}

TEST(GatherSettings, NamesTheNearestKnobAndWhatAValueMayBe) {
    gather::Settings settings;
    const auto message = [&](const char* name, const char* value) {
        try {
            gather::set_setting(settings, name, value);
        } catch (const core::InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_NE(message("screen_probes.spatial_filtr", "on").find("screen_probes.spatial_filter"),
              std::string::npos);
    EXPECT_NE(message("screen_probes.spacing", "12").find("1|2|4|8|16|32"), std::string::npos);
    EXPECT_NE(message("screen_probes.cull_threshold", "nan").find("0 ... 1"), std::string::npos);
    EXPECT_NE(message("screen_probes.cull_threshold", "0.1x").find("0 ... 1"), std::string::npos);
    EXPECT_NE(message("screen_probes.adaptive", "yes").find("on|off"), std::string::npos);
}

TEST(GatherSettings, RefusesAnUnknownQuality) {
    EXPECT_THROW(gather::quality_settings("best"), core::InputError);
}

}  // namespace
