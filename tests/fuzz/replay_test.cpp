// tests/fuzz/replay_test.cpp: every input in corpus/ ends in an answer, whether a fuzzer is at hand or not.
#include "tests/fuzz/replay.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <new>
#include <stdexcept>
#include <vector>

#include "tests/support/shared_data.h"

// The targets, under names of their own (see CMakeLists.txt).
extern "C" int fuzz_gltf(const std::uint8_t* data, std::size_t size);
extern "C" int fuzz_image(const std::uint8_t* data, std::size_t size);
extern "C" int fuzz_mesh(const std::uint8_t* data, std::size_t size);
extern "C" int fuzz_vdb(const std::uint8_t* data, std::size_t size);

namespace {

namespace fs = std::filesystem;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
// A sanitizer's shadow and quarantine are not the reader's, and it is ten times slower.
constexpr fuzz::Limits kLimits{
    .processor_seconds = 20, .wall_seconds = 600, .memory_mib = 2048, .limit_allocation = false};
#else
constexpr fuzz::Limits kLimits;
#endif

struct Subject {
    const char* name;
    fuzz::Target target;
};

std::vector<std::uint8_t> bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::vector<fs::path> files_of(const char* name) {
    std::vector<fs::path> files;
    for (const auto& entry :
         fs::directory_iterator(fs::path(FIELDLIGHT_SOURCE_DIR) / "tests/fuzz/corpus" / name)) {
        files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

/// Readings of a seed that must succeed: a seed that is refused tests nothing any more.
int expected_reads(const std::string& file) {
    if (!file.starts_with("seed_")) return 0;
    // Bakes are read as any file, for their key, and as a field; the other .vdb as no field.
    return file.starts_with("seed_bake") ? 3 : 1;
}

class FuzzReplay : public testing::TestWithParam<Subject> {};

TEST_P(FuzzReplay, EveryInputEndsInAnAnswerWithinItsLimits) {
    // The copies write their input to a folder each.
    const tests::TemporaryFolder folder;
    ASSERT_EQ(setenv("TMPDIR", folder.path().c_str(), 1), 0);
    const std::vector<fs::path> files = files_of(GetParam().name);
    ASSERT_FALSE(files.empty());
    for (const fs::path& file : files) {
        const fuzz::Outcome outcome = fuzz::replay(GetParam().target, bytes_of(file), kLimits);
        EXPECT_EQ(outcome.escape, "") << file;
        EXPECT_GE(outcome.accepted_reads, expected_reads(file.filename().string()))
            << file << " is refused; tests/fuzz/make_seeds.py makes seeds that are not";
    }
    unsetenv("TMPDIR");
}

INSTANTIATE_TEST_SUITE_P(Targets, FuzzReplay,
                         testing::Values(Subject{"gltf", fuzz_gltf}, Subject{"image", fuzz_image},
                                         Subject{"mesh", fuzz_mesh}, Subject{"vdb", fuzz_vdb}),
                         [](const auto& subject) { return std::string(subject.param.name); });

int take_too_much(const std::uint8_t*, std::size_t) {
    const std::size_t size = (static_cast<std::size_t>(kLimits.memory_mib) + 64) << 20;
    const std::vector<std::uint8_t> taken(size, 1);
    return static_cast<int>(taken[size / 2]) - 1;
}

TEST(FuzzReplayChecker, SeesEveryWayOut) {
    const auto escape = [](fuzz::Target target, int wall_seconds = 60, int processor_seconds = 1) {
        const fuzz::Limits limits{.processor_seconds = processor_seconds,
                                  .wall_seconds = wall_seconds,
                                  .memory_mib = kLimits.memory_mib,
                                  .limit_allocation = false};
        return fuzz::replay(target, {}, limits).escape;
    };
    const auto contains = [](const std::string& text, const char* part) {
        return text.find(part) != std::string::npos;
    };
    EXPECT_EQ(escape([](const std::uint8_t*, std::size_t) { return 0; }), "");
    EXPECT_TRUE(contains(
        escape([](const std::uint8_t*, std::size_t) -> int { throw std::runtime_error("unforeseen"); }),
        "unforeseen"));
    EXPECT_TRUE(contains(escape([](const std::uint8_t*, std::size_t) -> int { throw std::bad_alloc(); }),
                         "bad_alloc"));
    EXPECT_TRUE(
        contains(escape([](const std::uint8_t*, std::size_t) -> int { throw 7; }), "no std::exception"));
    EXPECT_TRUE(contains(escape([](const std::uint8_t*, std::size_t) -> int { std::abort(); }), "signal 6"));
    EXPECT_TRUE(
        contains(escape([](const std::uint8_t*, std::size_t) -> int { std::_Exit(0); }), "ended the"));
    EXPECT_TRUE(contains(escape([](const std::uint8_t*, std::size_t) -> int {
                             while (true) getpid();
                         }),
                         "processor time"));
    EXPECT_TRUE(contains(escape(
                             [](const std::uint8_t*, std::size_t) -> int {
                                 while (true) pause();
                             },
                             1),
                         "waited for ever"));
    // To touch gigabytes takes seconds where every store is checked.
    EXPECT_TRUE(contains(escape(take_too_much, 60, 30), "of memory"));
    if (kLimits.limit_allocation) {
        EXPECT_TRUE(contains(fuzz::replay(take_too_much, {}, kLimits).escape, "bad_alloc"));
    }
}

}  // namespace
