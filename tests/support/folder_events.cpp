#include "tests/support/folder_events.h"

#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace tests {

namespace fs = std::filesystem;

namespace {

constexpr std::uint32_t kWatched = IN_CREATE | IN_MODIFY | IN_DELETE | IN_MOVED_FROM | IN_MOVED_TO;

FolderEvent::Kind kind_of(std::uint32_t mask) {
    if (mask & IN_MODIFY) return FolderEvent::Kind::kModified;
    if (mask & IN_DELETE) return FolderEvent::Kind::kRemoved;
    if (mask & IN_MOVED_FROM) return FolderEvent::Kind::kRenamedFrom;
    if (mask & IN_MOVED_TO) return FolderEvent::Kind::kRenamedTo;
    return FolderEvent::Kind::kCreated;
}

}  // namespace

FolderEvents::FolderEvents(const fs::path& folder) : descriptor_(inotify_init1(IN_CLOEXEC | IN_NONBLOCK)) {
    if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "inotify_init1");
    const auto watch = [&](const fs::path& path) {
        const int id = inotify_add_watch(descriptor_, path.c_str(), kWatched);
        if (id < 0) throw std::system_error(errno, std::generic_category(), path.string());
        folders_[id] = path;
    };
    watch(folder);
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        if (entry.is_directory()) watch(entry.path());
    }
}

FolderEvents::~FolderEvents() {
    ::close(descriptor_);
}

std::vector<FolderEvent> FolderEvents::wait(std::chrono::milliseconds longest) {
    std::vector<FolderEvent> events;
    pollfd ready{descriptor_, POLLIN, 0};
    if (poll(&ready, 1, static_cast<int>(longest.count())) <= 0) return events;
    alignas(inotify_event) std::array<char, 1 << 16> buffer;
    const ssize_t size = ::read(descriptor_, buffer.data(), buffer.size());
    for (ssize_t at = 0; at < size;) {
        inotify_event event;
        std::memcpy(&event, buffer.data() + at, sizeof event);
        const char* name = buffer.data() + at + sizeof event;
        if (event.len > 0) events.push_back({folders_.at(event.wd) / name, kind_of(event.mask)});
        at += static_cast<ssize_t>(sizeof event + event.len);
    }
    return events;
}

}  // namespace tests
