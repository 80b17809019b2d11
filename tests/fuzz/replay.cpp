#include "tests/fuzz/replay.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <typeinfo>

#include "tests/fuzz/fuzz_input.h"

namespace fuzz {

namespace {

/// What the copy sends back before it ends; the rest is the message of an exception.
struct Report {
    int accepted_reads = 0;
    std::array<char, 500> exception{};
};

void run_in_copy(Target target, std::span<const std::uint8_t> input, const Limits& limits, int pipe_end) {
    const auto seconds = static_cast<rlim_t>(limits.processor_seconds);
    const rlimit processor{seconds, seconds + 1};
    setrlimit(RLIMIT_CPU, &processor);
    if (limits.limit_allocation) {
        const rlim_t bytes = static_cast<rlim_t>(limits.memory_mib) << 20;
        const rlimit data{bytes, bytes};
        setrlimit(RLIMIT_DATA, &data);
    }
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    alarm(static_cast<unsigned int>(limits.wall_seconds));
    Report report;
    const auto note = [&](const std::string& text) {
        text.copy(report.exception.data(), report.exception.size() - 1);
    };
    try {
        target(input.data(), input.size());
    } catch (const std::exception& error) {
        note(fmt::format("{}: {}", typeid(error).name(), error.what()));
    } catch (...) {
        note("an exception that is no std::exception");
    }
    report.accepted_reads = accepted_reads();
    const ssize_t written = write(pipe_end, &report, sizeof(report));
    _exit(written == sizeof(report) ? 0 : 1);
}

std::string describe_end(int status) {
    if (WIFSIGNALED(status)) {
        const int signal = WTERMSIG(status);
        if (signal == SIGXCPU || signal == SIGKILL) return "ran out of processor time";
        if (signal == SIGALRM) return "waited for ever";
        return fmt::format("ended by signal {} ({})", signal, strsignal(signal));
    }
    return WEXITSTATUS(status) == 0 ? "" : fmt::format("ended with exit code {}", WEXITSTATUS(status));
}

}  // namespace

Outcome replay(Target target, std::span<const std::uint8_t> input, const Limits& limits) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
    const pid_t copy = fork();
    if (copy < 0) throw std::runtime_error("no process");
    if (copy == 0) run_in_copy(target, input, limits, ends[1]);
    close(ends[1]);
    Report report;
    const bool reported = read(ends[0], &report, sizeof(report)) == sizeof(report);
    close(ends[0]);
    int status = 0;
    rusage usage{};
    wait4(copy, &status, 0, &usage);

    Outcome outcome{describe_end(status), report.accepted_reads};
    const long peak_mib = usage.ru_maxrss / 1024;
    if (!outcome.escape.empty()) return outcome;
    if (!reported) outcome.escape = "ended the process";
    if (report.exception[0] != '\0') outcome.escape = fmt::format("threw {}", report.exception.data());
    if (outcome.escape.empty() && peak_mib > limits.memory_mib) {
        outcome.escape = fmt::format("took {} MiB of memory; {} are allowed", peak_mib, limits.memory_mib);
    }
    return outcome;
}

}  // namespace fuzz
