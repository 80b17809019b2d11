#include "tests/support/program_run.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <iterator>
#include <system_error>

#include "tests/support/shared_data.h"

namespace tests {

namespace fs = std::filesystem;

namespace {

std::string content_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// In the child, between fork and exec: only calls that are safe there.
void limit(__rlimit_resource resource, const std::optional<std::uint64_t>& bytes) {
    if (!bytes) return;
    const rlimit value{*bytes, *bytes};
    setrlimit(resource, &value);
}

void open_as(int descriptor, const char* path, int flags) {
    const int opened = ::open(path, flags, 0600);
    if (opened < 0) _exit(126);
    dup2(opened, descriptor);
    ::close(opened);
}

/// Takes root's right to write anywhere out of what the program gets; others never had it.
void obey_permissions() {
    if (geteuid() == 0 && prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0) != 0) _exit(126);
}

/// All that comes through a pipe until its other end is closed.
std::string drain(int descriptor) {
    std::string text;
    std::array<char, 4096> buffer;
    while (true) {
        const ssize_t count = ::read(descriptor, buffer.data(), buffer.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) break;
        text.append(buffer.data(), static_cast<std::size_t>(count));
    }
    ::close(descriptor);
    return text;
}

double seconds_of(const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

ProgramRun run_program(const std::vector<std::string>& arguments, const RunConditions& conditions) {
    const TemporaryFolder folder;
    const std::string out = conditions.stdout_file.empty() ? folder.path() / "out" : conditions.stdout_file;
    std::vector<char*> argv = {const_cast<char*>(FIELDLIGHT_BINARY)};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);

    int err[2];
    if (pipe2(err, O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe2");
    const auto start = std::chrono::steady_clock::now();
    const pid_t child = fork();
    if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (child == 0) {
        open_as(STDIN_FILENO, "/dev/null", O_RDONLY);
        open_as(STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC);
        dup2(err[1], STDERR_FILENO);
        if (!conditions.folder.empty() && chdir(conditions.folder.c_str()) != 0) _exit(126);
        if (conditions.obeys_permissions) obey_permissions();
        limit(RLIMIT_DATA, conditions.data_bytes);
        limit(RLIMIT_AS, conditions.address_space_bytes);
        limit(RLIMIT_FSIZE, conditions.file_bytes);
        execv(FIELDLIGHT_BINARY, argv.data());
        _exit(127);
    }
    ::close(err[1]);
    if (conditions.while_running) conditions.while_running(child);
    ProgramRun run;
    run.err = drain(err[0]);
    int status = 0;
    rusage usage{};
    while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
    }
    run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    run.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
    run.peak_bytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
    if (WIFEXITED(status)) run.exit_code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) run.signal = WTERMSIG(status);
    if (conditions.stdout_file.empty()) run.out = content_of(out);
    return run;
}

}  // namespace tests
