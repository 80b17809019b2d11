// Case 15: .vdb files that hold no field.
#include <openvdb/openvdb.h>

#include <fstream>
#include <functional>
#include <limits>

#include "core/support/error.h"
#include "sdf/vdb_file.h"
#include "tests/sdf/baked_shapes.h"
#include "tests/stability/hard_case.h"
#include "tests/support/shared_data.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

class Case15 : public testing::Test {
protected:
    void SetUp() override {
        openvdb::initialize();
        sdf::write_field(path_, bake(icosphere(2), 16), "ball");
        std::ifstream file(path_, std::ios::binary);
        bytes_.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
        ASSERT_GT(bytes_.size(), 1000u);
        ASSERT_NO_THROW(static_cast<void>(sdf::read_field(path_)));
    }

    void write(const std::string& bytes) const {
        std::ofstream(path_, std::ios::binary)
            .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }

    /// The message of the error that names the file, or "" where it was read.
    std::string refusal() const {
        try {
            static_cast<void>(sdf::read_field(path_));
        } catch (const core::InputError& error) {
            EXPECT_EQ(error.kind(), core::ErrorKind::kBadData) << error.what();
            EXPECT_NE(std::string(error.what()).find(path_.filename().string()), std::string::npos)
                << error.what();
            return error.what();
        }
        return "";
    }

    /// Writes the good file's grids again after `spoil` has had its way with them.
    void spoil(const std::function<void(openvdb::FloatGrid&)>& change) const {
        write(bytes_);
        openvdb::io::File file(path_.string());
        file.open(false);
        const openvdb::GridPtrVecPtr grids = file.getGrids();
        file.close();
        for (const openvdb::GridBase::Ptr& grid : *grids) {
            if (grid->getName() == "distance") change(*openvdb::gridPtrCast<openvdb::FloatGrid>(grid));
        }
        openvdb::io::File(path_.string()).write(*grids);
    }

    TemporaryFolder folder_;
    fs::path path_ = folder_.path() / "field.vdb";
    std::string bytes_;
};

TEST_F(Case15, SamplesThatAreNotFiniteAreRefused) {
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()}) {
        spoil([&](openvdb::FloatGrid& grid) { grid.tree().beginLeaf()->beginValueOn().setValue(bad); });
        EXPECT_NE(refusal(), "") << bad;
    }
}

TEST_F(Case15, ABackgroundOfZeroIsRefused) {
    spoil([](openvdb::FloatGrid& grid) { grid.tree().root().setBackground(0.0f, false); });
    EXPECT_NE(refusal().find("background"), std::string::npos);
}

TEST_F(Case15, AWrongClassOrKindOfGridIsRefused) {
    spoil([](openvdb::FloatGrid& grid) {
        grid.insertMeta("fieldlight_class", openvdb::StringMetadata("fog"));
    });
    EXPECT_NE(refusal().find("fog"), std::string::npos);
    spoil([](openvdb::FloatGrid& grid) { grid.setName("density"); });
    EXPECT_NE(refusal(), "");
    const openvdb::DoubleGrid::Ptr other = openvdb::DoubleGrid::create(1.0);
    other->setName("distance");
    openvdb::io::File(path_.string()).write({other});
    EXPECT_NE(refusal(), "");
}

TEST_F(Case15, TruncatedFilesAreRefused) {
    for (std::size_t length = 0; length < bytes_.size(); length += 1 + bytes_.size() / 200) {
        write(bytes_.substr(0, length));
        EXPECT_NE(refusal(), "") << length << " of " << bytes_.size() << " bytes";
    }
}

TEST_F(Case15, AbsurdSizesAreRefused) {
    spoil([](openvdb::FloatGrid& grid) { grid.tree().setValue(openvdb::Coord(1 << 28, 0, 0), 0.01f); });
    EXPECT_NE(refusal(), "");
    spoil([](openvdb::FloatGrid& grid) {
        grid.insertMeta("fieldlight_voxel", openvdb::DoubleMetadata(1e300));
    });
    EXPECT_NE(refusal(), "");
    // Every four bytes of the header and of the topology, as a size of two thousand million.
    const std::size_t step = bytes_.size() > 4000 ? 4 : 1;
    for (std::size_t at = 0; at + 4 < 4000; at += step) {
        std::string absurd = bytes_;
        const std::uint32_t huge = 0x7ffffff0u;
        absurd.replace(at, 4, reinterpret_cast<const char*>(&huge), 4);
        write(absurd);
        // Some bytes are free to be anything; what counts is that nothing worse than a refusal happens.
        static_cast<void>(refusal());
    }
}

}  // namespace
}  // namespace tests
