#include "core/support/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <new>
#include <utility>

#include "core/support/error.h"

namespace core {

namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kReservesMemory = true;
#else
constexpr bool kReservesMemory = false;
#endif

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

struct MemoryUse {
    std::uint64_t address_space = 0;
    std::uint64_t data = 0;  ///< Private and writable, stacks included.
};

std::uint64_t page_bytes() {
    return static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// proc(5), /proc/[pid]/statm: size resident shared text lib data dt, in pages.
MemoryUse memory_use() {
    std::ifstream file("/proc/self/statm");
    std::uint64_t size = 0, resident = 0, shared = 0, text = 0, library = 0, data = 0;
    file >> size >> resident >> shared >> text >> library >> data;
    return {size * page_bytes(), data * page_bytes()};
}

std::uint64_t soft_limit(int resource) {
    rlimit limit{};
    if (getrlimit(static_cast<__rlimit_resource>(resource), &limit) != 0) return kUnlimited;
    return limit.rlim_cur == RLIM_INFINITY ? kUnlimited : limit.rlim_cur;
}

std::uint64_t below(std::uint64_t limit, std::uint64_t used) {
    return limit == kUnlimited ? kUnlimited : limit - std::min(limit, used);
}

std::string mebibytes(std::uint64_t bytes, bool round_up) {
    return fmt::format("{} MiB", (bytes >> 20) + (round_up && bytes % (1 << 20) != 0 ? 1 : 0));
}

thread_local bool aligned_memory_is_checked = false;

}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

// Takes the place of the C library's posix_memalign, for shared libraries as well. Under a name of its own in
// C++, since the C library's header promises that posix_memalign throws nothing.
extern "C" int checked_posix_memalign(void** memory, std::size_t alignment,
                                      std::size_t bytes) __asm__("posix_memalign");

extern "C" int checked_posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
    if (alignment == 0 || (alignment & (alignment - 1)) != 0 || alignment % sizeof(void*) != 0) return EINVAL;
    void* const taken = std::aligned_alloc(alignment, bytes);
    if (!taken && aligned_memory_is_checked) throw std::bad_alloc();
    if (!taken) return ENOMEM;
    *memory = taken;
    return 0;
}

#endif

ScopedCheckedAlignedMemory::ScopedCheckedAlignedMemory()
    : previous_(std::exchange(aligned_memory_is_checked, true)) {}

ScopedCheckedAlignedMemory::~ScopedCheckedAlignedMemory() {
    aligned_memory_is_checked = previous_;
}

void limit_memory(std::uint64_t bytes) {
    if (kReservesMemory) {
        throw InputError(ErrorKind::kUsage,
                         "--max-memory: this build's sanitizer reserves memory in advance and cannot run "
                         "under a limit; use a build without");
    }
    const std::uint64_t used = memory_use().data;
    if (bytes <= used) {
        throw InputError(ErrorKind::kOutOfMemory,
                         fmt::format("--max-memory {}: the program alone takes {}; more is "
                                     "needed",
                                     bytes, mebibytes(used, true)));
    }
    rlimit limit{};
    getrlimit(RLIMIT_DATA, &limit);
    // The hard limit stays, so that lift_memory_limit can go back.
    limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? bytes : std::min<rlim_t>(bytes, limit.rlim_max);
    setrlimit(RLIMIT_DATA, &limit);
}

void lift_memory_limit() noexcept {
    for (const auto resource : {RLIMIT_DATA, RLIMIT_AS}) {
        rlimit limit{};
        if (getrlimit(resource, &limit) != 0) continue;
        limit.rlim_cur = limit.rlim_max;
        setrlimit(resource, &limit);
    }
}

bool memory_is_limited() {
    return soft_limit(RLIMIT_DATA) != kUnlimited || soft_limit(RLIMIT_AS) != kUnlimited;
}

std::uint64_t memory_left() {
    const MemoryUse use = memory_use();
    const std::uint64_t limited =
        std::min(below(soft_limit(RLIMIT_DATA), use.data), below(soft_limit(RLIMIT_AS), use.address_space));
    const auto machine = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * page_bytes();
    return std::min(limited, machine);
}

void require_memory(std::uint64_t bytes, const std::string& what) {
    const std::uint64_t left = memory_left();
    if (bytes <= left) return;
    throw InputError(
        ErrorKind::kOutOfMemory,
        fmt::format(
            "{}: needs about {}, and {} are left {}", what, mebibytes(bytes, true), mebibytes(left, false),
            memory_is_limited() ? "under the limit on memory (--max-memory, ulimit)" : "on this machine"));
}

}  // namespace core
