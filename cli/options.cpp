#include "cli/options.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>

#include "core/support/parallel.h"

namespace cli {

namespace {

volatile std::sig_atomic_t received_signal = 0;

void on_signal(int signal) {
    received_signal = signal;
    std::signal(signal, SIG_DFL);
}

/// Lines on stderr, without time stamps: they are for a person.
spdlog::logger& console() {
    static const std::shared_ptr<spdlog::logger> logger = [] {
        auto made = spdlog::stderr_logger_mt("fieldlight");
        made->set_pattern("fieldlight: %v");
        return made;
    }();
    return *logger;
}

bool set_in_environment(const char* name) {
    const char* value = std::getenv(name);
    return value && *value;
}

}  // namespace

void add_common_options(CLI::App& verb, CommonOptions& options) {
    verb.add_flag("--json", options.json, "Print one JSON object on stdout");
    verb.add_flag("--quiet", options.quiet, "Print nothing on stderr but errors");
    verb.add_option("--seed", options.seed, "Seed of all random numbers")->capture_default_str();
    verb.add_option("--threads", options.threads,
                    "Threads; 0 is one a core; the pixels are the same at any count")
        ->check(CLI::Range(0, 1024))
        ->capture_default_str();
    verb.add_flag("--allow-external", options.allow_external, "Let a scene's URIs leave its folder");
}

void run_verb(Program& program, const std::function<void()>& work) {
    core::with_thread_limit(program.common.threads, work);
}

void warn(const Program& program, const std::string& message) {
    if (!program.common.quiet) console().warn("warning: {}", message);
}

void note(const Program& program, const std::string& message) {
    if (!program.common.quiet) console().info("{}", message);
}

core::Progress make_progress(const Program& program) {
    const char* term = std::getenv("TERM");
    if (program.common.quiet || isatty(STDERR_FILENO) == 0 || set_in_environment("CI") ||
        set_in_environment("NO_COLOR") || !term || std::string(term) == "dumb") {
        return {};
    }
    struct State {
        std::mutex mutex;
        std::string shown;
    };
    return [state = std::make_shared<State>()](std::string_view stage, double fraction) {
        constexpr int kWidth = 32;
        const int filled = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * kWidth);
        const std::string line = fmt::format("{:<10.10} [{:#<{}}{:.<{}}] {:3.0f} %", stage, "", filled, "",
                                             kWidth - filled, 100.0 * fraction);
        const std::lock_guard lock(state->mutex);
        if (line == state->shown) return;
        state->shown = line;
        std::fprintf(stderr, "\r%s%s", line.c_str(), fraction >= 1.0 ? "\n" : "");
        std::fflush(stderr);
    };
}

core::StopRequested stop_flag() {
    return [] { return received_signal != 0; };
}

int stop_exit_code() {
    return 128 + static_cast<int>(received_signal);
}

void install_signal_handlers() {
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    // A file that grows past a limit is an error of write(), not the end of the program.
    std::signal(SIGXFSZ, SIG_IGN);
}

}  // namespace cli
