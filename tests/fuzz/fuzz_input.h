// tests/fuzz/fuzz_input.h: a fuzzer's bytes as the file that a reader opens, and what counts as an answer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

namespace fuzz {

/// Writes `bytes` as `name` into a folder of this process's own and returns the path. The folder (below
/// $TMPDIR) is removed when the process ends; a file that one input wrote is overwritten by the next.
std::filesystem::path input_file(const std::string& name, std::span<const std::uint8_t> bytes);

/// Runs `read` on one thread and takes core::InputError for an answer. Everything else escapes: it is a
/// finding.
void read_or_refuse(const std::function<void()>& read);

/// How many calls of read_or_refuse ended without an error so far.
int accepted_reads();

}  // namespace fuzz
