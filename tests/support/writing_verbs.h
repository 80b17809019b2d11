// tests/support/writing_verbs.h: every command that writes files, with each of its files, and a folder in
// which one of them runs while earlier files stand in the place of its outputs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/support/program_run.h"
#include "tests/support/shared_data.h"

namespace tests {

/// A command that writes files. It runs in a Workplace, where all its outputs lie in the folder `out`.
struct WritingVerb {
    std::string name;
    std::vector<std::string> arguments;
    /// All that it writes, as in "out/picture.exr"; a `*` in the last part stands for a name that is a hash.
    std::vector<std::string> files;
    bool makes_folder = false;  ///< Whether it makes `out` where that is missing.
    int exit_code = 0;          ///< Of a run in which nothing goes wrong.
};

/// Every verb that writes, with every flag that names a file to write.
const std::vector<WritingVerb>& writing_verbs();

/// Names a test after its verb.
void PrintTo(const WritingVerb& verb, std::ostream* stream);

/// Files below a folder and their content, by the path from the folder's parent, such as "out/a.png".
using FolderContent = std::map<std::string, std::string>;
FolderContent content_below(const std::filesystem::path& folder);

/// What a verb runs in: its inputs, which are small, and `out` with something old under each name that it
/// will write.
class Workplace {
public:
    explicit Workplace(const WritingVerb& verb);

    /// Runs the verb with its stdout thrown away: that is no file of its own.
    ProgramRun run(RunConditions conditions = {}) const;

    std::filesystem::path path(const std::string& file) const { return folder_.path() / file; }

    /// The names of the files that the verb writes, as they are found, `*` resolved.
    const std::vector<std::string>& files() const { return files_; }

    /// Their sizes after a run in which nothing goes wrong.
    const std::vector<std::uint64_t>& sizes() const { return sizes_; }

    /// The folders that they lie in.
    std::vector<std::string> folders() const;

    /// Puts an old file under each name again.
    void put_old_files() const;

    /// The same, and removes everything else from `out`.
    void restore() const;

    /// What lies in `out`, temporary files included.
    FolderContent content() const { return content_below(path("out")); }

private:
    TemporaryFolder folder_;
    const WritingVerb& verb_;
    std::vector<std::string> files_;
    std::vector<std::uint64_t> sizes_;
};

/// What the old files hold, which no reader would take for a new one.
inline constexpr const char* kOldContent = "an old file\n";

/// Whether the program's temporary files have such a name.
bool is_temporary(const std::filesystem::path& file);

/// Whether a file is complete, by reading all of it as what its ending says.
bool is_whole(const std::filesystem::path& file);

/// Expects that each file of `out` is the old one or a whole new one, and that there is no other; files under
/// the names of temporary ones are none of the program's outputs and only `may_leave_temporary` permits them.
void expect_old_or_whole(const Workplace& place, bool may_leave_temporary = false);

}  // namespace tests
