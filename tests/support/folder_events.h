// tests/support/folder_events.h: what happens to the files of a folder while the program runs (inotify).
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tests {

/// One thing that happened to one file.
struct FolderEvent {
    enum class Kind {
        kCreated,   ///< It began to exist under this name, empty.
        kModified,  ///< Bytes of it changed, or it was cut.
        kRemoved,
        kRenamedFrom,  ///< It lost this name.
        kRenamedTo,    ///< It took this name, from whatever had it.
    };
    std::filesystem::path file;
    Kind kind = Kind::kCreated;
};

/// Watches a folder and the folders in it, as they are now.
class FolderEvents {
public:
    explicit FolderEvents(const std::filesystem::path& folder);
    ~FolderEvents();
    FolderEvents(const FolderEvents&) = delete;
    FolderEvents& operator=(const FolderEvents&) = delete;

    /// Waits for the next events, and returns them; none where `longest` passes first.
    std::vector<FolderEvent> wait(std::chrono::milliseconds longest);

private:
    int descriptor_;
    std::map<int, std::filesystem::path> folders_;
};

}  // namespace tests
