// tests/core/support/memory_test.cpp: limits hold, and what cannot fit is named before it is taken.
#include "core/support/memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "core/support/error.h"
#include "tests/support/program_run.h"

namespace {

constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20;

core::InputError error_of(const std::function<void()>& work) {
    try {
        work();
    } catch (const core::InputError& error) {
        return error;
    }
    return {core::ErrorKind::kUsage, "no error"};
}

bool can_allocate(std::uint64_t bytes) {
    try {
        return std::make_unique<std::vector<char>>(bytes) != nullptr;
    } catch (const std::bad_alloc&) {
        return false;
    }
}

TEST(Memory, RequiringMoreThanTheMachineHasNamesWhatAndHowMuch) {
    const core::InputError error =
        error_of([] { core::require_memory(std::uint64_t{1} << 60, "'x.exr': a picture of two worlds"); });
    EXPECT_EQ(error.kind(), core::ErrorKind::kOutOfMemory);
    const std::string message = error.what();
    EXPECT_NE(message.find("'x.exr': a picture of two worlds: needs about 1099511627776 MiB"),
              std::string::npos)
        << message;
    EXPECT_NO_THROW(core::require_memory(1, "a byte"));
}

TEST(Memory, ALimitThatCannotBeKeptIsRefused) {
    const core::ErrorKind expected =
        tests::kSanitized ? core::ErrorKind::kUsage : core::ErrorKind::kOutOfMemory;
    EXPECT_EQ(error_of([] { core::limit_memory(4096); }).kind(), expected);
    EXPECT_TRUE(can_allocate(64 * kMebibyte)) << "nothing was limited";
}

// Sanitizers reserve terabytes in advance.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

/// Runs `check` in a child, whose limits die with it. True if it ran and returned true.
bool holds_in_child(const std::function<bool()>& check) {
    const pid_t child = fork();
    if (child == 0) _exit(check() ? 0 : 1);
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(Memory, PastTheLimitAllocationsFailAndLiftingOpensIt) {
    EXPECT_TRUE(holds_in_child([] {
        core::limit_memory(160 * kMebibyte);
        const bool fits = can_allocate(32 * kMebibyte), too_much = can_allocate(160 * kMebibyte);
        core::lift_memory_limit();
        return fits && !too_much && can_allocate(160 * kMebibyte);
    }));
}

TEST(Memory, WhatIsLeftShrinksWithWhatIsTaken) {
    EXPECT_TRUE(holds_in_child([] {
        core::limit_memory(512 * kMebibyte);
        const std::uint64_t before = core::memory_left();
        const std::vector<char> taken(100 * kMebibyte);
        const std::uint64_t after = core::memory_left();
        // Within a page or two of the heap's own bookkeeping.
        return core::memory_is_limited() && before < 512 * kMebibyte && before - after >= 100 * kMebibyte &&
               before - after < 101 * kMebibyte;
    }));
}

TEST(Memory, LimitsOfTheShellCountToo) {
    for (const auto resource : {RLIMIT_DATA, RLIMIT_AS}) {
        EXPECT_TRUE(holds_in_child([resource] {
            const rlim_t bytes = 600 * kMebibyte;
            const rlimit limit{bytes, bytes};
            setrlimit(resource, &limit);
            return core::memory_is_limited() && core::memory_left() < bytes &&
                   error_of([] { core::require_memory(600 * kMebibyte, "it"); }).kind() ==
                       core::ErrorKind::kOutOfMemory;
        }));
    }
}

#endif

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

TEST(AlignedMemory, EndsInBadAllocOnlyWhereItIsChecked) {
    // As a C library calls it, whose code does not know that it should throw nothing.
    int (*volatile take)(void**, std::size_t, std::size_t) = posix_memalign;
    constexpr std::size_t kTooMuch = std::size_t{1} << 60;
    void* memory = nullptr;
    EXPECT_EQ(take(&memory, 64, kTooMuch), ENOMEM);
    EXPECT_EQ(take(&memory, 3, 8), EINVAL);
    {
        const core::ScopedCheckedAlignedMemory checked;
        EXPECT_THROW(take(&memory, 64, kTooMuch), std::bad_alloc);
        ASSERT_EQ(take(&memory, 64, 100), 0);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(memory) % 64, 0u);
        std::free(memory);
    }
    EXPECT_EQ(take(&memory, 64, kTooMuch), ENOMEM);
}

#endif

}  // namespace
