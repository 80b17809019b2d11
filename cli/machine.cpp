#include "cli/machine.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/utsname.h>

#include <fstream>
#include <string_view>
#include <thread>

namespace cli {

namespace {

/// What follows `key` and `separator` in the first line of `file` that has both; empty where none does.
std::string value_in(const char* file, std::string_view key, char separator) {
    std::ifstream lines(file);
    for (std::string line; std::getline(lines, line);) {
        const std::size_t end = line.find(separator);
        if (end == std::string::npos || line.compare(0, key.size(), key) != 0) continue;
        const std::size_t begin = line.find_first_not_of(" \t\"", end + 1);
        if (begin == std::string::npos) continue;
        return line.substr(begin, line.find_last_not_of(" \t\"") + 1 - begin);
    }
    return {};
}

std::string system_name() {
    utsname kernel{};
    uname(&kernel);
    const std::string distribution = value_in("/etc/os-release", "PRETTY_NAME", '=');
    return fmt::format("{}{}{} {} {}", distribution, distribution.empty() ? "" : ", ", kernel.sysname,
                       kernel.release, kernel.machine);
}

}  // namespace

Machine this_machine() {
    Machine machine;
    machine.processor = value_in("/proc/cpuinfo", "model name", ':');
    if (machine.processor.empty()) machine.processor = "unknown";
    machine.isa = instruction_set();
    machine.system = system_name();
    machine.cores = static_cast<int>(std::thread::hardware_concurrency());
#if defined(__clang__)
    machine.compiler = __VERSION__;
#else
    machine.compiler = "GCC " __VERSION__;
#endif
    machine.flags = FIELDLIGHT_FLAGS;
    machine.commit = build_commit();
    return machine;
}

const char* instruction_set() {
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) return "avx512";
    if (__builtin_cpu_supports("avx2")) return "avx2";
    return "sse4";
}

std::uint64_t peak_memory_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace cli
