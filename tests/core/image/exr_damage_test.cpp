// tests/core/image/exr_damage_test.cpp: hostile EXR files end in an InputError that names them, never worse.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <random>
#include <string>

#include "core/image/exr.h"
#include "core/image/exr_scan.h"
#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

/// The message that reading ends in, or nothing where it ends well. Anything but kBadData fails the test.
std::optional<std::string> refusal(const fs::path& path) {
    try {
        core::read_exr_file(path);
        return std::nullopt;
    } catch (const core::InputError& error) {
        EXPECT_EQ(error.kind(), core::ErrorKind::kBadData) << error.what();
        EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
        return error.what();
    }
}

std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::string sample_bytes(const fs::path& folder) {
    core::Image image(9, 5);
    for (const char* name : {"R", "G", "B"}) {
        std::vector<float>& values = image.add_channel(name);
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
    }
    core::write_exr(folder / "sample.exr", image, {{"seed", std::string("1")}});
    return bytes_of(folder / "sample.exr");
}

/// Where the value of an attribute starts: after its name, type and size.
std::size_t value_position(const std::string& bytes, const std::string& name, const std::string& type) {
    const std::string head = name + std::string(1, '\0') + type + std::string(1, '\0');
    const std::size_t found = bytes.find(head);
    EXPECT_NE(found, std::string::npos);
    return found + head.size() + 4;
}

void put_i32(std::string& bytes, std::size_t position, std::int32_t value) {
    std::memcpy(bytes.data() + position, &value, 4);
}

TEST(ExrDamage, EveryRealDamagedFileIsRefusedByName) {
    FIELDLIGHT_NEED_SHARED(folder, "scenes/invalid/exr_damaged");
    int count = 0;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ".exr") continue;
        EXPECT_TRUE(refusal(entry.path())) << entry.path() << " was read";
        ++count;
    }
    EXPECT_GE(count, 21);
}

TEST(ExrDamage, AMissingFileIsNoInput) {
    try {
        core::read_exr("missing.exr");
        FAIL();
    } catch (const core::InputError& error) {
        EXPECT_EQ(error.kind(), core::ErrorKind::kNoInput);
    }
}

TEST(ExrDamage, EveryTruncationIsRefused) {
    const tests::TemporaryFolder folder;
    const std::string bytes = sample_bytes(folder.path());
    const fs::path path = folder.path() / "short.exr";
    for (std::size_t length = 0; length < bytes.size(); ++length) {
        std::ofstream(path, std::ios::binary) << bytes.substr(0, length);
        ASSERT_TRUE(refusal(path)) << length << " of " << bytes.size() << " bytes were read";
    }
}

TEST(ExrDamage, FlippedBytesNeverEndWorseThanInARefusal) {
    const tests::TemporaryFolder folder;
    const std::string bytes = sample_bytes(folder.path());
    const fs::path path = folder.path() / "flipped.exr";
    std::mt19937 random(11);
    int refused = 0;
    for (int i = 0; i < 3000; ++i) {
        std::string flipped = bytes;
        for (unsigned n = 0; n <= random() % 3; ++n)
            flipped[random() % bytes.size()] ^= static_cast<char>(1 + random() % 255);
        std::ofstream(path, std::ios::binary) << flipped;
        refused += refusal(path).has_value();
    }
    // Most of such a small file is header and compressed data with a checksum.
    EXPECT_GT(refused, 1000);
}

struct Patch {
    const char* what;
    std::function<void(std::string&)> apply;
    const char* message;
};

TEST(ExrDamage, ClaimsBeyondTheLimitsAreRefusedBeforeMemoryIsTaken) {
    const tests::TemporaryFolder folder;
    const std::string bytes = sample_bytes(folder.path());
    const std::size_t window = value_position(bytes, "dataWindow", "box2i");
    const std::size_t channels = value_position(bytes, "channels", "chlist");
    const Patch patches[] = {
        {"width", [=](std::string& b) { put_i32(b, window + 8, 100'000); }, "100001 x 5 pixels"},
        {"pixels",
         [=](std::string& b) {
             put_i32(b, window + 8, 65'000);
             put_i32(b, window + 12, 65'000);
         },
         "65001 x 65001 pixels"},
        {"more than the bytes hold", [=](std::string& b) { put_i32(b, window + 8, 60'000); },
         "bytes can hold"},
        {"far away", [=](std::string& b) { put_i32(b, window, -2'000'000'000); }, "reaches to -2000000000"},
        {"empty", [=](std::string& b) { put_i32(b, window + 8, -1); }, "dataWindow is empty"},
        {"sampling", [=](std::string& b) { put_i32(b, channels + 10, 0); }, "channel 'B' has sampling 0 x 1"},
        {"subsampled", [=](std::string& b) { put_i32(b, channels + 10, 3); },
         "channel 'B' has one sample every 3 x 1"},
        {"type", [=](std::string& b) { put_i32(b, channels + 2, 7); }, "unknown type 7"},
        {"attribute size", [=](std::string& b) { put_i32(b, channels - 4, 0x7fffffff); },
         "attribute 'channels' claims 2147483647 bytes"},
        {"deep", [](std::string& b) { b[5] = 0x08; }, "deep data"},
        {"multi-part", [](std::string& b) { b[5] = 0x10; }, "multi-part"},
        {"tiled without tiles", [](std::string& b) { b[5] = 0x02; }, "no size of tiles"},
        {"version", [](std::string& b) { b[4] = 9; }, "version 9"},
        {"magic", [](std::string& b) { b[0] = 'x'; }, "magic number"},
    };
    for (const Patch& patch : patches) {
        std::string patched = bytes;
        patch.apply(patched);
        const fs::path path = folder.path() / "patched.exr";
        core::write_text_atomically(path, patched);
        const std::optional<std::string> message = refusal(path);
        ASSERT_TRUE(message) << patch.what;
        EXPECT_NE(message->find(patch.message), std::string::npos) << patch.what << ": " << *message;
    }
}

TEST(ExrDamage, AttributesThatOpenExrWouldReadPastTheirEndAreRefused) {
    const tests::TemporaryFolder folder;
    const std::string bytes = sample_bytes(folder.path());
    const fs::path path = folder.path() / "inserted.exr";
    const auto refusal_of = [&](const std::string& type, const std::string& value) {
        std::string size(4, '\0');
        put_i32(size, 0, static_cast<std::int32_t>(value.size()));
        const std::string zero(1, '\0');
        core::write_text_atomically(path,
                                    std::string(bytes).insert(8, "odd" + zero + type + zero + size + value));
        try {
            core::read_exr_info(path);  // The chunks have moved; the header alone is whole.
        } catch (const core::InputError& error) {
            return std::string(error.what());
        }
        return std::string("was read");
    };
    const std::string channel = std::string("X\0", 2) + std::string("\2\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0", 16);
    const std::string zero(1, '\0');
    EXPECT_EQ(refusal_of("chlist", channel + zero), "was read")
        << "a second list of channels is none of ours";
    EXPECT_NE(refusal_of("chlist", channel + zero + "more").find("ends elsewhere"), std::string::npos);
    EXPECT_NE(refusal_of("chlist", channel).find("list of channels"), std::string::npos);
    EXPECT_NE(refusal_of("float", "123456").find("has 6 bytes; 4 are right"), std::string::npos);
    EXPECT_NE(refusal_of("floatvector", "12345").find("5 bytes of floats"), std::string::npos);
    const std::string one_text("\3\0\0\0abc", 7);
    EXPECT_EQ(refusal_of("stringvector", one_text + one_text), "was read");
    EXPECT_NE(refusal_of("stringvector", one_text + "\xff\xff\xff\xff").find("longer than it"),
              std::string::npos);
    EXPECT_EQ(refusal_of("unheard_of", "anything"), "was read");
}

TEST(ExrDamage, ADataWindowBesideTheOriginIsReadWhereItLies) {
    const tests::TemporaryFolder folder;
    std::string bytes = sample_bytes(folder.path());
    // Shifting the window alone is not enough: each chunk names its first row.
    const std::size_t window = value_position(bytes, "dataWindow", "box2i");
    put_i32(bytes, window, -3);
    put_i32(bytes, window + 8, 5);
    const fs::path path = folder.path() / "shifted.exr";
    core::write_text_atomically(path, bytes);
    const core::ExrFile shifted = core::read_exr_file(path);
    EXPECT_EQ(shifted.info.data_window, (core::ExrWindow{-3, 0, 5, 4}));
    EXPECT_EQ(shifted.info.display_window, (core::ExrWindow{0, 0, 8, 4}));
    EXPECT_EQ(*shifted.image.find("R"), *core::read_exr(folder.path() / "sample.exr").find("R"));
}

}  // namespace
