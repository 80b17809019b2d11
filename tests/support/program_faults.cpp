#include "tests/support/program_faults.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <thread>

#include "tests/support/folder_events.h"

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

namespace {

/// Runs a verb with a watcher beside it, and returns how many events there were.
int count_events(const Workplace& place) {
    FolderEvents events(place.path("out"));
    EXPECT_NE(place.run().exit_code, -1);
    int count = 0;
    while (true) {
        const auto found = static_cast<int>(events.wait(std::chrono::milliseconds(0)).size());
        if (found == 0) return count;
        count += found;
    }
}

/// Waits until `count` things happened to the files that are watched, or for `longest`.
void wait_for_events(FolderEvents& events, int count, std::chrono::milliseconds longest) {
    const auto end = std::chrono::steady_clock::now() + longest;
    while (count > 0) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
        if (left.count() <= 0) return;
        count -= static_cast<int>(events.wait(left).size());
    }
}

}  // namespace

KillCounts kill_at_random_points(const WritingVerb& verb, int count) {
    const Workplace place(verb);
    const int event_count = count_events(place);
    place.put_old_files();
    const ProgramRun whole = place.run();
    EXPECT_EQ(whole.exit_code, verb.exit_code) << whole.err;
    const std::chrono::milliseconds longest(static_cast<int>(4000 * whole.seconds) + 200);
    std::mt19937 random(7);
    KillCounts counts;
    for (int i = 0; i < count; ++i) {
        place.put_old_files();
        FolderEvents events(place.path("out"));
        const std::size_t left_before = temporary_file_count(place.path("out"));
        const int wanted = std::uniform_int_distribution<int>(1, std::max(1, event_count))(random);
        const std::chrono::duration<double> moment(
            std::uniform_real_distribution<double>(0.0, 1.05 * whole.seconds)(random));
        RunConditions conditions;
        conditions.while_running = [&](pid_t process) {
            if (i % 2 == 0) {
                wait_for_events(events, wanted, longest);
            } else {
                std::this_thread::sleep_for(moment);
            }
            kill(process, SIGKILL);
        };
        const ProgramRun run = place.run(conditions);
        counts.killed += run.signal == SIGKILL;
        counts.in_writing += temporary_file_count(place.path("out")) > left_before;
        SCOPED_TRACE(verb.name + ", attempt " + std::to_string(i));
        EXPECT_TRUE(run.signal == SIGKILL || run.exit_code == verb.exit_code) << run.err;
        expect_old_or_whole(place, /*may_leave_temporary=*/true);
    }
    // What a kill left behind hinders nobody, though what is whole may be used again as it is.
    const ProgramRun next = place.run();
    EXPECT_EQ(next.exit_code, verb.exit_code) << next.err;
    expect_old_or_whole(place, /*may_leave_temporary=*/true);
    place.put_old_files();
    const ProgramRun last = place.run();
    EXPECT_EQ(last.exit_code, verb.exit_code) << last.err;
    for (const std::string& file : place.files()) EXPECT_TRUE(is_whole(place.path(file))) << file;
    return counts;
}

std::size_t temporary_file_count(const fs::path& folder) {
    std::size_t count = 0;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        count += entry.is_regular_file() && is_temporary(entry.path());
    }
    return count;
}

}  // namespace tests
