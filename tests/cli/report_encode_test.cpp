// tests/cli/report_encode_test.cpp: values, maps and colours as the page holds them, decoded again.
#include "cli/report_encode.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "cli/report_colors.h"
#include "core/image/png.h"
#include "core/image/tonemap.h"
#include "core/support/file_bytes.h"
#include "tests/cli/sample_report.h"
#include "tests/support/shared_data.h"

namespace {

std::string from_base64(const std::string& text) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    std::uint32_t group = 0;
    int bits = 0;
    for (const char letter : text) {
        if (letter == '=') break;
        group = group << 6 | static_cast<std::uint32_t>(digits.find(letter));
        bits += 6;
        if (bits < 8) continue;
        bits -= 8;
        bytes += static_cast<char>(group >> bits & 0xFFu);
    }
    return bytes;
}

std::string inflated(const std::string& bytes, std::size_t size) {
    std::string result(size, '\0');
    uLongf length = size;
    EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(result.data()), &length,
                         reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size())),
              Z_OK);
    EXPECT_EQ(length, size);
    return result;
}

TEST(ReportEncode, WritesBase64OfTheStandard) {
    // The examples of RFC 4648, section 10.
    EXPECT_EQ(cli::base64(""), "");
    EXPECT_EQ(cli::base64("f"), "Zg==");
    EXPECT_EQ(cli::base64("fo"), "Zm8=");
    EXPECT_EQ(cli::base64("foo"), "Zm9v");
    EXPECT_EQ(cli::base64("foob"), "Zm9vYg==");
    EXPECT_EQ(cli::base64("foobar"), "Zm9vYmFy");
    EXPECT_EQ(cli::base64("\xFF\xFE\xFB"), "//77");
}

TEST(ReportEncode, KeepsEveryBitOfAColour) {
    std::vector<glm::vec3> colors = tests::noisy_picture("", 31, 7, 1).radiance;
    colors.emplace_back(-0.0f, std::numeric_limits<float>::denorm_min(),
                        std::numeric_limits<float>::infinity());
    colors.emplace_back(std::bit_cast<float>(0x7FC12345u), -1.0f / 3.0f, std::numeric_limits<float>::max());
    const std::size_t count = colors.size();
    const std::string runs = inflated(from_base64(cli::encode_colors(colors)), 12 * count);
    for (std::size_t i = 0; i < count; ++i) {
        for (int channel = 0; channel < 3; ++channel) {
            std::uint32_t bits = 0;
            for (std::size_t byte = 0; byte < 4; ++byte)
                bits |= static_cast<std::uint32_t>(static_cast<unsigned char>(
                            runs[(4 * static_cast<std::size_t>(channel) + byte) * count + i]))
                        << (8 * byte);
            EXPECT_EQ(bits, std::bit_cast<std::uint32_t>(colors[i][channel])) << i << ", channel " << channel;
        }
    }
}

TEST(ReportEncode, RoundsMapsToSteps) {
    const std::vector<float> values = {0.0f, 1.0f,          0.5f,      -3.0f,
                                       7.0f, std::nanf(""), HUGE_VALF, 1.0f / 65534.0f};
    const std::string runs = inflated(from_base64(cli::encode_map(values, 1.0f)), 2 * values.size());
    std::vector<unsigned> codes;
    for (std::size_t i = 0; i < values.size(); ++i)
        codes.push_back(static_cast<unsigned char>(runs[i]) +
                        256u * static_cast<unsigned char>(runs[values.size() + i]));
    EXPECT_EQ(codes, (std::vector<unsigned>{0, 65534, 32767, 0, 65534, 65535, 65535, 1}));
    EXPECT_TRUE(cli::encode_map({}, 1.0f).size() > 0) << "an empty stream is still a stream";
}

TEST(ReportColors, ThresholdsGiveTheLevelsOfTheProgramsPreview) {
    const auto thresholds = cli::tone_thresholds();
    EXPECT_TRUE(std::is_sorted(thresholds.begin(), thresholds.end()));
    std::vector<float> values = {0.0f, -1.0f, 1e6f, 1e30f, 1e-30f};
    for (const float threshold : thresholds) {
        values.push_back(threshold);
        values.push_back(std::nextafter(threshold, 0.0f));
        values.push_back(std::nextafter(threshold, 10.0f));
    }
    std::mt19937 random(7);
    std::uniform_real_distribution<float> exponent(-14.0f, 8.0f);
    for (int i = 0; i < 20'000; ++i) values.push_back(std::exp2(exponent(random)));
    std::vector<glm::vec3> pixels;
    for (const float ev : {0.0f, 7.3f, -4.0f}) {
        const float scale = core::exposure_scale(ev);
        pixels.clear();
        for (const float value : values) pixels.emplace_back(value);
        const auto bytes = core::display_picture(pixels, ev, core::ToneMap::kAces);
        for (std::size_t i = 0; i < values.size(); ++i) {
            // What the viewer does: count the thresholds that are not above the exposed value.
            const auto level = std::upper_bound(thresholds.begin(), thresholds.end(), values[i] * scale) -
                               thresholds.begin();
            ASSERT_EQ(level, bytes[3 * i]) << values[i] << " at EV " << ev;
        }
    }
}

TEST(ReportColors, HeatMapsRiseInLuminanceFromEndToEnd) {
    using Color = std::array<std::uint8_t, 3>;
    EXPECT_EQ(cli::heat_color(cli::HeatMap::kMagma, 0.0f), (Color{0, 0, 4}));
    EXPECT_EQ(cli::heat_color(cli::HeatMap::kMagma, 2.0f), (Color{252, 253, 191}));
    EXPECT_EQ(cli::heat_color(cli::HeatMap::kViridis, -1.0f), (Color{68, 1, 84}));
    EXPECT_EQ(cli::heat_color(cli::HeatMap::kViridis, 1.0f), (Color{253, 231, 37}));
    for (const cli::HeatMap map : {cli::HeatMap::kMagma, cli::HeatMap::kViridis}) {
        EXPECT_EQ(cli::heat_color(map, std::nanf("")), (Color{255, 0, 255})) << "broken pixels are seen";
        double previous = -1.0;
        for (int i = 0; i <= 50; ++i) {
            const Color color = cli::heat_color(map, static_cast<float>(i) / 50.0f);
            const double luminance = 0.2126 * std::pow(color[0] / 255.0, 2.2) +
                                     0.7152 * std::pow(color[1] / 255.0, 2.2) +
                                     0.0722 * std::pow(color[2] / 255.0, 2.2);
            EXPECT_GT(luminance, previous) << i;
            previous = luminance;
        }
    }
}

TEST(ReportColors, ScalesPlaceValuesBetweenTheirEnds) {
    EXPECT_FLOAT_EQ(cli::kErrorScale.at(0.001f), 0.0f);
    EXPECT_FLOAT_EQ(cli::kErrorScale.at(1.0f), 1.0f);
    EXPECT_NEAR(cli::kErrorScale.at(0.01f), 1.0f / 3.0f, 1e-6f) << "a third of three decades";
    EXPECT_FLOAT_EQ(cli::kErrorScale.at(0.0f), 0.0f);
    EXPECT_TRUE(std::isnan(cli::kErrorScale.at(HUGE_VALF)));
    std::vector<float> steps(2000, 18.0f);
    steps[5] = 900.0f;
    EXPECT_FLOAT_EQ(cli::steps_scale(steps).high, 20.0f) << "one in two thousand does not count";
    EXPECT_FLOAT_EQ(cli::steps_scale({}).high, 1.0f);
    EXPECT_FLOAT_EQ(cli::steps_scale({std::nanf("")}).high, 1.0f);
}

TEST(Png, IsTheSameInMemoryAndInAFile) {
    const tests::TemporaryFolder folder;
    const std::vector<std::uint8_t> rgb = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    core::write_png(folder.path() / "a.png", 2, 2, rgb);
    const auto bytes = core::read_file_bytes(folder.path() / "a.png", 1 << 20);
    EXPECT_EQ(core::encode_png(2, 2, rgb), std::string(bytes.begin(), bytes.end()));
}

}  // namespace
