// cli/machine.h: on what, and by which build, a number was measured.
#pragma once

#include <cstdint>
#include <string>

namespace cli {

/// What a time depends on besides the work.
struct Machine {
    std::string processor;  ///< Model name, as the kernel tells it.
    std::string isa;        ///< instruction_set().
    std::string system;     ///< Distribution, kernel and architecture.
    int cores = 0;          ///< Hardware threads.
    std::string compiler, flags;
    std::string commit;  ///< Of the sources, with "-dirty" where they differed; "unknown" without git.
};

Machine this_machine();

/// The widest that this processor has of: avx512, avx2, sse4.
const char* instruction_set();

/// The most memory that this process has held.
std::uint64_t peak_memory_bytes();

/// The commit that the build was made from; written by the build (cli/write_commit.cmake).
const char* build_commit();

}  // namespace cli
