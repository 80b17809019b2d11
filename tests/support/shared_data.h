// tests/support/shared_data.h: where tests find the real scenes, and how they say that they are missing.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <optional>

namespace tests {

/// The folder with `scenes/`: $FIELDLIGHT_SHARED, or ../shared beside the source tree. Nothing where neither
/// exists. A FIELDLIGHT_SHARED that is set but wrong fails the test instead of skipping it.
std::optional<std::filesystem::path> shared_folder();

/// The repository's own assets/ folder.
std::filesystem::path assets_folder();

/// A fresh folder for one test, removed with everything in it when the object dies.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
};

}  // namespace tests

/// Declares `name` as the path of a shared file or folder, or skips the test with the one message that
/// `./check` accepts. Every test that uses shared data goes through it, so that they can be counted.
#define FIELDLIGHT_NEED_SHARED(name, relative)                               \
    if (!tests::shared_folder()) GTEST_SKIP() << "needs FIELDLIGHT_SHARED";  \
    ::testing::Test::RecordProperty("uses_shared", 1);                       \
    const std::filesystem::path name = *tests::shared_folder() / (relative); \
    ASSERT_TRUE(std::filesystem::exists(name)) << name << " is missing from the shared folder"
