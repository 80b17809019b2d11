// What a kept result cost, read back for that result alone.
#include "cli/recorded_seconds.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/shared_data.h"

namespace {

TEST(RecordedSeconds, AreReadBackForTheSameResultOnly) {
    const tests::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "seconds.json";
    EXPECT_FALSE(cli::recorded_seconds(file, "a")) << "there is no record";
    cli::record_seconds(file, "a", 12.375);
    EXPECT_EQ(cli::recorded_seconds(file, "a"), 12.375);
    EXPECT_FALSE(cli::recorded_seconds(file, "b"));
}

TEST(RecordedSeconds, OfAFileThatSaysSomethingElseAreUnknown) {
    const tests::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "seconds.json";
    for (const std::string& text :
         {std::string("{\"of\":\"a\",\"seconds\": 7"), std::string("{\"of\":\"a\",\"seconds\":\"7\"}"),
          std::string("{\"of\":\"a\",\"seconds\":-7}"), std::string("{\"of\":[],\"seconds\":7}"),
          std::string("[1]"), std::string(), std::string(10'000, ' ')}) {
        std::ofstream(file) << text;
        EXPECT_FALSE(cli::recorded_seconds(file, "a")) << text.substr(0, 40);
    }
    EXPECT_FALSE(cli::recorded_seconds(folder.path(), "a")) << "a folder";
}

}  // namespace
