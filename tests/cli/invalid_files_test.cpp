// tests/cli/invalid_files_test.cpp: 190 broken files of others, each with the outcome that was decided for
// it.
//
// tests/data/invalid_files.tsv holds one line a file: the exit codes of `inspect`, of using it (`bake` of a
// scene, `convert` of a picture) and of `inspect` once everything in it is drawn; what stderr must say; why.
// Most of the Khronos validator's cases have no scene. So each of those is also tried with one that shows all
// its meshes, cameras, lights and images: column `drawn`, `-` where the file already has a scene or is no
// readable JSON.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "core/image/png.h"
#include "core/support/atomic_file.h"
#include "core/support/parallel.h"
#include "tests/support/program_run.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Line {
    std::string file, outcome;
    int inspect = 0, use = 0;
    std::string drawn, says, reason;
};

std::vector<Line> table() {
    std::ifstream file(fs::path(FIELDLIGHT_SOURCE_DIR) / "tests/data/invalid_files.tsv");
    std::vector<Line> lines;
    std::string text;
    std::getline(file, text);  // The names of the columns.
    while (std::getline(file, text)) {
        std::istringstream row(text);
        std::string inspect, use;
        Line line;
        for (std::string* field :
             {&line.file, &line.outcome, &inspect, &use, &line.drawn, &line.says, &line.reason}) {
            std::getline(row, *field, '\t');
        }
        line.inspect = std::stoi(inspect);
        line.use = std::stoi(use);
        lines.push_back(line);
    }
    return lines;
}

/// Programs of their own start slowly, so as many run at a time as there are cores.
void for_each_line(const std::function<void(const Line&)>& check) {
    const std::vector<Line> lines = table();
    core::parallel_for(lines.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) check(lines[i]);
    });
}

/// What every run must keep, whatever its outcome.
void expect_good_manners(const tests::ProgramRun& run, const fs::path& file, int exit_code) {
    SCOPED_TRACE(file.string());
    EXPECT_EQ(run.exit_code, exit_code) << "signal " << run.signal << ": " << run.err;
    EXPECT_EQ(run.err.find("Sanitizer"), std::string::npos) << run.err;
    EXPECT_EQ(run.err.find("runtime error"), std::string::npos) << run.err;
    if (exit_code != 0) {
        EXPECT_NE(run.err.find(file.filename().string()), std::string::npos) << run.err;
    }
    if (tests::kSanitized) return;
    // The processor's time, so that a busy machine fails nothing.
    EXPECT_LE(run.cpu_seconds, 2.0);
    EXPECT_LE(run.peak_bytes, std::uint64_t{512} << 20);
}

std::vector<std::string> use_of(const fs::path& file, const fs::path& folder) {
    if (file.extension() == ".exr") return {"convert", file.string(), (folder / "out.png").string()};
    return {"bake", file.string(), "-o", (folder / "out").string(), "--resolution", "32"};
}

std::size_t size_of(const json& object, const char* key) {
    if (!object.is_object()) return 0;
    const auto member = object.find(key);
    return member != object.end() && member->is_array() ? member->size() : 0;
}

/// The file with a scene that shows everything in it; nothing where it has one, or cannot have one.
std::optional<json> with_everything_drawn(const fs::path& file) {
    json document = json::parse(std::ifstream(file), nullptr, false);
    if (!document.is_object() || document.contains("scenes")) return std::nullopt;
    json& nodes = document["nodes"];
    if (nodes.is_null()) nodes = json::array();
    if (!nodes.is_array()) return std::nullopt;
    std::set<std::size_t> children;
    for (const json& node : nodes) {
        if (!node.is_object() || size_of(node, "children") == 0) continue;
        for (const json& child : node["children"]) {
            if (child.is_number_unsigned()) children.insert(child.get<std::size_t>());
        }
    }
    for (const auto& [array, key] : {std::pair{"meshes", "mesh"}, std::pair{"cameras", "camera"}}) {
        for (std::size_t i = 0; i < size_of(document, array); ++i) {
            const bool shown = std::any_of(nodes.begin(), nodes.end(), [&](const json& node) {
                return node.is_object() && node.contains(key) && node[key] == i;
            });
            if (!shown) nodes.push_back({{key, i}});
        }
    }
    const json lights = document.value(json::json_pointer("/extensions/KHR_lights_punctual"), json());
    for (std::size_t i = 0; i < size_of(lights, "lights"); ++i) {
        nodes.push_back({{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
    }
    for (std::size_t i = 0; i < size_of(document, "images"); ++i) {
        document["materials"].push_back({{"normalTexture", {{"index", size_of(document, "textures")}}}});
        document["textures"].push_back({{"source", i}});
    }
    json roots = json::array();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!children.contains(i)) roots.push_back(i);
    }
    document["scenes"] = {{{"nodes", roots}}};
    return document;
}

TEST(InvalidFiles, TheTableHasOneLineForEachFile) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/invalid");
    std::map<std::string, int> lines;
    for (const Line& line : table()) {
        ++lines[line.file];
        EXPECT_TRUE(fs::exists(folder / line.file)) << line.file;
        EXPECT_FALSE(line.reason.empty()) << line.file << " has no reason";
        EXPECT_EQ(line.outcome, line.inspect == 0 ? "loads" : "refused") << line.file;
    }
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".gltf" && extension != ".glb" && extension != ".exr") continue;
        EXPECT_EQ(lines[fs::relative(entry.path(), folder).generic_string()], 1) << entry.path();
    }
}

TEST(InvalidFiles, EndAsTheTableSays) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/invalid");
    for_each_line([&](const Line& line) {
        const tests::TemporaryFolder temporary;
        const fs::path file = folder / line.file;
        const tests::ProgramRun inspected = tests::run_program({"inspect", file.string(), "--json"});
        expect_good_manners(inspected, file, line.inspect);
        const tests::ProgramRun used = tests::run_program(use_of(file, temporary.path()));
        expect_good_manners(used, file, line.use);
        EXPECT_NE((line.inspect != 0 ? inspected : used).err.find(line.says), std::string::npos)
            << line.file << " must say '" << line.says << "': " << inspected.err << used.err;
        if (inspected.exit_code != 0) return;
        const json report = json::parse(inspected.out, nullptr, false);
        EXPECT_EQ(report.value("schema", 0), 1) << line.file;
    });
}

TEST(InvalidFiles, EndAsTheTableSaysWhereEverythingIsDrawn) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/invalid");
    std::atomic<int> drawn = 0;
    for_each_line([&](const Line& line) {
        const fs::path file = folder / line.file;
        std::optional<json> document;
        if (file.extension() == ".gltf") document = with_everything_drawn(file);
        ASSERT_EQ(document.has_value(), line.drawn != "-") << line.file;
        if (!document) return;
        const tests::TemporaryFolder temporary;
        for (const fs::directory_entry& entry : fs::directory_iterator(file.parent_path())) {
            const bool is_scene = entry.path().extension() == ".gltf";
            if (entry.is_regular_file() && !is_scene) fs::copy(entry.path(), temporary.path());
        }
        const fs::path copy = temporary.path() / file.filename();
        core::write_text_atomically(copy, document->dump());
        expect_good_manners(tests::run_program({"inspect", copy.string()}), copy, std::stoi(line.drawn));
        ++drawn;
    });
    EXPECT_GT(drawn, 100);
}

/// `count` copies of a JSON value, joined as the elements of an array.
std::string repeated(const std::string& value, int count) {
    std::string text = value;
    for (int i = 1; i < count; ++i) text += "," + value;
    return text;
}

// Neither is broken, but each would take gigabytes if every mention of a file were a copy of it.
TEST(InvalidFiles, AFileThatManyBuffersNameIsReadOnce) {
    const tests::TemporaryFolder temporary;
    const fs::path file = temporary.path() / "greedy.gltf";
    constexpr int kCount = 25'000;
    core::write_text_atomically(
        file, R"({"asset":{"version":"2.0"},"buffers":[)" +
                  repeated(R"({"uri":"greedy.gltf","byteLength":9})", kCount / 2) + "," +
                  repeated(R"({"uri":"./%67reedy.gltf","byteLength":800000})", kCount / 2) + "]}");
    ASSERT_GT(fs::file_size(file), 800'000U);
    const tests::ProgramRun run = tests::run_program({"inspect", file.string()});
    expect_good_manners(run, file, 0);
    EXPECT_EQ(run.err.find("left out"), std::string::npos) << run.err;
}

TEST(InvalidFiles, APictureThatManyImagesNameIsReadOnce) {
    const tests::TemporaryFolder temporary;
    const fs::path file = temporary.path() / "greedy.gltf";
    constexpr int kSide = 2048, kCount = 4'000;
    core::write_png(temporary.path() / "large.png", kSide, kSide,
                    std::vector<std::uint8_t>(3 * kSide * kSide, 128));
    std::string textures, materials;
    for (int i = 0; i < kCount; ++i) {
        const std::string comma = i == 0 ? "" : ",";
        textures += comma + R"({"source":)" + std::to_string(i) + "}";
        materials += comma + R"({"emissiveTexture":{"index":)" + std::to_string(i) + "}}";
    }
    core::write_text_atomically(file, R"({"asset":{"version":"2.0"},"images":[)" +
                                          repeated(R"({"uri":"large.png"})", kCount) + R"(],"textures":[)" +
                                          textures + R"(],"materials":[)" + materials + "]}");
    expect_good_manners(tests::run_program({"inspect", file.string()}), file, 0);
}

}  // namespace
