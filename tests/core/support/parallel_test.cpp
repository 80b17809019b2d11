// tests/core/support/parallel_test.cpp: every index once, limits honoured, exceptions brought home.
#include "core/support/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace {

TEST(ParallelFor, VisitsEveryIndexOnceInRangesNoLongerThanTheGrain) {
    for (const int threads : {1, 2, 3, 8}) {
        std::vector<std::atomic<int>> visits(10'007);
        std::atomic<bool> too_long{false};
        core::with_thread_limit(threads, [&] {
            core::parallel_for(visits.size(), 64, [&](std::size_t begin, std::size_t end) {
                if (end - begin > 64) too_long = true;
                for (std::size_t i = begin; i < end; ++i) ++visits[i];
            });
        });
        EXPECT_FALSE(too_long);
        for (const std::atomic<int>& count : visits) ASSERT_EQ(count, 1);
    }
}

TEST(ParallelFor, CallsNothingForNothing) {
    core::parallel_for(0, 1, [](std::size_t, std::size_t) { ADD_FAILURE() << "called"; });
}

TEST(ParallelFor, RethrowsWhatABodyThrows) {
    EXPECT_THROW(core::parallel_for(100, 1,
                                    [](std::size_t begin, std::size_t) {
                                        if (begin == 50) throw std::domain_error("fifty");
                                    }),
                 std::domain_error);
}

TEST(ThreadLimit, IsWhatWasAskedForAndEndsWithItsScope) {
    const int outside = core::thread_limit();
    for (const int threads : {1, 3, 8}) {
        core::with_thread_limit(threads, [&] { EXPECT_EQ(core::thread_limit(), threads); });
    }
    EXPECT_EQ(core::thread_limit(), outside);
}

TEST(ThreadLimit, OfOneKeepsAllWorkOnTheCallingThread) {
    std::set<std::thread::id> seen;
    core::with_thread_limit(1, [&] {
        core::parallel_for(1000, 1,
                           [&](std::size_t, std::size_t) { seen.insert(std::this_thread::get_id()); });
    });
    EXPECT_EQ(seen.size(), 1u);
}

TEST(FlushDenormals, HoldsWhileItLivesAndRestoresAfterwards) {
    const auto halve_the_smallest_normal = [] {
        volatile float value = std::numeric_limits<float>::min();
        value = value * 0.5f;
        return value;
    };
    EXPECT_GT(halve_the_smallest_normal(), 0.0f);
    {
        const core::ScopedFlushDenormals flush;
        EXPECT_EQ(halve_the_smallest_normal(), 0.0f);
    }
    EXPECT_GT(halve_the_smallest_normal(), 0.0f);
}

}  // namespace
