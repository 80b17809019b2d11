// tests/core/support/atomic_file_test.cpp: a destination is the old file or the new one, whatever goes wrong.
#include "core/support/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>

#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::size_t entry_count(const fs::path& folder) {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

/// The error that `work` ends in; a work that ends well fails the test.
core::InputError error_of(const std::function<void()>& work) {
    try {
        work();
    } catch (const core::InputError& error) {
        return error;
    }
    ADD_FAILURE() << "no error";
    return {core::ErrorKind::kUsage, ""};
}

void expect_refused(const fs::path& path, core::ErrorKind kind) {
    const core::InputError error = error_of([&] { core::write_text_atomically(path, "new"); });
    EXPECT_EQ(error.kind(), kind) << error.what();
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
}

TEST(AtomicFile, WritesAndReplacesText) {
    const tests::TemporaryFolder folder;
    const fs::path path = folder.path() / "file.txt";
    core::write_text_atomically(path, "old");
    EXPECT_EQ(content_of(path), "old");
    const std::string binary("a\0b", 3);
    core::write_text_atomically(path, binary);
    EXPECT_EQ(content_of(path), binary);
    EXPECT_EQ(entry_count(folder.path()), 1u);
}

TEST(AtomicFile, GivesTheWriterAPathWithTheSameExtensionInTheSameFolder) {
    const tests::TemporaryFolder folder;
    core::write_file_atomically(folder.path() / "grid.vdb", [&](const fs::path& temporary) {
        EXPECT_EQ(temporary.parent_path(), folder.path());
        EXPECT_EQ(temporary.extension(), ".vdb");
        std::ofstream(temporary) << "grid";
    });
    EXPECT_EQ(content_of(folder.path() / "grid.vdb"), "grid");
}

TEST(AtomicFile, HonoursTheUmask) {
    const tests::TemporaryFolder folder;
    const mode_t previous = umask(027);
    core::write_text_atomically(folder.path() / "file", "text");
    umask(previous);
    struct stat status {};
    ASSERT_EQ(stat((folder.path() / "file").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0640u);
}

TEST(AtomicFile, LeavesTheOldFileWhenTheWriterThrows) {
    const tests::TemporaryFolder folder;
    const fs::path path = folder.path() / "file";
    core::write_text_atomically(path, "old");
    EXPECT_THROW(core::write_file_atomically(path,
                                             [](const fs::path& temporary) {
                                                 std::ofstream(temporary) << "half";
                                                 throw std::logic_error("stop");
                                             }),
                 std::logic_error);
    EXPECT_EQ(content_of(path), "old");
    EXPECT_EQ(entry_count(folder.path()), 1u);
}

TEST(AtomicFile, WritesThroughALinkAndKeepsIt) {
    const tests::TemporaryFolder folder;
    core::write_text_atomically(folder.path() / "real", "old");
    fs::create_symlink("real", folder.path() / "link");
    core::write_text_atomically(folder.path() / "link", "new");
    EXPECT_TRUE(fs::is_symlink(folder.path() / "link"));
    EXPECT_EQ(content_of(folder.path() / "real"), "new");
}

TEST(AtomicFile, RefusesWhatIsNotAFile) {
    const tests::TemporaryFolder folder;
    fs::create_directory(folder.path() / "folder");
    fs::create_symlink("nowhere", folder.path() / "dangling");
    core::write_text_atomically(folder.path() / "file", "old");
    expect_refused(folder.path() / "folder", core::ErrorKind::kCannotCreate);
    expect_refused(folder.path() / "folder/", core::ErrorKind::kCannotCreate);
    expect_refused(folder.path() / "dangling", core::ErrorKind::kCannotCreate);
    expect_refused(folder.path() / "missing" / "file", core::ErrorKind::kCannotCreate);
    expect_refused(folder.path() / "file" / "file", core::ErrorKind::kCannotCreate);
    expect_refused("/dev/full", core::ErrorKind::kCannotCreate);
    EXPECT_TRUE(fs::is_character_file("/dev/full"));
    // A folder that refuses new files even to root.
    expect_refused("/proc/fieldlight.exr", core::ErrorKind::kCannotCreate);
}

/// Forks, runs `work` in the child and returns its exit status, or kills it after `kill_after`.
int run_in_child(const std::function<int()>& work, std::chrono::microseconds kill_after = {}) {
    const pid_t child = fork();
    if (child == 0) _exit(work());
    if (kill_after.count() > 0) {
        std::this_thread::sleep_for(kill_after);
        kill(child, SIGKILL);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return status;
}

TEST(AtomicFile, ReportsADiskThatIsFullAndLeavesTheOldFile) {
    const tests::TemporaryFolder folder;
    const fs::path path = folder.path() / "file";
    core::write_text_atomically(path, "old");
    const int status = run_in_child([&] {
        // A limit on the size of files fails writes as a full disk does, midway.
        std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{4096, 4096};
        setrlimit(RLIMIT_FSIZE, &limit);
        try {
            core::write_text_atomically(path, std::string(100'000, 'x'));
        } catch (const core::InputError& error) {
            return static_cast<int>(error.kind());
        }
        return 0;
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), static_cast<int>(core::ErrorKind::kInputOutput));
    EXPECT_EQ(content_of(path), "old");
    EXPECT_EQ(entry_count(folder.path()), 1u);
}

TEST(AtomicFile, KilledAtRandomPointsTheFileIsAlwaysWhole) {
    const tests::TemporaryFolder folder;
    const fs::path path = folder.path() / "file";
    const std::string contents[2] = {std::string(200'000, 'a'), std::string(150'000, 'b')};
    core::write_text_atomically(path, contents[0]);
    std::mt19937 random(7);
    std::uniform_int_distribution<int> microseconds(1, 6000);
    for (int attempt = 0; attempt < 60; ++attempt) {
        run_in_child(
            [&] {
                for (int i = 0;; ++i) core::write_text_atomically(path, contents[i % 2]);
                return 0;
            },
            std::chrono::microseconds(microseconds(random)));
        const std::string found = content_of(path);
        ASSERT_TRUE(found == contents[0] || found == contents[1]) << "attempt " << attempt;
    }
}

TEST(AtomicFile, RemovesWhatIsUnfinishedWhereTheProgramMustEnd) {
    const tests::TemporaryFolder folder;
    const fs::path path = folder.path() / "file";
    core::write_text_atomically(path, "old");
    const int status = run_in_child([&] {
        core::write_file_atomically(path, [](const fs::path& temporary) {
            std::ofstream(temporary) << "half";
            core::remove_temporary_files();
            _exit(3);
        });
        return 0;
    });
    EXPECT_EQ(WEXITSTATUS(status), 3);
    EXPECT_EQ(content_of(path), "old");
    EXPECT_EQ(entry_count(folder.path()), 1u);
}

TEST(AtomicFile, TellsEarlyWhetherThereIsAPlace) {
    const tests::TemporaryFolder folder;
    const fs::path path = folder.path() / "file";
    core::require_place_for_file(path);
    EXPECT_EQ(entry_count(folder.path()), 0u);
    core::write_text_atomically(path, "old");
    core::require_place_for_file(path);
    EXPECT_EQ(content_of(path), "old");
    const core::InputError error =
        error_of([&] { core::require_place_for_file(folder.path() / "missing" / "file"); });
    EXPECT_EQ(error.kind(), core::ErrorKind::kCannotCreate);
}

}  // namespace
