// cli/options.h: what all verbs share: common flags, the shape of a verb, output to the terminal.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/support/progress.h"

namespace cli {

/// Flags that every verb takes.
struct CommonOptions {
    bool json = false;                   ///< One JSON object on stdout.
    bool quiet = false;                  ///< Nothing on stderr but errors.
    std::uint64_t seed = 0;              ///< Of all random numbers.
    int threads = 0;                     ///< 0: one a core.
    bool allow_external = false;         ///< glTF URIs may leave the scene's folder.
    std::uint64_t max_memory_bytes = 0;  ///< 0: as much as the system gives.
};

/// What stderr says where an allocation failed.
inline constexpr const char* kOutOfMemoryMessage =
    "fieldlight: out of memory; --max-memory, ulimit or the machine allow no more\n";

/// State of one run of the program.
struct Program {
    CommonOptions common;
    std::vector<std::string> arguments;  ///< As typed, without the program's name.
    int exit_code = 0;  ///< Set by a verb that ends well but not with 0 (comparison thresholds).
};

/// Declares the common flags on a verb.
void add_common_options(CLI::App& verb, CommonOptions& options);

/// Bytes of "512M", "4G" or plain bytes; K, M, G and T are powers of 1024. Nothing if it is none of these.
std::optional<std::uint64_t> parse_memory_size(std::string_view text);

/// Runs a verb's work under the common flags (limits on memory and threads).
void run_verb(Program& program, const std::function<void()>& work);

/// A warning or a note for the person at the terminal, on stderr; silent under --quiet.
void warn(const Program& program, const std::string& message);
void note(const Program& program, const std::string& message);

/// A progress bar on stderr where that is a terminal and nothing forbids it (--quiet, CI, NO_COLOR,
/// TERM=dumb); otherwise an empty function.
core::Progress make_progress(const Program& program);

/// Polled by long loops; true after SIGINT or SIGTERM.
core::StopRequested stop_flag();

/// Ends the program with 71 instead of an abort where memory runs out in a place that cannot fail, such as a
/// thread of a library; with the message that main gives.
void install_memory_handler();

/// The exit code of a signal that asked for the stop: 130 for SIGINT, 143 for SIGTERM.
int stop_exit_code();

/// Catches SIGINT and SIGTERM, so that stop_flag() sees them; a second one ends the program at once. Ignores
/// SIGXFSZ, so that a limit on file sizes is reported like a full disk.
void install_signal_handlers();

// The verbs. Each declares its flags and help on `app` and runs from CLI11's callback.
void add_bake_command(CLI::App& app, Program& program);
void add_render_command(CLI::App& app, Program& program);
void add_compare_command(CLI::App& app, Program& program);
void add_convert_command(CLI::App& app, Program& program);
void add_inspect_command(CLI::App& app, Program& program);
void add_plan_command(CLI::App& app, Program& program);

}  // namespace cli
