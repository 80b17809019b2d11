// core/support/memory.h: a limit on this process's memory that the system itself enforces.
//
// Past the limit every allocation fails, in libraries too, so that the run ends with a message instead of in
// the system's hands. Where much is about to be taken, require_memory asks first and can say what for.
#pragma once

#include <cstdint>
#include <string>

namespace core {

/// Limits the private memory of this process (RLIMIT_DATA: heap, thread stacks, anonymous maps; not the
/// program's code). Call it before threads are started.
/// @throws InputError kOutOfMemory where the process already uses as much; kUsage in a build whose sanitizer
/// reserves memory in advance and cannot run under a limit
void limit_memory(std::uint64_t bytes);

/// Opens the limit again, as far as the system lets, so that there is room to say that it was met.
void lift_memory_limit() noexcept;

/// While it lives, aligned memory that its thread asks for and does not get ends in std::bad_alloc, where
/// posix_memalign would return an error. For C libraries that do not look: Blosc 1.21, by which OpenVDB packs
/// its leaves, writes through the null pointer. Nothing changes in builds with a sanitizer, which cannot run
/// under a limit and replaces posix_memalign itself.
class ScopedCheckedAlignedMemory {
public:
    ScopedCheckedAlignedMemory();
    ~ScopedCheckedAlignedMemory();
    ScopedCheckedAlignedMemory(const ScopedCheckedAlignedMemory&) = delete;
    ScopedCheckedAlignedMemory& operator=(const ScopedCheckedAlignedMemory&) = delete;

private:
    bool previous_;
};

/// Whether a limit was set, here or by whoever started the program (ulimit).
bool memory_is_limited();

/// Bytes that this process may still take: up to its limits or, where there are none, the machine's memory.
std::uint64_t memory_left();

/// Asks before memory is taken.
/// @param what needs it, as in "the picture of 8000 x 8000 pixels"
/// @throws InputError kOutOfMemory naming `what`, what it needs and what is left
void require_memory(std::uint64_t bytes, const std::string& what);

}  // namespace core
