// tests/support/program_run.h: the program as a process of its own: what it says, how it ends, what it takes.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace tests {

/// Under what conditions a run stands.
struct RunConditions {
    std::optional<std::uint64_t> data_bytes = {};           ///< RLIMIT_DATA.
    std::optional<std::uint64_t> address_space_bytes = {};  ///< RLIMIT_AS.
    std::optional<std::uint64_t> file_bytes = {};           ///< RLIMIT_FSIZE.
    bool obeys_permissions = false;  ///< Even as root, who may otherwise write where the mode forbids it.
    std::filesystem::path stdout_file = {};         ///< Where stdout goes, if not into `out`.
    std::filesystem::path folder = {};              ///< Working folder, if not the test's own.
    std::function<void(pid_t)> while_running = {};  ///< Called once the process stands.
};

/// What became of a run.
struct ProgramRun {
    int exit_code = -1;  ///< -1 where a signal ended it.
    int signal = 0;      ///< That signal, or 0.
    std::string out, err;
    double seconds = 0.0;          ///< Wall time.
    double cpu_seconds = 0.0;      ///< Of all its threads.
    std::uint64_t peak_bytes = 0;  ///< Largest resident set.
};

/// Runs the built program. Its stdin is empty, its stderr a pipe, which no limit on files touches.
ProgramRun run_program(const std::vector<std::string>& arguments, const RunConditions& conditions = {});

/// Whether this build is sanitized: slower, larger, and unable to run under a limit on memory.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace tests
