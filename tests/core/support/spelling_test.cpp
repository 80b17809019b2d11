// Which word was meant.
#include "core/support/spelling.h"

#include <gtest/gtest.h>

namespace {

TEST(Spelling, MeasuresEditsWithSwaps) {
    EXPECT_EQ(core::edit_distance("tracer", "tracer"), 0);
    EXPECT_EQ(core::edit_distance("tracer", "trcaer"), 1);
    EXPECT_EQ(core::edit_distance("", "abc"), 3);
}

TEST(Spelling, NamesNothingThatIsFar) {
    EXPECT_EQ(core::nearest("--zzzzzzzz", {"--tracer", "--size"}), "");
    EXPECT_EQ(core::nearest("--sise", {"--tracer", "--size"}), "--size");
}

}  // namespace
