// tests/cli/faults_test.cpp: whatever goes wrong while a verb writes its files, each is the old one or the
// new one.
#include <fcntl.h>
#include <fnmatch.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <set>

#include "tests/support/folder_events.h"
#include "tests/support/program_faults.h"
#include "tests/support/writing_verbs.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

constexpr int kCannotCreate = 73, kInputOutput = 74;

/// A test for each verb that writes files.
class FileFaults : public testing::TestWithParam<WritingVerb> {
protected:
    const WritingVerb& verb() const { return GetParam(); }

    /// Expects that a run failed with this code, and said so by the name of what it could not write.
    void expect_failed(const ProgramRun& run, int code, const std::string& named) const {
        EXPECT_EQ(run.signal, 0);
        EXPECT_EQ(run.exit_code, code) << run.err;
        EXPECT_NE(run.err.find("fieldlight: '" + named), std::string::npos) << run.err;
    }

    /// The file that a message is about, which must be the old one.
    void expect_named_file_is_old(const Workplace& place, const ProgramRun& run) const {
        const FolderContent content = place.content();
        for (const std::string& file : place.files()) {
            if (run.err.find("fieldlight: '" + file + "'") == std::string::npos) continue;
            EXPECT_TRUE(content.at(file) == kOldContent) << run.err;
            return;
        }
        ADD_FAILURE() << "names none of the files: " << run.err;
    }

    std::string text_of(const fs::path& file) const {
        std::ifstream stream(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), {}};
    }
};

/// A disk of a few pages over a folder. Only this process and its children see it, and it ends with them.
class SmallDisk {
public:
    SmallDisk(const fs::path& folder, std::uint64_t bytes) : folder_(folder) {
        static const bool is_apart =
            unshare(CLONE_NEWNS) == 0 && mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
        const std::string size = "size=" + std::to_string(bytes);
        is_mounted_ = is_apart && mount("tmpfs", folder_.c_str(), "tmpfs", 0, size.c_str()) == 0;
    }
    ~SmallDisk() {
        if (is_mounted_) umount2(folder_.c_str(), MNT_DETACH);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;

    /// False where this machine lets nobody mount, as most containers do.
    bool is_mounted() const { return is_mounted_; }

private:
    const fs::path folder_;
    bool is_mounted_ = false;
};

/// Takes the right to write away from a folder, for its time.
class ReadOnlyFolder {
public:
    explicit ReadOnlyFolder(const fs::path& folder) : folder_(folder) {
        fs::permissions(folder_, fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write,
                        fs::perm_options::remove);
    }
    ~ReadOnlyFolder() { fs::permissions(folder_, fs::perms::owner_write, fs::perm_options::add); }
    ReadOnlyFolder(const ReadOnlyFolder&) = delete;
    ReadOnlyFolder& operator=(const ReadOnlyFolder&) = delete;

private:
    const fs::path folder_;
};

TEST_P(FileFaults, WritesTheFilesOfTheTableAndNoOther) {
    const Workplace place(verb());
    ASSERT_EQ(place.files().size(), verb().files.size()) << testing::PrintToString(place.files());
    for (std::size_t i = 0; i < verb().files.size(); ++i) {
        EXPECT_EQ(fnmatch(verb().files[i].c_str(), place.files()[i].c_str(), 0), 0) << place.files()[i];
        EXPECT_FALSE(is_whole(place.path(place.files()[i]))) << "an old file passes for a new one";
    }
    EXPECT_EQ(place.run().exit_code, verb().exit_code);
    for (const std::string& file : place.files()) EXPECT_TRUE(is_whole(place.path(file))) << file;
}

TEST_P(FileFaults, EveryFileComesByRenamingATemporaryOne) {
    const Workplace place(verb());
    FolderEvents events(place.path("out"));
    ASSERT_EQ(place.run().exit_code, verb().exit_code);
    std::multiset<std::string> renamed;
    while (true) {
        const std::vector<FolderEvent> found = events.wait(std::chrono::milliseconds(0));
        if (found.empty()) break;
        for (const FolderEvent& event : found) {
            if (is_temporary(event.file)) continue;
            EXPECT_EQ(event.kind, FolderEvent::Kind::kRenamedTo) << event.file;
            renamed.insert(event.file.lexically_relative(place.path("")).string());
        }
    }
    EXPECT_EQ(renamed, std::multiset<std::string>(place.files().begin(), place.files().end()));
}

TEST_P(FileFaults, FilesThatMayNotGrowLeaveTheOldOnes) {
    const Workplace place(verb());
    // The last byte of what is the same in each run; texts tell times and vary by some bytes.
    std::set<std::uint64_t> limits = {0};
    for (std::size_t i = 0; i < place.files().size(); ++i) {
        const fs::path ending = fs::path(place.files()[i]).extension();
        const bool varies = ending == ".json" || ending == ".csv" || ending == ".html";
        limits.insert(varies ? place.sizes()[i] * 9 / 10 : place.sizes()[i] - 1);
    }
    for (const std::uint64_t limit : limits) {
        SCOPED_TRACE("limit " + std::to_string(limit));
        place.restore();
        const ProgramRun run = place.run({.file_bytes = limit});
        expect_failed(run, kInputOutput, "out/");
        expect_old_or_whole(place);
        expect_named_file_is_old(place, run);
    }
}

TEST_P(FileFaults, AFullDiskLeavesTheOldFiles) {
    constexpr std::uint64_t kPage = 4096;
    const Workplace place(verb());
    std::uint64_t needed = 0;
    for (const std::uint64_t size : place.sizes()) needed += (size + kPage - 1) / kPage;
    for (const std::uint64_t free : std::set<std::uint64_t>{0, needed / 2}) {
        SCOPED_TRACE(std::to_string(free) + " free pages of " + std::to_string(needed));
        const SmallDisk disk(place.path("out"), (place.files().size() + free) * kPage);
        if (!disk.is_mounted()) {
            std::puts("No disk can be mounted here; the limit on files has to stand for a full one.");
            return;
        }
        place.restore();
        const ProgramRun run = place.run();
        expect_failed(run, kInputOutput, "out/");
        expect_old_or_whole(place);
        expect_named_file_is_old(place, run);
    }
}

TEST_P(FileFaults, AReadOnlyFolderKeepsItsFiles) {
    const Workplace place(verb());
    for (const std::string& folder : place.folders()) {
        SCOPED_TRACE(folder);
        place.restore();
        const ReadOnlyFolder read_only(place.path(folder));
        const ProgramRun run = place.run({.obeys_permissions = true});
        expect_failed(run, kCannotCreate, folder);
        expect_old_or_whole(place);
        for (const auto& [file, content] : place.content()) {
            const bool is_protected = fs::path(file).parent_path() == folder;
            EXPECT_TRUE(!is_protected || content == kOldContent) << file;
        }
    }
}

TEST_P(FileFaults, AMissingFolderIsMadeOrNamed) {
    const Workplace place(verb());
    fs::remove_all(place.path("out"));
    const ProgramRun run = place.run();
    if (verb().makes_folder) {
        EXPECT_EQ(run.exit_code, verb().exit_code) << run.err;
        for (const std::string& file : place.files()) EXPECT_TRUE(is_whole(place.path(file))) << file;
    } else {
        expect_failed(run, kCannotCreate, "out/");
        EXPECT_FALSE(fs::exists(place.path("out"))) << "a failed run leaves nothing";
    }
}

TEST_P(FileFaults, AFileInTheFoldersPlaceIsKept) {
    const Workplace place(verb());
    fs::remove_all(place.path("out"));
    std::ofstream(place.path("out")) << "in the way";
    expect_failed(place.run(), kCannotCreate, "out");
    EXPECT_EQ(text_of(place.path("out")), "in the way");
}

TEST_P(FileFaults, AFolderInAFilesPlaceIsKept) {
    const Workplace place(verb());
    for (const std::string& file : place.files()) {
        SCOPED_TRACE(file);
        place.restore();
        fs::remove(place.path(file));
        fs::create_directory(place.path(file));
        expect_failed(place.run(), kCannotCreate, file + "'");
        EXPECT_TRUE(fs::is_directory(place.path(file)));
        expect_old_or_whole(place);
    }
}

TEST_P(FileFaults, KilledAtRandomPointsEachFileIsOldOrNew) {
    // tests/full goes on with as many as the design asks for.
    const KillCounts counts = kill_at_random_points(verb(), 4);
    EXPECT_GT(counts.killed, 0);
}

INSTANTIATE_TEST_SUITE_P(Verbs, FileFaults, testing::ValuesIn(writing_verbs()),
                         [](const auto& verb) { return verb.param.name; });

}  // namespace
}  // namespace tests
