// tests/cli/exit_codes_test.cpp: every exit code that the program documents, with a command that ends in it.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <ostream>
#include <string>
#include <thread>

#include "core/image/exr.h"
#include "tests/support/program_run.h"
#include "tests/support/shared_data.h"
#include "tests/support/writing_verbs.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

const std::string kScene = (assets_folder() / "cornell_box.glb").string();

/// What the commands of the table find in their folder: pictures, a device by a picture's name, a broken
/// scene.
const fs::path& inputs() {
    static const TemporaryFolder folder;
    static const fs::path path = [] {
        for (const auto& [name, value] :
             {std::pair{"one.exr", 1.0f}, {"two.exr", 2.0f}, {"black.exr", 0.0f}}) {
            core::Image image(4, 4);
            image.add_color("", std::vector<glm::vec3>(16, glm::vec3(value)));
            core::write_exr(folder.path() / name, image);
        }
        std::ofstream(folder.path() / "broken.glb") << "not a scene";
        fs::create_symlink("/dev/zero", folder.path() / "device.exr");
        return folder.path();
    }();
    return path;
}

struct ExitCode {
    std::string name;
    int code;
    std::vector<std::string> arguments;
    std::string message;  ///< What stderr holds; nothing where it must be empty.
    std::string stdout_file = "/dev/null";
};

void PrintTo(const ExitCode& row, std::ostream* stream) {
    *stream << row.name;
}

// 70 is missing: it is for faults of the program, and a command that ended in it would be one. 130 and 143
// are below.
const std::vector<ExitCode>& exit_codes() {
    static const std::vector<ExitCode> table = {
        {"Good", 0, {"compare", "one.exr", "one.exr", "--fail-mse", "0"}, ""},
        {"GoodHelp", 0, {"--help"}, ""},
        {"ComparisonWarns", 1, {"compare", "one.exr", "black.exr"}, "the reference is black"},
        {"ThresholdExceeded",
         2,
         {"compare", "one.exr", "two.exr", "--fail-mse", "0.5"},
         "failed: MSE is 1, --fail-mse allows 0.5"},
        {"ThresholdBeforeWarning",
         2,
         {"compare", "one.exr", "black.exr", "--fail-mse", "0.5"},
         "--fail-mse allows 0.5"},
        {"NoVerb", 64, {}, "fieldlight: "},
        {"UnknownVerb", 64, {"rendr", kScene}, "'render'"},
        {"UnknownFlag", 64, {"render", kScene, "-o", "x.exr", "--tracr", "sdf"}, "--tracer"},
        {"WrongValue", 64, {"render", kScene, "-o", "x.exr", "--size", "0x9"}, "--size"},
        {"FlagOfThePathTracer",
         64,
         {"render", kScene, "-o", "x.exr", "--spp", "4"},
         "--spp is of --renderer path; the gather takes --accumulate"},
        {"FlagOfTheGather",
         64,
         {"render", kScene, "-o", "x.exr", "--renderer", "path", "--quality", "high"},
         "--quality is of --renderer gather; the path tracer takes --spp"},
        {"LayerOfThePathTracer",
         64,
         {"render", kScene, "-o", "x.exr", "--aov", "Depth,Variance"},
         "--aov Variance is of --renderer path"},
        {"MoreBouncesThanTheGatherReaches",
         64,
         {"render", kScene, "-o", "x.exr", "--bounces", "2"},
         "--bounces 2: the gather reaches 0 or 1; more are of --renderer path"},
        {"PlanOfBouncesThatTheGatherDoesNotReach", 64, {"plan", kScene, "--bounces", "2"}, "--bounces 2"},
        {"UnknownEffect", 64, {"plan", kScene, "--effects", "moon"}, "no effect is called 'moon'"},
        {"UnknownSetting",
         64,
         {"render", kScene, "-o", "x.exr", "--set", "screen_probes.spacin=2"},
         "did you mean screen_probes.spacing?"},
        {"WrongEnding", 64, {"convert", "one.exr", "one.jpg"}, "'one.jpg': only .png can be written"},
        {"BrokenScene", 65, {"inspect", "broken.glb"}, "broken.glb"},
        {"MissingLayer", 65, {"convert", "one.exr", "one.png", "--layer", "Albedo"}, "Albedo.R"},
        {"MissingScene", 66, {"bake", "none.glb", "-o", "out"}, "'none.glb'"},
        {"MissingPicture", 66, {"compare", "one.exr", "none.exr"}, "'none.exr'"},
        {"DeviceAsInput", 66, {"compare", "one.exr", "device.exr"}, "'device.exr': is not a regular file"},
        {"TooLargeAPicture",
         71,
         {"render", kScene, "-o", "x.exr", "--size", "32768x32768", "--aov", "Depth,Normal"},
         "a picture of 32768 x 32768 pixels with 2 layers: needs about"},
        {"TooLargeAField",
         71,
         {"bake", kScene, "-o", "out", "--mesh", "tall block", "--resolution", "16", "--max-field-bytes",
          "1"},
         "mesh 'tall block'"},
        {"CannotCreate", 73, {"convert", "one.exr", "none/one.png"}, "'none/one.png'"},
        {"CannotCreateFolder", 73, {"bake", kScene, "-o", "one.exr/out"}, "'one.exr/out'"},
        {"CannotWriteTheTable", 74, {"compare", "one.exr", "two.exr"}, "stdout", "/dev/full"},
        {"CannotWriteTheJson", 74, {"inspect", "one.exr", "--json"}, "stdout", "/dev/full"},
        {"CannotWriteTheHelp", 74, {"render", "--help"}, "stdout", "/dev/full"},
    };
    return table;
}

class ExitCodes : public testing::TestWithParam<ExitCode> {};

TEST_P(ExitCodes, AreAsDocumented) {
    const ExitCode& expected = GetParam();
    const FolderContent before = content_below(inputs());
    const ProgramRun run =
        run_program(expected.arguments, {.stdout_file = expected.stdout_file, .folder = inputs()});
    EXPECT_EQ(run.signal, 0);
    EXPECT_EQ(run.exit_code, expected.code) << run.err;
    EXPECT_NE(run.err.find(expected.message), std::string::npos) << run.err;
    EXPECT_EQ(run.err.empty(), expected.message.empty()) << run.err;
    EXPECT_EQ(content_below(inputs()), before) << "files were left or changed";
}

INSTANTIATE_TEST_SUITE_P(Table, ExitCodes, testing::ValuesIn(exit_codes()),
                         [](const auto& row) { return row.param.name; });

/// Whether a process handles a signal by itself, from proc(5): before, the signal would just end it.
bool handles(pid_t process, int signal) {
    std::ifstream status("/proc/" + std::to_string(process) + "/status");
    for (std::string line; std::getline(status, line);) {
        if (!line.starts_with("SigCgt:")) continue;
        return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1) != 0;
    }
    return false;
}

struct Interruption {
    std::string name;
    int signal;
    std::vector<std::string> arguments;       ///< Of work that takes minutes.
    std::chrono::milliseconds after;          ///< The start.
    std::vector<std::string> may_exist = {};  ///< Endings of files that were whole before the signal came.
};

void PrintTo(const Interruption& row, std::ostream* stream) {
    *stream << row.name;
}

class Interruptions : public testing::TestWithParam<Interruption> {};

TEST_P(Interruptions, EndWithTheirCodeAndLeaveNothingHalf) {
    const Interruption& expected = GetParam();
    const TemporaryFolder folder;
    RunConditions conditions;
    conditions.folder = folder.path();
    conditions.while_running = [&](pid_t process) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
        while (!handles(process, expected.signal) && std::chrono::steady_clock::now() < end) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        std::this_thread::sleep_for(expected.after);
        kill(process, expected.signal);
    };
    const ProgramRun run = run_program(expected.arguments, conditions);
    EXPECT_EQ(run.signal, 0) << "the signal itself ended it";
    EXPECT_EQ(run.exit_code, 128 + expected.signal) << run.err;
    EXPECT_NE(run.err.find("fieldlight: stopped; no unfinished file is left"), std::string::npos) << run.err;
    for (const auto& [file, content] : content_below(folder.path())) {
        EXPECT_TRUE(std::any_of(expected.may_exist.begin(), expected.may_exist.end(),
                                [&](const std::string& ending) { return file.ends_with(ending); }) &&
                    is_whole(folder.path().parent_path() / file))
            << file;
    }
}

constexpr std::chrono::milliseconds kAtOnce(0), kMidway(300);

INSTANTIATE_TEST_SUITE_P(
    Table, Interruptions,
    testing::Values(Interruption{"RenderAtOnce",
                                 SIGINT,
                                 {"render", kScene, "-o", "x.exr", "--tracer", "triangle", "--accumulate",
                                  "65536"},
                                 kAtOnce},
                    Interruption{"RenderMidway",
                                 SIGTERM,
                                 {"render", kScene, "-o", "x.exr", "--tracer", "triangle", "--accumulate",
                                  "65536", "--png"},
                                 kMidway},
                    Interruption{"RenderPathMidway",
                                 SIGTERM,
                                 {"render", kScene, "-o", "x.exr", "--tracer", "triangle", "--renderer",
                                  "path", "--spp", "1048576", "--png"},
                                 kMidway},
                    Interruption{"Bake",
                                 SIGINT,
                                 {"bake", kScene, "-o", "out", "--resolution", "192", "--threads", "1"},
                                 kMidway,
                                 {".vdb"}},
                    Interruption{"CompareScene",
                                 SIGINT,
                                 {"compare", kScene, "-o", "out", "--size", "640x360", "--resolutions", "16",
                                  "--reference-spp", "65536"},
                                 kMidway,
                                 {".vdb", "bake_seconds.json"}}),
    [](const auto& row) { return row.param.name; });

}  // namespace
}  // namespace tests
