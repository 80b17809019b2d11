// tests/fuzz/replay.h: one input through one fuzz target, in a process of its own and within limits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace fuzz {

/// What libFuzzer calls.
using Target = int (*)(const std::uint8_t* data, std::size_t size);

struct Limits {
    int processor_seconds = 2;     ///< Over all threads; whole seconds, as the system counts.
    int wall_seconds = 120;        ///< Only against waiting for ever: other programs may take the processor.
    int memory_mib = 512;          ///< Largest resident size, libraries included.
    bool limit_allocation = true;  ///< Memory that is asked for and never touched counts, too.
};

struct Outcome {
    std::string escape;      ///< How the input got out: an exception, a signal, a limit. Empty: it did not.
    int accepted_reads = 0;  ///< Readings that did not end in core::InputError.
};

/// @pre the calling process has started no threads: only one of them would live on in the copy.
Outcome replay(Target target, std::span<const std::uint8_t> input, const Limits& limits);

}  // namespace fuzz
