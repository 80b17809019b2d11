#include "core/support/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <string>
#include <system_error>

#include "core/support/error.h"

namespace core {

namespace fs = std::filesystem;

namespace {

/// Whether a failure says that a file may not stand here, rather than that writing it went wrong.
bool forbids_creation(int error) {
    switch (error) {
        case EACCES:
        case EPERM:
        case EROFS:
        case ENOENT:
        case ENOTDIR:
        case EISDIR:
        case ENOTEMPTY:
        case EEXIST:
        case ELOOP:
        case ENAMETOOLONG:
        case EINVAL:
        case ETXTBSY:
            return true;
        default:
            return false;
    }
}

[[noreturn]] void fail(const fs::path& path, const char* action, int error) {
    const ErrorKind kind = forbids_creation(error) ? ErrorKind::kCannotCreate : ErrorKind::kInputOutput;
    throw InputError(kind, fmt::format("'{}': cannot {}: {}", path.string(), action,
                                       std::generic_category().message(error)));
}

/// An open file that is closed on every way out.
class Descriptor {
public:
    explicit Descriptor(int value) : value_(value) {}
    ~Descriptor() {
        if (value_ >= 0) ::close(value_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    int value() const { return value_; }
    bool is_open() const { return value_ >= 0; }

    /// Closing can be the moment in which a network file system reports a full disk.
    int close_now() {
        const int result = ::close(value_);
        value_ = -1;
        return result;
    }

private:
    int value_;
};

/// The file that will be replaced: links are followed, so that they stay links.
fs::path resolve_destination(const fs::path& path) {
    if (path.filename().empty() || path.filename() == "." || path.filename() == "..") {
        throw InputError(ErrorKind::kCannotCreate,
                         fmt::format("'{}': names a folder; a file name is needed", path.string()));
    }
    std::error_code error;
    const fs::file_status link = fs::symlink_status(path, error);
    if (!fs::exists(link)) return path;
    fs::path target = fs::is_symlink(link) ? fs::canonical(path, error) : path;
    if (error) {
        throw InputError(ErrorKind::kCannotCreate, fmt::format("'{}': cannot write through this link: {}",
                                                               path.string(), error.message()));
    }
    // A device or a pipe would be replaced by a file, and a folder cannot be.
    if (!fs::is_regular_file(target)) {
        throw InputError(
            ErrorKind::kCannotCreate,
            fmt::format("'{}': exists and is not a regular file; only files can be written", path.string()));
    }
    return target;
}

/// Creates an empty file beside `target`, with the permissions that the umask asks for.
fs::path create_temporary(const fs::path& path, const fs::path& target) {
    static std::atomic<unsigned> counter{0};
    while (true) {
        const std::string name = fmt::format(".{}.{}-{}{}", target.stem().string(), ::getpid(), counter++,
                                             target.extension().string());
        fs::path temporary = target.parent_path() / name;
        const Descriptor created(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
        if (created.is_open()) return temporary;
        if (errno != EEXIST) fail(path, "create a file in this folder", errno);
    }
}

/// The path of a temporary file that is being written, where remove_temporary_files finds it.
struct TemporarySlot {
    std::atomic<bool> taken{false};  ///< By a guard, which alone writes the path.
    std::atomic<bool> is_set{false};
    std::array<char, PATH_MAX> path{};
};

/// As many as there may be writers at a time; a file beyond is written all the same.
std::array<TemporarySlot, 64> temporary_slots;

/// Removes the temporary file unless it has become the real one.
class TemporaryGuard {
public:
    explicit TemporaryGuard(const fs::path& temporary) : temporary_(temporary) {
        if (temporary.native().size() >= PATH_MAX) return;
        for (TemporarySlot& slot : temporary_slots) {
            if (slot.taken.exchange(true)) continue;
            temporary.native().copy(slot.path.data(), PATH_MAX - 1);
            slot.path[temporary.native().size()] = '\0';
            slot.is_set = true;
            slot_ = &slot;
            return;
        }
    }
    ~TemporaryGuard() {
        if (!renamed_) ::unlink(temporary_.c_str());
        if (!slot_) return;
        slot_->is_set = false;
        slot_->taken = false;
    }
    TemporaryGuard(const TemporaryGuard&) = delete;
    TemporaryGuard& operator=(const TemporaryGuard&) = delete;

    void set_renamed() { renamed_ = true; }

private:
    const fs::path& temporary_;
    TemporarySlot* slot_ = nullptr;
    bool renamed_ = false;
};

void flush_folder(const fs::path& path, const fs::path& folder) {
    const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!opened.is_open()) {
        // Searchable but not readable: the file is in place, and nobody but the system can flush the folder.
        if (errno == EACCES) return;
        fail(path, "open its folder to flush it", errno);
    }
    // EINVAL: a file system that has nothing to flush for folders.
    if (::fsync(opened.value()) != 0 && errno != EINVAL) fail(path, "flush its folder to disk", errno);
}

void write_all(const fs::path& path, const fs::path& temporary, std::string_view text) {
    Descriptor file(::open(temporary.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
    if (!file.is_open()) fail(path, "open a temporary file in this folder", errno);
    while (!text.empty()) {
        const ssize_t written = ::write(file.value(), text.data(), text.size());
        if (written < 0) {
            if (errno == EINTR) continue;
            throw InputError(ErrorKind::kInputOutput, fmt::format("'{}': writing failed: {}", path.string(),
                                                                  std::generic_category().message(errno)));
        }
        text.remove_prefix(static_cast<std::size_t>(written));
    }
    if (file.close_now() != 0) {
        throw InputError(ErrorKind::kInputOutput,
                         fmt::format("'{}': writing failed on close: {}", path.string(),
                                     std::generic_category().message(errno)));
    }
}

}  // namespace

void write_file_atomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
    const fs::path target = resolve_destination(path);
    const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
    const fs::path temporary = create_temporary(path, target);
    TemporaryGuard guard(temporary);

    write(temporary);

    {
        Descriptor written(::open(temporary.c_str(), O_RDONLY | O_CLOEXEC));
        if (!written.is_open()) fail(path, "reopen the temporary file", errno);
        if (::fsync(written.value()) != 0) {
            throw InputError(ErrorKind::kInputOutput,
                             fmt::format("'{}': cannot flush to disk: {}", path.string(),
                                         std::generic_category().message(errno)));
        }
    }
    if (::rename(temporary.c_str(), target.c_str()) != 0) fail(path, "put the finished file in place", errno);
    guard.set_renamed();
    flush_folder(path, folder);
}

void require_place_for_file(const fs::path& path) {
    const fs::path temporary = create_temporary(path, resolve_destination(path));
    const TemporaryGuard guard(temporary);
}

void remove_temporary_files() noexcept {
    for (const TemporarySlot& slot : temporary_slots) {
        if (slot.is_set) ::unlink(slot.path.data());
    }
}

void write_text_atomically(const fs::path& path, std::string_view text) {
    write_file_atomically(path, [&](const fs::path& temporary) { write_all(path, temporary, text); });
}

}  // namespace core
