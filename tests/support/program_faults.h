// tests/support/program_faults.h: what the program must keep when memory runs out, or when it is killed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/program_run.h"
#include "tests/support/writing_verbs.h"

namespace tests {

/// Expects that a run under a limit on memory ended well or with 71 and a message that speaks of memory.
void expect_clear_end(const ProgramRun& run, const std::string& what);

/// Runs a verb under limits of memory from 36 MiB upwards until it succeeds, and expects that each run ends
/// clearly, that a failed one leaves no `output`, and that none leaves a temporary file.
/// @param output is alone in its folder
void sweep_memory(const std::vector<std::string>& arguments, const std::filesystem::path& output,
                  std::uint64_t step_bytes);

/// What became of runs that were to be killed.
struct KillCounts {
    int killed = 0;      ///< Runs that had not ended before.
    int in_writing = 0;  ///< Of these, such as left a temporary file: they were killed while they wrote.
};

/// Runs a verb `count` times and ends each run by SIGKILL: every other one at a random moment of its time,
/// the rest after a random one of the things that happen to its files. Expects each time that every file is
/// the old one or a whole new one, and at last that a run left alone succeeds, whatever the killed ones left
/// over.
KillCounts kill_at_random_points(const WritingVerb& verb, int count);

/// Files in a folder that the program made as temporary ones, by their leading dot.
std::size_t temporary_file_count(const std::filesystem::path& folder);

}  // namespace tests
