// cli/main.cpp: parses, runs one verb, and turns every way of failing into a message and an exit code.
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <iostream>
#include <new>

#include "cli/flag_hints.h"
#include "cli/options.h"
#include "core/support/error.h"
#include "core/support/memory.h"

namespace {

constexpr int kExitUsage = 64;
constexpr int kExitInternal = 70;
constexpr int kExitOutOfMemory = 71;
constexpr int kExitInputOutput = 74;

int fail(int code, const char* message) {
    std::fprintf(stderr, "fieldlight: %s\n", message);
    return code;
}

/// Data on stdout that could not be written is a failure like any other.
int finish(int code) {
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout.flush())
        return fail(kExitInputOutput, "cannot write to stdout");
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    cli::Program program;
    program.arguments.assign(argv + 1, argv + argc);
    cli::install_signal_handlers();
    cli::install_memory_handler();

    CLI::App app{"A ray tracer on signed distance fields, judged by a path tracer on triangles.",
                 "fieldlight"};
    app.set_version_flag("--version", "fieldlight " FIELDLIGHT_VERSION);
    app.require_subcommand(1);
    app.footer("fieldlight VERB --help tells the flags of a verb, with examples.");
    cli::add_bake_command(app, program);
    cli::add_render_command(app, program);
    cli::add_compare_command(app, program);
    cli::add_convert_command(app, program);
    cli::add_inspect_command(app, program);
    cli::add_plan_command(app, program);

    try {
        app.parse(argc, argv);
        return finish(program.exit_code);
    } catch (const CLI::Success& help) {
        return finish(app.exit(help));
    } catch (const CLI::ParseError& error) {
        return fail(kExitUsage, cli::explain_parse_error(app, error, program.arguments).c_str());
    } catch (const core::InputError& error) {
        return fail(static_cast<int>(error.kind()), error.what());
    } catch (const core::Interrupted&) {
        return fail(cli::stop_exit_code(), "stopped; no unfinished file is left");
    } catch (const std::bad_alloc&) {
        core::lift_memory_limit();
        std::fputs(cli::kOutOfMemoryMessage, stderr);
        return kExitOutOfMemory;
    } catch (const std::exception& error) {
        return fail(kExitInternal, fmt::format("internal error: {}", error.what()).c_str());
    }
}
