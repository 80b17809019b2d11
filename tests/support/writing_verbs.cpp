#include "tests/support/writing_verbs.h"

#include <fnmatch.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>
#include <stdexcept>

#include "core/image/exr.h"
#include "core/scene/texture.h"
#include "core/support/error.h"
#include "core/support/file_bytes.h"
#include "sdf/vdb_file.h"

namespace tests {

namespace fs = std::filesystem;

namespace {

std::string content_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// A small closed mesh: bakes and renders in no time.
constexpr const char* kScene =
    "o block\n"
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

/// Without regular pattern, so that the preview of it does not shrink to nothing.
core::Image noise_picture(std::uint32_t seed) {
    constexpr int kSide = 96;
    core::Image image(kSide, kSide);
    for (const char* channel : {"R", "G", "B"}) {
        for (float& value : image.add_channel(channel)) {
            seed = seed * 1664525u + 1013904223u;
            value = static_cast<float>(seed >> 16) * 1e-4f;
        }
    }
    return image;
}

/// The inputs of all verbs, made once: pictures, a scene and a field.
const fs::path& input_folder() {
    static const TemporaryFolder folder;
    static const fs::path path = [] {
        std::ofstream(folder.path() / "block.obj") << kScene;
        core::write_exr(folder.path() / "a.exr", noise_picture(1));
        core::write_exr(folder.path() / "b.exr", noise_picture(2));
        const ProgramRun run = run_program({"bake", (folder.path() / "block.obj").string(), "-o",
                                            folder.path().string(), "--resolution", "16", "--quiet"});
        if (run.exit_code != 0) throw std::runtime_error("the input field cannot be baked: " + run.err);
        return folder.path();
    }();
    return path;
}

bool is_whole_png(const fs::path& file) {
    const std::vector<std::uint8_t> bytes = core::read_file_bytes(file, 1 << 26);
    static_cast<void>(core::decode_texture_image(bytes, file.string()));
    // Decoders forgive a missing end.
    const std::string end(bytes.end() - std::min<std::ptrdiff_t>(8, std::ssize(bytes)), bytes.end());
    return end.starts_with("IEND");
}

/// Lines of the same number of commas, as those of a report are.
bool is_whole_csv(const std::string& text) {
    if (!text.ends_with("\n")) return false;
    const auto commas = [](std::string_view line) { return std::count(line.begin(), line.end(), ','); };
    const std::size_t first = text.find('\n'), last = text.rfind('\n', text.size() - 2);
    return last != std::string::npos && commas(text.substr(0, first)) == commas(text.substr(last + 1));
}

}  // namespace

const std::vector<WritingVerb>& writing_verbs() {
    static const std::vector<WritingVerb> verbs = {
        {"render",
         {"render", "block.obj", "-o", "out/picture.exr", "--png", "--stats", "out/stats.json", "--bake-dir",
          "out/fields", "--size", "24x16", "--accumulate", "1", "--resolution", "16", "--threads", "1"},
         {"out/fields/block_0.vdb", "out/picture.exr", "out/picture.png", "out/stats.json"}},
        {"bake",
         {"bake", "block.obj", "-o", "out", "--resolution", "16", "--threads", "1"},
         {"out/block_0.vdb"},
         true},
        {"convert", {"convert", "a.exr", "out/preview.png", "--exposure", "1"}, {"out/preview.png"}},
        {"compare_pictures", {"compare", "a.exr", "b.exr", "--flip-map", "out/map.png"}, {"out/map.png"}},
        {"compare_scene",
         {"compare", "block.obj", "-o", "out", "--size", "16x16", "--resolutions", "16", "--max-spp", "2",
          "--reference-spp", "8", "--threads", "1"},
         {"out/fields/16/bake_seconds.json", "out/fields/16/block_0.vdb", "out/pictures/fields_16.exr",
          "out/pictures/reference.exr", "out/pictures/triangles.exr", "out/reference/*.exr",
          "out/reference/*.json", "out/report.csv", "out/report.html", "out/report.json"},
         true,
         1},  // Its reference is noisy, and that is said.
        {"inspect", {"inspect", "block_0.vdb", "--slice", "out/slice.png"}, {"out/slice.png"}},
    };
    return verbs;
}

void PrintTo(const WritingVerb& verb, std::ostream* stream) {
    *stream << verb.name;
}

FolderContent content_below(const fs::path& folder) {
    FolderContent content;
    if (!fs::is_directory(folder)) return content;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
        if (!entry.is_regular_file()) continue;
        content[entry.path().lexically_relative(folder.parent_path()).string()] = content_of(entry.path());
    }
    return content;
}

Workplace::Workplace(const WritingVerb& verb) : verb_(verb) {
    for (const fs::directory_entry& input : fs::directory_iterator(input_folder())) {
        fs::copy_file(input.path(), path(input.path().filename().string()));
    }
    static std::map<std::string, FolderContent> results;
    FolderContent& result = results[verb.name];
    fs::create_directory(path("out"));
    if (result.empty()) {
        const ProgramRun first = run();
        if (first.exit_code != verb.exit_code) throw std::runtime_error(verb.name + ": " + first.err);
        result = content();
    }
    for (const auto& [file, content] : result) {
        files_.push_back(file);
        sizes_.push_back(content.size());
    }
    restore();
}

ProgramRun Workplace::run(RunConditions conditions) const {
    conditions.folder = folder_.path();
    conditions.stdout_file = "/dev/null";
    return run_program(verb_.arguments, conditions);
}

std::vector<std::string> Workplace::folders() const {
    std::set<std::string> folders;
    for (const std::string& file : files_) folders.insert(fs::path(file).parent_path().string());
    return {folders.begin(), folders.end()};
}

void Workplace::put_old_files() const {
    for (const std::string& file : files_) {
        fs::create_directories(path(file).parent_path());
        std::ofstream(path(file)) << kOldContent;
    }
}

void Workplace::restore() const {
    if (!fs::is_directory(path("out"))) fs::remove(path("out"));
    fs::create_directory(path("out"));
    // Not `out` itself, on which a test may have mounted a small disk.
    for (const fs::directory_entry& entry : fs::directory_iterator(path("out"))) fs::remove_all(entry);
    put_old_files();
}

bool is_temporary(const fs::path& file) {
    return file.filename().string().starts_with(".");
}

bool is_whole(const fs::path& file) {
    const std::string ending = file.extension().string();
    try {
        if (ending == ".exr") return core::read_exr(file).pixel_count() > 0;
        if (ending == ".png") return is_whole_png(file);
        if (ending == ".vdb") return !sdf::read_field(file).leaves.empty();
    } catch (const core::InputError&) {
        return false;
    }
    const std::string text = content_of(file);
    if (ending == ".json") return nlohmann::json::accept(text);
    if (ending == ".csv") return is_whole_csv(text);
    if (ending == ".html") return text.ends_with("</html>\n");
    throw std::logic_error("no reader for " + file.string());
}

void expect_old_or_whole(const Workplace& place, bool may_leave_temporary) {
    for (const auto& [file, content] : place.content()) {
        if (is_temporary(file)) {
            EXPECT_TRUE(may_leave_temporary) << file << " is left over";
            continue;
        }
        EXPECT_EQ(std::count(place.files().begin(), place.files().end(), file), 1) << file << " is unknown";
        EXPECT_TRUE(content == kOldContent || is_whole(place.path(file))) << file << " is half a file";
    }
}

}  // namespace tests
