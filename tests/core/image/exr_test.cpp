// tests/core/image/exr_test.cpp: what is written is what is read, to the bit.
#include "core/image/exr.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>

#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

core::Image noise_image(int width, int height, std::initializer_list<const char*> names) {
    std::mt19937 random(3);
    std::lognormal_distribution<float> values(0.0f, 4.0f);
    core::Image image(width, height);
    for (const char* name : names) {
        for (float& value : image.add_channel(name)) value = values(random);
    }
    return image;
}

std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Exr, ReadsBackEveryBitOfEveryFloatChannel) {
    const tests::TemporaryFolder folder;
    core::Image image = noise_image(67, 35, {"R", "G", "B", "A", "Depth.Z", "Normal.X", "Variance.R"});
    (*image.find("Depth.Z"))[3] = kInfinity;
    (*image.find("R"))[5] = kNaN;
    (*image.find("G"))[6] = std::numeric_limits<float>::denorm_min();
    (*image.find("B"))[7] = -0.0f;
    EXPECT_EQ(core::write_exr(folder.path() / "a.exr", image), 0u);
    const core::ExrFile file = core::read_exr_file(folder.path() / "a.exr");
    EXPECT_EQ(file.info.width, 67);
    EXPECT_EQ(file.info.height, 35);
    EXPECT_EQ(file.info.compression, "zip");
    EXPECT_FALSE(file.info.tiled);
    ASSERT_EQ(file.image.channels().size(), image.channels().size());
    for (const core::Channel& channel : image.channels()) {
        ASSERT_NE(file.image.find(channel.name), nullptr) << channel.name;
        EXPECT_TRUE(same_bits(*file.image.find(channel.name), channel.values)) << channel.name;
    }
    EXPECT_EQ(file.image.channels()[0].name, "R");
    EXPECT_EQ(file.image.channels()[3].name, "A");
}

TEST(Exr, WritesTheSameBytesForTheSamePicture) {
    const tests::TemporaryFolder folder;
    const core::Image image = noise_image(20, 20, {"R", "G", "B"});
    core::write_exr(folder.path() / "a.exr", image, {{"seed", std::string("1")}});
    core::write_exr(folder.path() / "b.exr", image, {{"seed", std::string("1")}});
    EXPECT_EQ(bytes_of(folder.path() / "a.exr"), bytes_of(folder.path() / "b.exr"));
}

TEST(Exr, KeepsAttributesAndRec709) {
    const tests::TemporaryFolder folder;
    glm::mat4 matrix(1.0f);
    matrix[3] = {5, 6, 7, 1};  // A translation: GLM's last column.
    core::write_exr(folder.path() / "a.exr", noise_image(2, 2, {"R"}),
                    {{"seed", std::string("18446744073709551615")},
                     {"samplesPerPixel", 16.5f},
                     {"bounces", -1},
                     {"worldToCamera", matrix}});
    const core::ExrInfo info = core::read_exr_info(folder.path() / "a.exr");
    EXPECT_EQ(info.attributes.at("seed"), "18446744073709551615");
    EXPECT_EQ(info.attributes.at("samplesPerPixel"), "16.5");
    EXPECT_EQ(info.attributes.at("bounces"), "-1");
    // OpenEXR's matrices act on row vectors: the translation stands in the last row.
    EXPECT_EQ(info.attributes.at("worldToCamera"), "1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1");
    EXPECT_EQ(info.attributes.at("chromaticities"),
              "red 0.64 0.33, green 0.3 0.6, blue 0.15 0.06, white 0.3127 0.329");
}

TEST(Exr, HalfIsForColoursAlone) {
    const tests::TemporaryFolder folder;
    core::write_exr(folder.path() / "a.exr",
                    noise_image(4, 4, {"R", "A", "Albedo.G", "Variance.R", "Depth.Z", "Normal.X"}), {}, true);
    for (const core::ExrChannelInfo& channel : core::read_exr_info(folder.path() / "a.exr").channels) {
        const bool color = channel.name == "R" || channel.name == "A" || channel.name == "Albedo.G";
        EXPECT_EQ(channel.type, color ? "half" : "float") << channel.name;
    }
}

TEST(Exr, HalfSaturatesAndCountsFiniteValuesAndKeepsTheRest) {
    const tests::TemporaryFolder folder;
    core::Image image(8, 1);
    image.add_channel("R", {65504.0f, 65505.0f, 1e30f, -1e6f, kInfinity, -kInfinity, kNaN, 1.0f});
    image.add_channel("Depth.Z", std::vector<float>(8, 1e30f));
    EXPECT_EQ(core::write_exr(folder.path() / "a.exr", image, {}, true), 3u);
    const core::Image read = core::read_exr(folder.path() / "a.exr");
    const std::vector<float>& red = *read.find("R");
    const float max = core::kMaxHalf;
    EXPECT_EQ((std::vector<float>(red.begin(), red.begin() + 6)),
              (std::vector<float>{max, max, max, -max, kInfinity, -kInfinity}));
    EXPECT_TRUE(std::isnan(red[6]));
    EXPECT_EQ(red[7], 1.0f);
    EXPECT_EQ((*read.find("Depth.Z"))[0], 1e30f);
}

TEST(Exr, HalfRoundsByAtMostHalfAUnitOfItsElevenBits) {
    const tests::TemporaryFolder folder;
    core::Image image(1000, 1);
    std::vector<float>& red = image.add_channel("R");
    for (std::size_t i = 0; i < red.size(); ++i) red[i] = 0.001f * std::pow(1.017f, static_cast<float>(i));
    core::write_exr(folder.path() / "a.exr", image, {}, true);
    const core::Image read = core::read_exr(folder.path() / "a.exr");
    for (std::size_t i = 0; i < red.size(); ++i) {
        ASSERT_LE(std::abs((*read.find("R"))[i] - red[i]), std::ldexp(red[i], -11)) << red[i];
    }
}

TEST(Exr, AFailedWriteLeavesTheOldFile) {
    const tests::TemporaryFolder folder;
    EXPECT_THROW(core::write_exr(folder.path() / "missing" / "a.exr", noise_image(2, 2, {"R"})),
                 core::InputError);
    EXPECT_TRUE(fs::is_empty(folder.path()));
}

// Real files of other programs, each with a feature of its own.

TEST(Exr, ReadsAllHalfValues) {
    FIELDLIGHT_NEED_SHARED(path, "scenes/exr/AllHalfValues.exr");
    const core::Image image = core::read_exr(path);
    ASSERT_EQ(image.pixel_count(), 65536u);
    // All 65,536 halves, among them 2 x 1,023 NaNs and two infinities: per channel.
    EXPECT_EQ(core::count_nonfinite(image), 3u * (2 * 1023 + 2));
    float largest = 0.0f;
    for (const float value : *image.find("G")) {
        if (std::isfinite(value)) largest = std::max(largest, value);
    }
    EXPECT_EQ(largest, core::kMaxHalf);
}

TEST(Exr, ReadsLevelZeroOfTiledMipmaps) {
    FIELDLIGHT_NEED_SHARED(path, "scenes/exr/ColorCodedLevels.exr");
    const core::ExrFile file = core::read_exr_file(path);
    EXPECT_TRUE(file.info.tiled);
    EXPECT_EQ(file.image.width(), 512);
    EXPECT_EQ(file.image.height(), 512);
    EXPECT_TRUE(file.image.color());
}

TEST(Exr, ReadsASkyInTiles) {
    FIELDLIGHT_NEED_SHARED(path, "scenes/skies/OrientationLatLong.exr");
    const core::Image image = core::read_exr(path);
    EXPECT_EQ(image.width(), 1024);
    EXPECT_EQ(image.height(), 512);
    EXPECT_EQ(core::count_nonfinite(image), 0u);
}

TEST(Exr, ReadsFloatAndSingleChannelFiles) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/exr");
    const core::ExrFile wide = core::read_exr_file(folder / "WideFloatRange.exr");
    EXPECT_EQ(wide.info.channels.at(0).type, "float");
    EXPECT_EQ(wide.image.width(), 500);
    const core::Image gray = core::read_exr(folder / "GrayRampsHorizontal.exr");
    EXPECT_NE(gray.find("Y"), nullptr);
    EXPECT_FALSE(gray.color());
}

TEST(Exr, ReadsEverySharedFile) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/exr");
    int count = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ".exr") continue;
        const core::ExrFile file = core::read_exr_file(entry.path());
        EXPECT_GT(file.image.pixel_count(), 0u) << entry.path();
        EXPECT_EQ(file.image.channels().size(), file.info.channels.size()) << entry.path();
        ++count;
    }
    EXPECT_GE(count, 8);
}

}  // namespace
