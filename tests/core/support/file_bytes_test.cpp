// tests/core/support/file_bytes_test.cpp: only regular files of bounded size come into memory.
#include "core/support/file_bytes.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <string>
#include <string_view>

#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace {

core::ErrorKind kind_of_reading(const std::filesystem::path& path, std::uint64_t limit) {
    try {
        core::read_file_bytes(path, limit);
    } catch (const core::InputError& error) {
        EXPECT_NE(std::string_view(error.what()).find(path.string()), std::string_view::npos);
        return error.kind();
    }
    ADD_FAILURE() << path << " was read";
    return core::ErrorKind::kUsage;
}

TEST(FileBytes, ReturnsEveryByte) {
    const tests::TemporaryFolder folder;
    core::write_text_atomically(folder.path() / "file", std::string_view("a\0\xff", 3));
    EXPECT_EQ(core::read_file_bytes(folder.path() / "file", 3), (std::vector<std::uint8_t>{'a', 0, 255}));
    core::write_text_atomically(folder.path() / "empty", "");
    EXPECT_TRUE(core::read_file_bytes(folder.path() / "empty", 0).empty());
}

TEST(FileBytes, RefusesWhatIsMissingTooLargeOrNotAFile) {
    const tests::TemporaryFolder folder;
    core::write_text_atomically(folder.path() / "file", "four");
    ASSERT_EQ(mkfifo((folder.path() / "pipe").c_str(), 0600), 0);
    EXPECT_EQ(kind_of_reading(folder.path() / "missing", 9), core::ErrorKind::kNoInput);
    EXPECT_EQ(kind_of_reading(folder.path(), 9), core::ErrorKind::kNoInput);
    EXPECT_EQ(kind_of_reading(folder.path() / "pipe", 9), core::ErrorKind::kNoInput);
    EXPECT_EQ(kind_of_reading("/dev/zero", 9), core::ErrorKind::kNoInput);
    EXPECT_EQ(kind_of_reading(folder.path() / "file", 3), core::ErrorKind::kBadData);
}

}  // namespace
