// tests/support/program_faults.h: what the program must keep when memory runs out, or when it is killed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/program_run.h"

namespace tests {

/// Expects that a run under a limit on memory ended well or with 71 and a message that speaks of memory.
void expect_clear_end(const ProgramRun& run, const std::string& what);

/// Runs a verb under limits of memory from 36 MiB upwards until it succeeds, and expects that each run ends
/// clearly, that a failed one leaves no `output`, and that none leaves a temporary file.
/// @param output is alone in its folder
void sweep_memory(const std::vector<std::string>& arguments, const std::filesystem::path& output,
                  std::uint64_t step_bytes);

/// Runs a verb that writes `output` once to the end, then `count` times with SIGKILL at a random moment of
/// that time, and expects that `output` is each time the old or the new file and `is_whole`. Kills that come
/// while the file is written are what counts, so the moments lie in the last part of the run.
/// @param arguments for attempt number i; they may ask for another content each time
/// @returns how many runs were killed before they ended
int kill_at_random_points(const std::function<std::vector<std::string>(int)>& arguments,
                          const std::filesystem::path& output, int count,
                          const std::function<bool(const std::filesystem::path&)>& is_whole);

/// Files in a folder that the program made as temporary ones, by their leading dot.
std::size_t temporary_file_count(const std::filesystem::path& folder);

}  // namespace tests
