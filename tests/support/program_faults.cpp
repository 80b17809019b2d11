#include "tests/support/program_faults.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <random>
#include <thread>

namespace tests {

namespace fs = std::filesystem;

void expect_clear_end(const ProgramRun& run, const std::string& what) {
    SCOPED_TRACE(what);
    ASSERT_EQ(run.signal, 0) << run.err;
    ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 71) << run.exit_code << ": " << run.err;
    if (run.exit_code == 0) return;
    EXPECT_TRUE(run.err.starts_with("fieldlight: ")) << run.err;
    EXPECT_TRUE(run.err.find("memory") != std::string::npos || run.err.find("MiB") != std::string::npos)
        << run.err;
}

void sweep_memory(const std::vector<std::string>& arguments, const fs::path& output,
                  std::uint64_t step_bytes) {
    constexpr std::uint64_t kLeast = std::uint64_t{36} << 20, kMost = std::uint64_t{1} << 30;
    int refused = 0;
    for (std::uint64_t limit = kLeast; limit < kMost; limit += step_bytes) {
        std::vector<std::string> limited = arguments;
        limited.insert(limited.end(), {"--max-memory", std::to_string(limit), "--quiet", "--threads", "2"});
        const ProgramRun run = run_program(limited);
        expect_clear_end(run, arguments[0] + " under " + std::to_string(limit));
        EXPECT_EQ(temporary_file_count(output.parent_path()), 0u) << limit;
        if (run.exit_code == 0) break;
        EXPECT_FALSE(fs::exists(output)) << "a failed run leaves no file";
        ++refused;
    }
    EXPECT_GT(refused, 0) << "the smallest limit was enough: the sweep shows nothing";
    EXPECT_TRUE(fs::exists(output)) << "the largest limit was not enough";
}

int kill_at_random_points(const std::function<std::vector<std::string>(int)>& arguments,
                          const fs::path& output, int count,
                          const std::function<bool(const fs::path&)>& is_whole) {
    const ProgramRun first = run_program(arguments(0));
    EXPECT_EQ(first.exit_code, 0) << first.err;
    EXPECT_TRUE(is_whole(output));
    std::mt19937 random(7);
    int killed = 0;
    for (int i = 1; i <= count; ++i) {
        const double moment = first.seconds * std::uniform_real_distribution<double>(0.5, 1.05)(random);
        RunConditions conditions;
        conditions.while_running = [moment](pid_t process) {
            std::this_thread::sleep_for(std::chrono::duration<double>(moment));
            kill(process, SIGKILL);
        };
        killed += run_program(arguments(i), conditions).signal == SIGKILL;
        EXPECT_TRUE(is_whole(output)) << "after attempt " << i << ", killed at " << moment << " s";
    }
    return killed;
}

std::size_t temporary_file_count(const fs::path& folder) {
    std::size_t count = 0;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        count += entry.is_regular_file() && entry.path().filename().string().starts_with(".");
    }
    return count;
}

}  // namespace tests
