// tests/sdf/vdb_scan_test.cpp: what OpenVDB writes passes the scan; what would harm it does not.
#include "sdf/vdb_scan.h"

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "core/support/error.h"
#include "tests/support/shared_data.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

std::string refusal(const std::string& bytes) {
    try {
        sdf::scan_vdb({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, "x.vdb");
        return "";
    } catch (const core::InputError& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("'x.vdb': ")) << error.what();
        return error.what();
    }
}

std::string written(const openvdb::GridCPtrVec& grids, std::uint32_t compression) {
    const TemporaryFolder folder;
    const fs::path path = folder.path() / "grids.vdb";
    {
        openvdb::io::File file(path.string());
        file.setCompression(compression);
        file.write(grids, openvdb::MetaMap());
    }
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// A grid with active and inactive values in two leaves and tiles on every level. Other types of values are
/// among the seeds of tests/fuzz: compiling them here would take minutes.
openvdb::FloatGrid::Ptr sample_grid() {
    openvdb::initialize();
    const auto grid = openvdb::FloatGrid::create(0.0f);
    auto& tree = grid->tree();
    for (int i = 0; i < 300; ++i) {
        const openvdb::Coord voxel(i * 7 % 8, i * 5 % 8 - 8, i % 8);
        const auto value = static_cast<float>(i % 3);
        if (i % 4 == 0) {
            tree.setValueOff(voxel, value);
        } else {
            tree.setValueOn(voxel, value);
        }
    }
    tree.addTile(1, openvdb::Coord(16, 0, 0), 1.0f, true);
    tree.addTile(2, openvdb::Coord(256, 0, 0), 1.0f, true);
    tree.addTile(3, openvdb::Coord(4096, 4096, -4096), 1.0f, true);
    grid->insertMeta("text", openvdb::StringMetadata("anything"));
    grid->insertMeta("matrix", openvdb::Mat4DMetadata(openvdb::Mat4d::identity()));
    return grid;
}

TEST(VdbScan, AcceptsEveryCompression) {
    const auto grid = sample_grid();
    for (const bool half : {false, true}) {
        grid->setSaveFloatAsHalf(half);
        for (std::uint32_t compression = 0; compression <= 7; ++compression) {
            EXPECT_EQ(refusal(written({grid}, compression)), "") << compression << (half ? " half" : "");
        }
    }
}

TEST(VdbScan, AcceptsEveryTransform) {
    using openvdb::math::Transform;
    const auto grid = sample_grid();
    const openvdb::BBoxd box(openvdb::Vec3d(0.0), openvdb::Vec3d(10.0));
    openvdb::Mat4d shear = openvdb::Mat4d::identity();
    shear[0][1] = 0.5;
    const auto scaled = Transform::createLinearTransform(0.5);
    const auto moved = scaled->copy();
    moved->postTranslate({1.0, 2.0, 3.0});
    const auto stretched = Transform::createLinearTransform(1.0);
    stretched->preScale({1.0, 2.0, 3.0});
    const auto stretched_and_moved = stretched->copy();
    stretched_and_moved->postTranslate({1.0, 2.0, 3.0});
    std::vector<std::string> maps;
    // Turned or moved alone, a map becomes one of these.
    for (const auto& transform :
         {scaled, moved, stretched, stretched_and_moved, Transform::createLinearTransform(shear),
          Transform::createFrustumTransform(box, 0.5, 10.0)}) {
        grid->setTransform(transform);
        EXPECT_EQ(refusal(written({grid}, openvdb::io::COMPRESS_ACTIVE_MASK)), "") << transform->mapType();
        maps.push_back(transform->mapType());
    }
    std::sort(maps.begin(), maps.end());
    EXPECT_EQ(maps,
              (std::vector<std::string>{"AffineMap", "NonlinearFrustumMap", "ScaleMap", "ScaleTranslateMap",
                                        "UniformScaleMap", "UniformScaleTranslateMap"}));
}

TEST(VdbScan, AcceptsSeveralGridsInstancesAndStreams) {
    const auto grid = sample_grid();
    const auto twin = grid->copy();
    twin->setName("twin");
    EXPECT_EQ(refusal(written({grid, sample_grid(), twin}, 6)), "");
    std::ostringstream stream;
    openvdb::io::Stream(stream).write(openvdb::GridCPtrVec{grid, twin});
    EXPECT_EQ(refusal(stream.str()), "");
    EXPECT_EQ(refusal(written({}, 6)), "");
}

/// A small file and where its parts lie.
class VdbDamage : public testing::Test {
protected:
    void SetUp() override {
        openvdb::initialize();
        const auto grid = openvdb::FloatGrid::create(0.0f);
        for (int i = 0; i < 200; ++i) {
            grid->tree().setValueOn(openvdb::Coord(i / 64, i / 8 % 8, i % 8), static_cast<float>(i));
        }
        grid->setName("g");
        grid->insertMeta("mark", openvdb::StringMetadata("MARK"));
        bytes_ = written({grid}, openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
        ASSERT_EQ(refusal(bytes_), "");
        transform_ = bytes_.find("UniformScaleMap");
        // Name, five vectors and the number of buffers, background, numbers of tiles and children.
        root_ = transform_ + 15 + 120 + 4;
        ASSERT_EQ(value<std::uint32_t>(root_ + 4), 0u);
        ASSERT_EQ(value<std::uint32_t>(root_ + 8), 1u);
    }

    template <typename T>
    T value(std::size_t position) const {
        T result;
        std::memcpy(&result, bytes_.data() + position, sizeof(T));
        return result;
    }

    template <typename T>
    std::string with(std::size_t position, T replacement) const {
        std::string changed = bytes_;
        std::memcpy(changed.data() + position, &replacement, sizeof(T));
        return changed;
    }

    std::size_t length_of_text(const std::string& text) const { return bytes_.find(text) - 4; }

    std::string bytes_;
    std::size_t transform_ = 0;
    std::size_t root_ = 0;
};

TEST_F(VdbDamage, EveryTruncationIsRefused) {
    for (std::size_t length = 0; length < bytes_.size(); length += length < 2000 || length > 17000 ? 1 : 97) {
        EXPECT_NE(refusal(bytes_.substr(0, length)), "") << length;
    }
}

TEST_F(VdbDamage, WhatOpenVdbWouldBelieveIsRefused) {
    constexpr std::uint32_t kHuge = 0x7ffffff0;
    const std::size_t upper = root_ + 12 + 12;  // Behind the corner of the only child.
    const std::size_t lower = upper + 2 * 4096 + 9 + value<std::uint64_t>(upper + 2 * 4096 + 1);
    const std::size_t leaf = lower + 2 * 512 + 9 + value<std::uint64_t>(lower + 2 * 512 + 1);
    const std::size_t leaf_table = bytes_.find("__delayedload") + 13 + 4;
    const struct {
        const char* what;
        std::string bytes;
        const char* message;
    } cases[] = {
        {"magic", with<char>(0, 'x'), "magic number"},
        {"old format", with<std::uint32_t>(8, 221), "its format is 221"},
        {"new format", with<std::uint32_t>(8, 225), "its format is 225"},
        {"number of grids", with<std::int32_t>(61, -1), "-1 grids"},
        {"length of a name", with<std::uint32_t>(length_of_text("Tree_float"), kHuge), "bytes are wanted"},
        {"length of a text", with<std::uint32_t>(length_of_text("MARK"), kHuge), "bytes are wanted"},
        {"type of metadata", with<char>(bytes_.find("string"), 'x'), "has the type 'xtring'"},
        {"size of a number", with<std::uint32_t>(bytes_.find("int64") + 5, 4), "has 4 bytes; 8 are right"},
        {"number of leaves", with<std::uint32_t>(leaf_table, kHuge), "more than the file has"},
        {"tree", with<char>(bytes_.find("_5_4_3"), 'x'), "has the type 'Tree_floatx5_4_3'"},
        {"map", with<char>(transform_, 'x'), "has the transform 'xniformScaleMap'"},
        {"number of tiles", with<std::uint32_t>(root_ + 4, kHuge), "two nodes lie at"},
        {"number of children", with<std::uint32_t>(root_ + 8, 2), "a node lies at"},
        {"place of a child", with<std::int32_t>(root_ + 12, 8), "a node lies at 8"},
        {"distant child", with<std::int32_t>(root_ + 12, -0x7ffff000), "a node lies at -2147479552"},
        {"more children", with<std::uint8_t>(upper, 3), ""},
        {"child and value", with<std::uint8_t>(upper + 4096, 1), "also marked as an active value"},
        {"way to store", with<std::uint8_t>(upper + 2 * 4096, 7), "unknown way 7"},
        {"raw chunk", with<std::int64_t>(upper + 2 * 4096 + 1, -100), "holds 100 bytes; 0 are right"},
        {"packed chunk", with<std::int64_t>(upper + 2 * 4096 + 1, kHuge), "bytes are wanted"},
        {"mask of a leaf", with<std::uint8_t>(leaf, 0x7f), "two different masks"},
    };
    for (const auto& damage : cases) {
        const std::string message = refusal(damage.bytes);
        EXPECT_NE(message, "") << damage.what;
        EXPECT_NE(message.find(damage.message), std::string::npos) << damage.what << ": " << message;
    }
}

TEST_F(VdbDamage, AChunkThatUnpacksToMoreThanItsPlaceIsRefused) {
    // The last chunk of the file: version 2 of Blosc, then its three sizes.
    std::size_t chunk = bytes_.size();
    while (--chunk > 0) {
        if (value<std::uint8_t>(chunk) == 2 && chunk + 16 <= bytes_.size() &&
            value<std::uint32_t>(chunk + 4) == 200 * sizeof(float) &&
            value<std::uint32_t>(chunk + 12) == bytes_.size() - chunk) {
            break;
        }
    }
    ASSERT_GT(chunk, 0u);
    EXPECT_NE(refusal(with<std::uint32_t>(chunk + 4, 2000)).find("unpacks"), std::string::npos);
    EXPECT_NE(refusal(with<std::uint32_t>(chunk + 12, 100000)).find("unpacks"), std::string::npos);
}

TEST_F(VdbDamage, GridsThatOverlapAreRefused) {
    const std::size_t places = bytes_.find("Tree_float_5_4_3") + 16 + 4;
    ASSERT_EQ(value<std::int64_t>(places), static_cast<std::int64_t>(places + 24));
    EXPECT_NE(refusal(with<std::int64_t>(places, 10)).find("not behind its header"), std::string::npos);
    EXPECT_NE(refusal(with<std::int64_t>(places + 16, 1000)).find("ends after its end"), std::string::npos);
    EXPECT_NE(refusal(with<std::int64_t>(places + 16, 1 << 30)).find("inside the file"), std::string::npos);
}

TEST_F(VdbDamage, FlippedBytesNeverEndWorseThanInARefusal) {
    std::mt19937 random(5);
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
        std::string flipped = bytes_;
        flipped[random() % 2000] ^= static_cast<char>(1 + random() % 255);
        refused += refusal(flipped) != "";
    }
    EXPECT_GT(refused, 500);
}

}  // namespace
}  // namespace tests
