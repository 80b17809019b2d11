// tests/core/image/hdr_test.cpp: Radiance pictures, byte by byte.
#include "core/image/hdr.h"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <vector>

#include "core/support/error.h"
#include "core/support/file_bytes.h"
#include "tests/support/shared_data.h"

namespace {

std::vector<std::uint8_t> file_of(const std::string& header, std::initializer_list<int> data) {
    std::vector<std::uint8_t> bytes(header.begin(), header.end());
    for (const int value : data) bytes.push_back(static_cast<std::uint8_t>(value));
    return bytes;
}

std::string header(const std::string& resolution, const std::string& lines = "FORMAT=32-bit_rle_rgbe\n") {
    return "#?RADIANCE\n# a comment\n" + lines + "\n" + resolution + "\n";
}

std::string refusal(const std::vector<std::uint8_t>& bytes) {
    try {
        core::decode_hdr(bytes, "sky.hdr");
    } catch (const core::InputError& error) {
        EXPECT_EQ(error.kind(), core::ErrorKind::kBadData);
        EXPECT_EQ(std::string(error.what()).find("'sky.hdr': "), 0u) << error.what();
        return error.what();
    }
    return "";
}

TEST(Hdr, ReadsFlatPixelsExactly) {
    // 128 / 256 x 2^(129 - 128) = 1; an exponent of 0 is black whatever the mantissas say.
    const core::Image image = core::decode_hdr(
        file_of(header("-Y 1 +X 3"), {128, 64, 32, 129, 255, 0, 1, 136, 9, 9, 9, 0}), "sky.hdr");
    EXPECT_EQ(*image.find("R"), (std::vector<float>{1.0f, 255.0f, 0.0f}));
    EXPECT_EQ(*image.find("G"), (std::vector<float>{0.5f, 0.0f, 0.0f}));
    EXPECT_EQ(*image.find("B"), (std::vector<float>{0.25f, 1.0f, 0.0f}));
}

TEST(Hdr, ReadsRunsByComponentRowByRow) {
    // Each row: 2, 2, width; red a run of 8, green literal, blue a run and literals, exponent a run.
    const core::Image image = core::decode_hdr(
        file_of(header("-Y 2 +X 8"), {2, 2, 0, 8,   136, 7, 8, 1, 2, 3,   4, 5,   6, 7,   8, 133, 4,  3,
                                      1, 2, 3, 136, 136, 2, 2, 0, 8, 136, 9, 136, 0, 136, 0, 136, 137}),
        "sky.hdr");
    ASSERT_EQ(image.width(), 8);
    ASSERT_EQ(image.height(), 2);
    EXPECT_EQ((*image.find("R"))[7], 7.0f);
    EXPECT_EQ((*image.find("R"))[8], 18.0f);
    EXPECT_EQ((*image.find("G"))[3], 4.0f);
    EXPECT_EQ((*image.find("B"))[4], 4.0f);
    EXPECT_EQ((*image.find("B"))[7], 3.0f);
}

TEST(Hdr, ReadsOldRunsOfWholePixels) {
    const core::Image image =
        core::decode_hdr(file_of(header("-Y 1 +X 5"), {6, 0, 0, 136, 1, 1, 1, 3, 7, 0, 0, 136}), "sky.hdr");
    EXPECT_EQ(*image.find("R"), (std::vector<float>{6, 6, 6, 6, 7}));
}

TEST(Hdr, DividesByTheProductOfAllExposures) {
    const core::Image image = core::decode_hdr(
        file_of(header("-Y 1 +X 1", "EXPOSURE=4\nFORMAT=32-bit_rle_rgbe\nEXPOSURE= 0.5\n"), {128, 0, 0, 129}),
        "sky.hdr");
    EXPECT_EQ((*image.find("R"))[0], 0.5f);
}

TEST(Hdr, RefusesByName) {
    EXPECT_NE(refusal(file_of("P6\n", {})).find("#?"), std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 1 +X 1", "FORMAT=32-bit_rle_xyze\n"), {1, 1, 1, 1})).find("xyze"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("+Y 1 +X 1"), {1, 1, 1, 1})).find("resolution line '+Y 1 +X 1'"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 1 +X 1 9"), {1, 1, 1, 1})).find("resolution line"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 99999999 +X 99999999"), {})).find("99999999 x 99999999"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 60000 +X 4000"), {1, 1, 1, 1})).find("bytes can hold"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 0 +X 4"), {1, 1, 1, 1})).find("4 x 0 pixels"), std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 1 +X 1", "EXPOSURE=-1\n"), {1, 1, 1, 1})).find("EXPOSURE=-1"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 1 +X 8"), {2, 2, 0, 9, 137, 7})).find("claims 9 pixels"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 1 +X 8"), {2, 2, 0, 8, 137, 7})).find("a run of 9 values where 8"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 1 +X 8"), {2, 2, 0, 8, 0, 0, 0})).find("a run of 0 values"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 1 +X 4"), {5, 0, 0, 136, 1, 1, 1, 9})).find("beyond its 4 pixels"),
              std::string::npos);
    EXPECT_NE(refusal(file_of(header("-Y 1 +X 4"), {1, 1, 1, 2})).find("repeats a pixel"), std::string::npos);
}

TEST(Hdr, RefusesARealSkyCutShortAnywhere) {
    FIELDLIGHT_NEED_SHARED(path, "scenes/skies/spiaggia_di_mondello_1k.hdr");
    std::vector<std::uint8_t> bytes = core::read_file_bytes(path, 1 << 24);
    const core::Image image = core::decode_hdr(bytes, "sky.hdr");
    EXPECT_EQ(image.width(), 1024);
    EXPECT_EQ(image.height(), 512);
    EXPECT_EQ(core::count_nonfinite(image), 0u);
    float largest = 0.0f, smallest = std::numeric_limits<float>::infinity();
    for (const float value : *image.find("R")) {
        largest = std::max(largest, value);
        smallest = std::min(smallest, value);
    }
    // The sun stands in the picture and nothing is negative.
    EXPECT_GT(largest, 1000.0f);
    EXPECT_GE(smallest, 0.0f);
    for (const std::size_t length : {std::size_t{0}, std::size_t{5}, std::size_t{60}, std::size_t{200},
                                     bytes.size() / 2, bytes.size() - 1}) {
        EXPECT_NE(refusal({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length)}), "")
            << length;
    }
}

}  // namespace
