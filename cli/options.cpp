#include "cli/options.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <new>
#include <system_error>

#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "core/support/memory.h"
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
    verb.add_option_function<std::string>(
            "--max-memory",
            [&options](const std::string& text) { options.max_memory_bytes = *parse_memory_size(text); },
            "Bytes that the program may take, such as 512M or 4G; past them it ends with exit code 71")
        ->check([](const std::string& text) {
            return parse_memory_size(text)
                       ? std::string()
                       : fmt::format("takes bytes, such as 512M, 4G or 1000000000, not '{}'", text);
        })
        ->type_name("BYTES");
    verb.add_flag("--allow-external", options.allow_external, "Let a scene's URIs leave its folder");
}

std::optional<std::uint64_t> parse_memory_size(std::string_view text) {
    constexpr std::string_view kUnits = "KMGT";
    std::uint64_t value = 0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || value == 0) return std::nullopt;
    if (rest == end) return value;
    const std::size_t unit = kUnits.find(static_cast<char>(std::toupper(static_cast<unsigned char>(*rest))));
    if (unit == std::string_view::npos || rest + 1 != end) return std::nullopt;
    const unsigned shift = 10 * (static_cast<unsigned>(unit) + 1);
    if (value > std::numeric_limits<std::uint64_t>::max() >> shift) return std::nullopt;
    return value << shift;
}

void run_verb(Program& program, const std::function<void()>& work) {
    if (program.common.max_memory_bytes > 0) core::limit_memory(program.common.max_memory_bytes);
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

namespace {

/// Whether the exception on its way out says that memory is short: the heap's, or a thread's that the system
/// refuses to start.
bool is_out_of_memory() {
    try {
        throw;
    } catch (const std::bad_alloc&) {
        return true;
    } catch (const std::system_error& error) {
        return error.code() == std::errc::resource_unavailable_try_again ||
               error.code() == std::errc::not_enough_memory;
    } catch (...) {
        return false;
    }
}

[[noreturn]] void on_terminate() {
    if (std::current_exception() && is_out_of_memory()) {
        std::fputs(kOutOfMemoryMessage, stderr);
        core::remove_temporary_files();
        std::_Exit(static_cast<int>(core::ErrorKind::kOutOfMemory));
    }
    std::abort();
}

}  // namespace

void install_memory_handler() {
    std::set_terminate(on_terminate);
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
