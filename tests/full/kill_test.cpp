// tests/full/kill_test.cpp: no verb leaves half a file, whenever it is killed; as often as the design asks
// for.
#include <gtest/gtest.h>

#include "tests/support/program_faults.h"
#include "tests/support/writing_verbs.h"

namespace tests {
namespace {

class KilledAtRandomPoints : public testing::TestWithParam<WritingVerb> {};

TEST_P(KilledAtRandomPoints, EachFileIsOldOrNew) {
    const KillCounts counts = kill_at_random_points(GetParam(), 200);
    RecordProperty("killed", counts.killed);
    RecordProperty("killed_in_writing", counts.in_writing);
    EXPECT_GE(counts.killed, 100) << "too few to show anything";
    EXPECT_GT(counts.in_writing, 0) << "none of the kills came while a file was written";
}

INSTANTIATE_TEST_SUITE_P(Verbs, KilledAtRandomPoints, testing::ValuesIn(writing_verbs()),
                         [](const auto& verb) { return verb.param.name; });

}  // namespace
}  // namespace tests
