#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "core/scene/gltf_uri.h"
#include "core/scene/warning_list.h"
#include "core/support/error.h"
#include "tests/core/scene/gltf_builder.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;
using tests::GltfBuilder;

GltfBuilder triangle_at_a_node() {
    GltfBuilder builder;
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", builder.add_triangle_mesh()));
    return builder;
}

std::string bytes_as_text(const GltfBuilder& builder) {
    return {builder.bytes().begin(), builder.bytes().end()};
}

std::string error_of_file(const fs::path& path, const core::LoadOptions& options = {}) {
    try {
        core::load_gltf(path, options);
    } catch (const core::InputError& error) {
        return fmt::format("{} (kind {})", error.what(), static_cast<int>(error.kind()));
    }
    return "no error";
}

/// A scene in `inside/` of a fresh folder, whose buffer's URI is the test's; `outside.bin` lies above it.
class UriTest : public testing::Test {
protected:
    UriTest() {
        fs::create_directories(folder());
        tests::write_text(outside(), bytes_as_text(builder_));
    }
    fs::path folder() const { return temporary_.path() / "inside"; }
    fs::path outside() const { return temporary_.path() / "outside.bin"; }

    std::string error(const std::string& uri, bool allow_external = false) {
        tests::write_text(folder() / "scene.gltf", builder_.json(uri));
        return error_of_file(folder() / "scene.gltf", {.scene = "", .allow_external = allow_external});
    }
    void write_buffer(const std::string& name) {
        tests::write_text(folder() / name, bytes_as_text(builder_));
    }

    tests::TemporaryFolder temporary_;
    GltfBuilder builder_ = triangle_at_a_node();
};

TEST_F(UriTest, FilesBesideTheSceneAreRead) {
    write_buffer("data.bin");
    EXPECT_EQ(error("data.bin"), "no error");
    fs::create_directories(folder() / "sub");
    write_buffer("sub/data.bin");
    EXPECT_EQ(error("./sub/data.bin"), "no error");
}

TEST_F(UriTest, NamesArePercentDecoded) {
    write_buffer("two words \xc3\xa4.bin");
    EXPECT_EQ(error("two%20words%20%C3%a4.bin"), "no error");
    EXPECT_EQ(error("two words %C3%A4.bin"), "no error");
}

TEST_F(UriTest, MissingFilesAreNamedAsNoInput) {
    const std::string message = error("absent.bin");
    EXPECT_NE(message.find("buffers[0]"), std::string::npos) << message;
    EXPECT_NE(message.find("absent.bin' does not exist (kind 66"), std::string::npos) << message;
}

TEST_F(UriTest, PathsThatLeaveTheFolderNeedAllowExternal) {
    fs::create_symlink(outside(), folder() / "link.bin");
    for (const std::string& uri :
         {std::string("../outside.bin"), std::string("%2e%2e/outside.bin"), outside().string(),
          std::string("link.bin"), "file://" + outside().string()}) {
        EXPECT_NE(error(uri).find("--allow-external"), std::string::npos) << uri << ": " << error(uri);
        EXPECT_EQ(error(uri, true), "no error") << uri;
    }
}

TEST_F(UriTest, TheNetworkIsNeverAsked) {
    for (const bool allow_external : {false, true}) {
        EXPECT_NE(error("http://example.com/a.bin", allow_external).find("scheme 'http'"), std::string::npos);
    }
}

TEST_F(UriTest, FilesBeyondTheLimitAreRefusedBeforeMemoryIsTaken) {
    write_buffer("data.bin");
    // Sparse: it takes no disk.
    fs::resize_file(folder() / "data.bin", core::kMaximumSceneFileBytes + 1);
    EXPECT_NE(error("data.bin").find("at most 4294967296 are read"), std::string::npos) << error("data.bin");
    EXPECT_NE(error(":").find("empty scheme"), std::string::npos);
}

TEST_F(UriTest, BackslashesAndNulAreRefused) {
    EXPECT_NE(error("sub%5Cdata.bin").find("backslash"), std::string::npos);
    EXPECT_NE(error("data.bin%00.png").find("NUL"), std::string::npos);
}

TEST_F(UriTest, PipesFoldersAndDevicesAreRefused) {
    ASSERT_EQ(mkfifo((folder() / "pipe").c_str(), 0600), 0);
    fs::create_directories(folder() / "sub");
    EXPECT_NE(error("pipe").find("not a regular file"), std::string::npos);
    EXPECT_NE(error("sub").find("not a regular file"), std::string::npos);
    EXPECT_NE(error("/dev/zero", true).find("not a regular file"), std::string::npos);
}

TEST_F(UriTest, MissingImagesAreNamed) {
    builder_.add("images", R"({"uri":"absent.png","name":"bricks"})");
    builder_.add("textures", R"({"source":0})");
    builder_.add("materials", R"({"normalTexture":{"index":0}})");
    write_buffer("data.bin");
    const std::string message = error("data.bin");
    EXPECT_NE(message.find("images[0] 'bricks'"), std::string::npos) << message;
    EXPECT_NE(message.find("(kind 66"), std::string::npos) << message;
}

TEST(GltfFiles, GlbHoldsTheSameSceneAsGltf) {
    const GltfBuilder builder = triangle_at_a_node();
    // Told apart by content: the name may say otherwise.
    const core::Scene binary = tests::load_text(builder.glb(), {}, "scene.gltf");
    EXPECT_EQ(core::scene_hash(binary), core::scene_hash(builder.load()));
    EXPECT_EQ(core::drawn_triangle_count(binary), 1u);
}

TEST(GltfFiles, EveryTruncationOfAGlbIsRefused) {
    const std::string whole = triangle_at_a_node().glb();
    for (std::size_t size = 0; size < whole.size(); size += size < 64 ? 1 : 37) {
        EXPECT_NE(tests::error_of_text(whole.substr(0, size)), "no error") << size;
    }
}

TEST(GltfFiles, OtherGlbVersionsAreRefused) {
    std::string file = triangle_at_a_node().glb();
    file[4] = 1;
    EXPECT_NE(tests::error_of_text(file).find("GLB version is 1"), std::string::npos);
}

TEST(GltfFiles, BuffersThatEndEarlyAreRefused) {
    GltfBuilder builder = triangle_at_a_node();
    const std::string error = tests::error_of_text(builder.json("data:;base64,AAAA"));
    EXPECT_NE(error.find("byteLength is 72, but the data ends after 3 bytes"), std::string::npos) << error;
}

TEST(GltfFiles, ABufferThatNothingDrawnNeedsMayBeBroken) {
    for (const char* broken : {R"({"byteLength":4})", R"({"byteLength":4,"uri":"absent.bin"})",
                               R"({"byteLength":0,"uri":"data:,"})", R"({"uri":"data:,abc"})", "7",
                               R"({"byteLength":4,"uri":"http://example.com/a.bin"})"}) {
        GltfBuilder builder = triangle_at_a_node();
        std::string text = builder.json();
        text.insert(text.find("\"buffers\":[") + 11, "{},");
        text.replace(text.find("{},"), 2, broken);
        // The triangle's views still name buffer 0, which is now the broken one.
        EXPECT_NE(tests::error_of_text(text), "no error") << broken;
        for (std::size_t at; (at = text.find("\"buffer\":0")) != std::string::npos;) text[at + 9] = '1';
        const core::Scene scene = tests::load_text(text);
        EXPECT_EQ(core::drawn_triangle_count(scene), 1u) << broken;
        ASSERT_EQ(scene.warnings.size(), 1u) << broken;
        EXPECT_NE(scene.warnings[0].find("buffers[0]"), std::string::npos) << scene.warnings[0];
    }
}

TEST(GltfFiles, AccessorsThatReachPastTheirViewAreRefusedBeforeMemoryIsTaken) {
    for (const char* count : {"4", "1000000000", "4611686018427387904", "18446744073709551615"}) {
        GltfBuilder builder;
        const int view = builder.add_view(std::vector<float>(9, 0.0f));
        builder.add(
            "accessors",
            fmt::format(R"({{"bufferView":{},"componentType":5126,"count":{},"type":"VEC3"}})", view, count));
        builder.add("nodes",
                    fmt::format(R"({{"mesh":{}}})", builder.add_mesh(R"({"attributes":{"POSITION":0}})")));
        EXPECT_NE(builder.error().find("do not fit its buffer view of 36 bytes"), std::string::npos)
            << builder.error();
    }
}

TEST(GltfFiles, ZerosWithoutABufferAreLimited) {
    GltfBuilder builder;
    builder.add("accessors", R"({"componentType":5126,"count":4611686018427387904,"type":"VEC3"})");
    builder.add("nodes",
                fmt::format(R"({{"mesh":{}}})", builder.add_mesh(R"({"attributes":{"POSITION":0}})")));
    EXPECT_NE(builder.error().find("but no buffer view"), std::string::npos) << builder.error();
}

TEST(GltfFiles, SmallFilesCannotAskForBoundlessMemory) {
    GltfBuilder builder;
    builder.add("accessors", R"({"componentType":5126,"count":4000000,"type":"VEC3"})");
    for (int i = 0; i < 40; ++i) {
        // Different accessors, so that the meshes are not shared.
        const int index = builder.add("accessors", R"({"componentType":5126,"count":4000000,"type":"VEC3"})");
        builder.add("nodes",
                    fmt::format(R"({{"mesh":{}}})", builder.add_mesh(fmt::format(
                                                        R"({{"attributes":{{"POSITION":{}}}}})", index))));
    }
    EXPECT_NE(builder.error().find("(kind 71"), std::string::npos) << builder.error();
}

TEST(GltfFiles, SmallPicturesCannotAskForBoundlessMemory) {
    // A header may promise what one colour would compress to. Nothing is decoded to see that it is too much.
    std::vector<std::uint8_t> png = tests::encode_png(64, 64, std::vector<std::uint8_t>(4 * 64 * 64));
    for (const std::size_t side : {16u, 20u}) {
        png[side + 2] = 8000 >> 8;
        png[side + 3] = 8000 & 255;
    }
    GltfBuilder builder = triangle_at_a_node();
    builder.add("images", fmt::format(R"({{"bufferView":{},"name":"bomb"}})", builder.add_view(png)));
    builder.add("textures", R"({"source":0})");
    builder.add("materials", R"({"normalTexture":{"index":0}})");
    EXPECT_NE(builder.error().find("images[0] 'bomb': the file unpacks to more than"), std::string::npos)
        << builder.error();
    EXPECT_NE(builder.error().find("(kind 71"), std::string::npos) << builder.error();
}

TEST(GltfFiles, MorphTargetsOfOneAccessorCannotAskForBoundlessTime) {
    GltfBuilder builder;
    builder.add("accessors", R"({"componentType":5126,"count":900000,"type":"VEC3"})");
    std::string targets = R"({"POSITION":0})", weights = "1";
    for (int i = 0; i < 1000; ++i) {
        targets += R"(,{"POSITION":0})";
        weights += ",1";
    }
    const int mesh = builder.add(
        "meshes",
        fmt::format(R"({{"weights":[{}],"primitives":[{{"attributes":{{"POSITION":0}},"targets":[{}]}}]}})",
                    weights, targets));
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    EXPECT_NE(builder.error().find("(kind 71"), std::string::npos) << builder.error();
}

/// The same tree of nodes costs by how often it refers to a mesh, not only by what the mesh holds.
TEST(GltfFiles, ManyNodesWithManyPrimitivesCannotAskForBoundlessMemory) {
    GltfBuilder builder = triangle_at_a_node();
    std::string primitives = R"({"attributes":{"POSITION":0}})";
    for (int i = 0; i < 2000; ++i) primitives += R"(,{"attributes":{"POSITION":0}})";
    const int mesh = builder.add("meshes", fmt::format(R"({{"primitives":[{}]}})", primitives));
    for (int i = 0; i < 50'000; ++i) builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    EXPECT_NE(builder.error().find("(kind 71"), std::string::npos) << builder.error();
}

TEST(GltfFiles, WarningsOfABrokenFileAreFew) {
    GltfBuilder builder = triangle_at_a_node();
    std::string primitives = R"({"attributes":{}})";
    for (int i = 0; i < 100'000; ++i) primitives += R"(,{"attributes":{}})";
    const int mesh = builder.add("meshes", fmt::format(R"({{"primitives":[{}]}})", primitives));
    builder.add("nodes", fmt::format(R"({{"mesh":{}}})", mesh));
    const core::Scene scene = builder.load();
    ASSERT_EQ(scene.warnings.size(), core::WarningList::kMost + 1);
    EXPECT_NE(scene.warnings.back().find("more warnings"), std::string::npos);
}

TEST(GltfFiles, JsonThatWouldTakeTooMuchMemoryIsRefusedBeforeItIsBuilt) {
    std::string text = R"({"asset":{"version":"2.0"},"extras":{"a":0)";
    for (int i = 0; i < 3'000'000; ++i) text += R"(,"a":0)";
    EXPECT_NE(tests::error_of_text(text + "}}").find("JSON would take more than"), std::string::npos);
}

TEST(GltfFiles, DeepJsonIsRefusedBeforeItIsBuilt) {
    const std::string deep = std::string(10000, '[') + std::string(10000, ']');
    EXPECT_NE(tests::error_of_text(R"({"asset":)" + deep + "}").find("nested more than 200"),
              std::string::npos);
    const std::string in_a_string =
        R"({"asset":{"version":"2.0","copyright":")" + std::string(10000, '[') + "\"}}";
    EXPECT_EQ(tests::error_of_text(in_a_string), "no error");
}

TEST(GltfFiles, OtherVersionsAndOtherFilesAreRefused) {
    EXPECT_NE(tests::error_of_text(R"({"asset":{"version":"1.0"}})").find("is '1.0'; 2.x is read"),
              std::string::npos);
    for (const char* other : {"", "[]", "gl", "solid cube"}) {
        EXPECT_NE(tests::error_of_text(other).find("begins neither with 'glTF'"), std::string::npos) << other;
    }
    EXPECT_NE(tests::error_of_text("{").find("not valid JSON: parse error at line 1"), std::string::npos)
        << tests::error_of_text("{");
    EXPECT_NE(error_of_file("no/such/scene.gltf").find("(kind 66"), std::string::npos);
}

TEST(GltfFiles, BufferViewsOutsideTheirBufferAreRefused) {
    GltfBuilder builder;
    builder.add_view(std::vector<float>(9, 0.0f));
    builder.add("bufferViews", R"({"buffer":0,"byteOffset":18446744073709551615,"byteLength":36})");
    builder.add_accessor(1, GltfBuilder::kFloat, 3, "VEC3");
    builder.add("nodes",
                fmt::format(R"({{"mesh":{}}})", builder.add_mesh(R"({"attributes":{"POSITION":0}})")));
    EXPECT_NE(builder.error().find("lie outside a buffer of 36 bytes"), std::string::npos) << builder.error();
}

TEST(GltfFiles, Base64RoundTripsAndRefusesOtherCharacters) {
    std::vector<std::uint8_t> bytes;
    for (int size = 0; size < 70; ++size) {
        EXPECT_EQ(core::base64_decoded(tests::encode_base64(bytes)), bytes);
        bytes.push_back(static_cast<std::uint8_t>(37 * size + 1));
    }
    EXPECT_FALSE(core::base64_decoded("AA*A").has_value());
    EXPECT_FALSE(core::base64_decoded("AAAAA").has_value());
}

}  // namespace
