// What a plan is asked for, and what it refuses.
#include "gather/plan.h"

#include <gtest/gtest.h>

#include "core/support/error.h"

namespace {

TEST(GatherPlan, EffectsTakeWholeNamesAlone) {
    EXPECT_EQ(gather::parse_effects("sky,sun").list.size(), 2u);
    for (const char* wrong : {"", "sky,", ",sky", "skies"}) {
        EXPECT_THROW(gather::parse_effects(wrong), core::InputError) << wrong;
    }
}

TEST(GatherPlan, ASingleTileIsNeverFilteredWhateverIsAskedFor) {
    const gather::Settings settings;
    const gather::Plan plan = gather::make_plan({}, 16, 16, settings, gather::parse_effects("all"));
    EXPECT_FALSE(plan.on(gather::Effect::kSpatialFilter));
    EXPECT_TRUE(plan.on(gather::Effect::kScreenProbes));
}

}  // namespace
