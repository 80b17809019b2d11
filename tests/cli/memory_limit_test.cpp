// tests/cli/memory_limit_test.cpp: --max-memory and the limits of a shell: a clear end, never an abort.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cli/options.h"
#include "core/image/exr.h"
#include "tests/support/program_faults.h"
#include "tests/support/program_run.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;
using tests::ProgramRun;
using tests::run_program;

constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20;

std::string cornell() {
    return (tests::assets_folder() / "cornell_box.glb").string();
}

TEST(MemorySize, ReadsBytesAndPowersOf1024) {
    EXPECT_EQ(cli::parse_memory_size("1000000000"), 1'000'000'000u);
    EXPECT_EQ(cli::parse_memory_size("512M"), 512 * kMebibyte);
    EXPECT_EQ(cli::parse_memory_size("4g"), 4096 * kMebibyte);
    EXPECT_EQ(cli::parse_memory_size("1K"), 1024u);
    EXPECT_EQ(cli::parse_memory_size("16T"), std::uint64_t{1} << 44);
    for (const char* wrong : {"", "0", "M", "-1", "1.5G", "4GB", "4 G", "5X", "18446744073709551615T"}) {
        EXPECT_FALSE(cli::parse_memory_size(wrong)) << wrong;
    }
}

TEST(MemoryLimit, IsAFlagOfEveryVerb) {
    for (const char* verb : {"bake", "render", "compare", "convert", "inspect"}) {
        const ProgramRun run = run_program({verb, "a", "--max-memory", "much"});
        EXPECT_EQ(run.exit_code, 64) << verb;
        EXPECT_NE(run.err.find("such as 512M, 4G"), std::string::npos) << run.err;
    }
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

TEST(MemoryLimit, IsRefusedWhereASanitizerCannotKeepIt) {
    EXPECT_EQ(run_program({"inspect", cornell(), "--max-memory", "1G"}).exit_code, 64);
}

#else

TEST(MemoryLimit, SweepsEndClearlyForEveryVerbThatWrites) {
    const tests::TemporaryFolder folder;
    const fs::path picture = folder.path() / "a" / "picture.exr",
                   preview = folder.path() / "b" / "preview.png";
    for (const fs::path& path : {picture, preview}) fs::create_directory(path.parent_path());
    // A picture large enough that a preview of it does not fit where it fits itself.
    constexpr std::uint64_t kStep = 12 * kMebibyte;
    tests::sweep_memory({"render", cornell(), "-o", picture.string(), "--size", "500x400", "--accumulate",
                         "1", "--resolution", "24", "--tracer", "triangle"},
                        picture, kStep);
    tests::sweep_memory({"convert", picture.string(), preview.string()}, preview, kStep);
}

TEST(MemoryLimit, ABakeThatDoesNotFitFailsByItsMeshsName) {
    const tests::TemporaryFolder folder;
    const ProgramRun run = run_program({"bake", cornell(), "-o", folder.path().string(), "--resolution",
                                        "1024", "--max-memory", "100M", "--quiet", "--threads", "2"});
    EXPECT_EQ(run.exit_code, 71) << run.err;
    EXPECT_NE(run.err.find("'cornell_box.glb': mesh '"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("a field of 1024 voxels along its longest side: needs about"), std::string::npos)
        << run.err;
}

TEST(MemoryLimit, WhatIsTooLargeIsNamedBeforeItIsBegun) {
    const tests::TemporaryFolder folder;
    const std::string output = (folder.path() / "x.exr").string();
    const ProgramRun huge =
        run_program({"render", cornell(), "-o", output, "--size", "32768x32768", "--aov", "Depth,Normal"});
    EXPECT_EQ(huge.exit_code, 71) << huge.err;
    EXPECT_NE(huge.err.find("a picture of 32768 x 32768 pixels with 2 layers: needs about"),
              std::string::npos)
        << huge.err;
    EXPECT_LT(huge.cpu_seconds, 1.0) << "nothing was loaded for it";

    core::Image image(3000, 1500);
    for (const char* channel : {"R", "G", "B"}) image.add_channel(channel, 1.0f);
    core::write_exr(output, image);
    const ProgramRun read = run_program({"inspect", output, "--max-memory", "70M", "--threads", "1"});
    EXPECT_EQ(read.exit_code, 71) << read.err;
    EXPECT_NE(read.err.find("3000 x 1500 pixels of 3 channels: needs about 52 MiB"), std::string::npos)
        << read.err;
}

TEST(MemoryLimit, ThreadsThatDoNotFitAreRefusedInsteadOfAborting) {
    const ProgramRun run =
        run_program({"inspect", cornell(), "--threads", "64", "--max-memory", "200M", "--quiet"});
    EXPECT_EQ(run.exit_code, 71);
    EXPECT_NE(run.err.find("64 threads (--threads): needs about 576 MiB"), std::string::npos) << run.err;
}

TEST(MemoryLimit, LimitsOfTheShellEndClearlyToo) {
    const tests::TemporaryFolder folder;
    for (std::uint64_t limit = 50; limit < 120; limit += 15) {
        const fs::path bakes = folder.path() / std::to_string(limit);
        const std::vector<std::string> arguments = {
            "bake", cornell(), "-o", bakes.string(), "--resolution", "64", "--quiet", "--threads", "2"};
        tests::expect_clear_end(run_program(arguments, {.data_bytes = limit * kMebibyte}),
                                "data " + std::to_string(limit));
        // The loader and libraries take some 150 MiB of address space before main can answer for anything.
        tests::expect_clear_end(run_program(arguments, {.address_space_bytes = (limit + 120) * kMebibyte}),
                                "address space " + std::to_string(limit + 120));
    }
}

#endif

}  // namespace
