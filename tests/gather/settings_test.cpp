// Every knob is listed, read and written, and refuses what it cannot be.
#include "gather/settings.h"

#include <gtest/gtest.h>

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

TEST(GatherSettings, SetsOneKnobAndNoOther) {
    gather::Settings settings;
    gather::set_setting(settings, "screen_probes.spatial_filter", "off");
    EXPECT_FALSE(settings.screen_probes.spatial_filter);
    int changed = 0;
    const auto now = gather::describe_settings(settings);
    const auto before = gather::describe_settings(gather::Settings{});
    for (std::size_t i = 0; i < now.size(); ++i) changed += now[i].value != before[i].value ? 1 : 0;
    EXPECT_EQ(changed, 1);
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
