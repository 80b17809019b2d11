// Checks the shape of the house: who may include whom, which library stays behind which fence, how long files
// are.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

struct Source {
    std::string path;  ///< From the repository's root.
    std::string text;
};

const std::vector<std::string> kCoreLayers = {"support", "math", "image", "scene", "trace", "render"};

/// Third-party headers by pattern, and the files that may include them.
struct Fence {
    std::string name;
    std::string header;   ///< Regular expression on what stands between the brackets.
    std::string allowed;  ///< Regular expression on the path of the including file.
};
const std::vector<Fence> kFences = {
    {"Embree", "embree3/.*", "core/trace/triangle_tracer\\.cpp|tests/.*"},
    {"tinygltf", "tiny_gltf\\.h", "core/scene/gltf_[a-z_]*\\.cpp"},
    {"nlohmann-json", "nlohmann/.*", "core/scene/gltf_[a-z_]*\\.(cpp|h)|cli/.*|tests/.*"},
    {"stb", "stb/.*|stb_.*", "core/image/(png|hdr)\\.cpp|core/scene/texture\\.cpp"},
    {"OpenEXR", "(OpenEXR/)?(Imf|Imath|Iex|half).*", "core/image/exr[a-z_]*\\.cpp|tests/core/image/.*"},
    {"oneTBB", "tbb/.*|oneapi/.*", "core/support/parallel\\.cpp"},
    {"OpenVDB", "openvdb/.*|nanovdb/.*", "sdf/[a-z_]*\\.cpp|tests/(sdf|bench|stability)/.*"},
    {"Highway", "hwy/.*", ".*_kernel(-inl\\.h|\\.cpp)|tests/.*"},
    {"CLI11", "CLI/.*", "cli/.*|tests/cli/.*"},
    {"spdlog", "spdlog/.*", "cli/.*|core/support/.*"},
    {"zlib", "zlib\\.h", "cli/report_encode\\.cpp|tests/cli/.*"},
    {"Draco", "draco/.*", "core/scene/gltf_draco\\.cpp|tests/core/scene/gltf_draco_test\\.cpp"},
    {"meshoptimizer", "meshoptimizer\\.h",
     "core/scene/gltf_meshopt\\.cpp|tests/core/scene/gltf_meshopt_test\\.cpp"},
    {"xxHash", "xxhash\\.h", "core/support/hash\\.cpp"},
};

std::string first_folder(const std::string& path) {
    return path.substr(0, path.find('/'));
}

int core_layer(const std::string& path) {
    const std::size_t begin = path.find('/') + 1;
    const std::string folder = path.substr(begin, path.find('/', begin) - begin);
    const auto found = std::find(kCoreLayers.begin(), kCoreLayers.end(), folder);
    return found == kCoreLayers.end() ? -1 : static_cast<int>(found - kCoreLayers.begin());
}

/// What is wrong with one file's includes; empty if nothing.
std::vector<std::string> include_errors(const Source& source) {
    static const std::map<std::string, std::vector<std::string>> allowed = {
        {"core", {"core"}},
        {"sdf", {"core", "sdf"}},
        {"gather", {"core", "gather"}},
        {"cli", {"core", "sdf", "gather", "cli"}},
        {"tests", {"core", "sdf", "gather", "cli", "tests"}},
    };
    static const std::regex ours("^#include \"([^\"]+)\"");
    static const std::regex theirs("^#include <([^>]+)>");
    std::vector<std::string> errors;
    const std::string folder = first_folder(source.path);
    std::istringstream lines(source.text);
    for (std::string line; std::getline(lines, line);) {
        std::smatch match;
        if (std::regex_search(line, match, ours)) {
            const std::string target = match[1];
            const std::string target_folder = first_folder(target);
            const auto& may = allowed.at(folder);
            if (target.find("..") != std::string::npos || target.find('/') == std::string::npos) {
                errors.push_back(source.path + ": '" + target + "' does not start at the repository root");
            } else if (std::find(may.begin(), may.end(), target_folder) == may.end()) {
                errors.push_back(source.path + ": " + folder + " may not include " + target);
            } else if (folder == "core" && core_layer(target) > core_layer(source.path)) {
                errors.push_back(source.path + ": lies below " + target);
            } else if ((target == "core/trace/triangle_tracer.h" || target == "sdf/sdf_tracer.h") &&
                       folder != "cli" && folder != "tests" &&
                       source.path.rfind(target.substr(0, target.size() - 2), 0) != 0) {
                errors.push_back(source.path + ": names a concrete tracer");
            }
        } else if (std::regex_search(line, match, theirs)) {
            for (const Fence& fence : kFences) {
                if (std::regex_match(match[1].str(), std::regex(fence.header)) &&
                    !std::regex_match(source.path, std::regex(fence.allowed))) {
                    errors.push_back(source.path + ": " + fence.name + " stays behind its fence");
                }
            }
        }
    }
    return errors;
}

/// What is wrong with a file's form; empty if nothing.
std::vector<std::string> form_errors(const Source& source) {
    std::vector<std::string> errors;
    const bool header = source.path.ends_with(".h");
    // Highway includes its -inl.h files once for each instruction set: they are sources of kernels.
    const bool is_repeated = source.path.ends_with("-inl.h");
    // To the linker two kernels' functions of one name and instruction set are one.
    if (first_folder(source.path) != "tests" &&
        source.text.find("namespace HWY_NAMESPACE {") != std::string::npos &&
        source.text.find("namespace HWY_NAMESPACE {\nnamespace {") == std::string::npos) {
        errors.push_back(source.path + ": a kernel's names belong into an unnamed namespace");
    }
    const auto lines = std::count(source.text.begin(), source.text.end(), '\n');
    const long limit = header && !is_repeated ? 220 : 550;
    if (lines > limit && first_folder(source.path) != "tests") {
        errors.push_back(source.path + ": " + std::to_string(lines) + " lines; split it by responsibility");
    }
    if (header && source.text.rfind("// " + source.path + ":", 0) != 0) {
        errors.push_back(source.path + ": its first line must be '// " + source.path + ": what it is.'");
    }
    if (header && !is_repeated && source.text.find("#pragma once") == std::string::npos) {
        errors.push_back(source.path + ": lacks #pragma once");
    }
    return errors;
}

std::vector<Source> repository() {
    std::vector<Source> sources;
    const fs::path root(FIELDLIGHT_SOURCE_DIR);
    for (const char* folder : {"core", "sdf", "gather", "cli", "tests"}) {
        if (!fs::exists(root / folder)) continue;
        for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
            const std::string extension = entry.path().extension().string();
            if (extension != ".cpp" && extension != ".h") continue;
            std::ifstream file(entry.path());
            std::ostringstream text;
            text << file.rdbuf();
            sources.push_back({fs::relative(entry.path(), root).generic_string(), text.str()});
        }
    }
    return sources;
}

TEST(Architecture, KeepsLayersAndFences) {
    const std::vector<Source> sources = repository();
    ASSERT_GT(sources.size(), 50u) << "the sources were not found";
    for (const Source& source : sources) {
        for (const std::string& error : include_errors(source)) ADD_FAILURE() << error;
    }
}

TEST(Architecture, KeepsFilesInForm) {
    for (const Source& source : repository()) {
        for (const std::string& error : form_errors(source)) ADD_FAILURE() << error;
    }
}

TEST(ArchitectureChecker, SeesEachKindOfBreach) {
    const auto breaches = [](const char* path, const char* line) {
        return include_errors({path, std::string(line) + "\n"}).size();
    };
    EXPECT_EQ(breaches("core/math/a.cpp", "#include \"core/trace/tracer.h\""), 1u) << "upwards inside core";
    EXPECT_EQ(breaches("core/trace/a.cpp", "#include \"core/math/bounds.h\""), 0u);
    EXPECT_EQ(breaches("gather/a.cpp", "#include \"sdf/baker.h\""), 1u) << "gather never sees sdf";
    EXPECT_EQ(breaches("sdf/a.cpp", "#include \"cli/options.h\""), 1u);
    EXPECT_EQ(breaches("core/render/a.cpp", "#include \"core/trace/triangle_tracer.h\""), 1u);
    EXPECT_EQ(breaches("core/trace/triangle_tracer.cpp", "#include \"core/trace/triangle_tracer.h\""), 0u);
    EXPECT_EQ(breaches("cli/a.cpp", "#include \"sdf/sdf_tracer.h\""), 0u);
    EXPECT_EQ(breaches("cli/a.cpp", "#include \"../sdf/sdf_tracer.h\""), 1u);
    EXPECT_EQ(breaches("cli/a.cpp", "#include \"options.h\""), 1u);
    EXPECT_EQ(breaches("cli/a.cpp", "#include <openvdb/openvdb.h>"), 1u);
    EXPECT_EQ(breaches("sdf/a.cpp", "#include <openvdb/openvdb.h>"), 0u);
    EXPECT_EQ(breaches("sdf/a.h", "#include <openvdb/openvdb.h>"), 1u) << "not in headers";
    EXPECT_EQ(breaches("core/render/a.cpp", "#include <embree3/rtcore.h>"), 1u);
    EXPECT_EQ(breaches("sdf/a.cpp", "#include <tbb/parallel_for.h>"), 1u);
    EXPECT_EQ(breaches("core/scene/gltf_primitive.cpp", "#include <draco/mesh/mesh.h>"), 1u);
    EXPECT_EQ(breaches("core/scene/gltf_document.cpp", "#include <meshoptimizer.h>"), 1u);
}

TEST(ArchitectureChecker, SeesEachFaultOfForm) {
    const std::string good = "// sdf/a.h: a thing.\n#pragma once\n";
    EXPECT_TRUE(form_errors({"sdf/a.h", good}).empty());
    EXPECT_EQ(form_errors({"sdf/a.h", "#pragma once\n"}).size(), 1u);
    EXPECT_EQ(form_errors({"sdf/a.h", "// sdf/a.h: a thing.\n"}).size(), 1u);
    EXPECT_EQ(form_errors({"sdf/a.h", good + std::string(300, '\n')}).size(), 1u);
    EXPECT_EQ(form_errors({"sdf/a.cpp", std::string(551, '\n')}).size(), 1u);
    EXPECT_EQ(form_errors({"sdf/a.cpp", "namespace HWY_NAMESPACE {\nint a;\n}\n"}).size(), 1u);
    EXPECT_TRUE(form_errors({"sdf/a.cpp", "namespace HWY_NAMESPACE {\nnamespace {\nint a;\n}\n}\n"}).empty());
}

}  // namespace
