#include "sdf/vdb_file.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Diagnostics.h>
#include <openvdb/tools/LevelSetUtil.h>

#include <fstream>
#include <functional>
#include <limits>

#include "core/support/error.h"
#include "tests/sdf/baked_shapes.h"
#include "tests/support/shared_data.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

openvdb::GridPtrVec grids_in(const fs::path& path) {
    openvdb::io::File file(path.string());
    file.open(false);
    return *file.getGrids();
}

void expect_refused(const fs::path& path, core::ErrorKind kind, const std::string& word) {
    try {
        static_cast<void>(sdf::read_field(path));
        ADD_FAILURE() << "was read; '" << word << "' should have been complained of";
    } catch (const core::InputError& error) {
        EXPECT_EQ(error.kind(), kind);
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find(path.filename().string()), std::string::npos)
            << error.what();
    }
}

/// A good file after `spoil` has had its way with the grids.
class SpoiledFile {
public:
    explicit SpoiledFile(const std::function<void(openvdb::FloatGrid&, openvdb::Int32Grid&)>& spoil) {
        sdf::write_field(path(), bake(icosphere(2), 16), "ball");
        const openvdb::GridPtrVec grids = grids_in(path());
        const auto distance = openvdb::gridPtrCast<openvdb::FloatGrid>(grids[0]);
        const auto triangle = openvdb::gridPtrCast<openvdb::Int32Grid>(grids[1]);
        spoil(*distance, *triangle);
        openvdb::io::File(path().string()).write({distance, triangle});
    }
    fs::path path() const { return folder_.path() / "spoiled.vdb"; }

private:
    TemporaryFolder folder_;
};

TEST(VdbFile, ComesBackAsItWasWritten) {
    const TemporaryFolder folder;
    const core::Mesh mesh = merged(icosphere(2), moved(quad(), translation({0, 0, 2})));
    sdf::SampledField field = bake(mesh, 24);
    field.info.source_hash = "source";
    field.info.settings_hash = "settings";
    field.info.warnings = {"first", "second"};
    field.info.error_field_voxels = {0.125, 0.25, 0.5};
    field.info.sign_mismatches = {2000, 3};
    const fs::path path = folder.path() / "field.vdb";
    sdf::write_field(path, field, "both");
    const sdf::SampledField back = sdf::read_field(path);
    EXPECT_EQ(back.info.mesh_class, field.info.mesh_class);
    EXPECT_EQ(back.info.voxel_size, field.info.voxel_size);
    EXPECT_EQ(back.info.origin, field.info.origin);
    EXPECT_EQ(back.info.half_thickness, field.info.half_thickness);
    EXPECT_EQ(back.info.clean_level_set, field.info.clean_level_set);
    EXPECT_EQ(back.info.triangle_count, field.info.triangle_count);
    EXPECT_EQ(back.info.error_voxels.p99, field.info.error_voxels.p99);
    EXPECT_EQ(back.info.error_field_voxels.mean, 0.125);
    EXPECT_EQ(back.info.error_field_voxels.p99, 0.25);
    EXPECT_EQ(back.info.error_field_voxels.max, 0.5);
    EXPECT_EQ(back.info.sign_mismatches.samples, 2000u);
    EXPECT_EQ(back.info.sign_mismatches.wrong, 3u);
    EXPECT_EQ(back.info.source_hash, "source");
    EXPECT_EQ(back.info.settings_hash, "settings");
    EXPECT_EQ(back.info.warnings, field.info.warnings);
    EXPECT_EQ(back.features, field.features);
    ASSERT_EQ(back.leaves.size(), field.leaves.size());
    for (std::size_t i = 0; i < field.leaves.size(); ++i) {
        ASSERT_EQ(back.leaves[i].origin, field.leaves[i].origin);
        ASSERT_EQ(back.leaves[i].active, field.leaves[i].active);
        for (int k = 0; k < sdf::kLeafSize; ++k) {
            if (!field.leaves[i].is_active(k)) continue;
            const auto slot = static_cast<std::size_t>(k);
            ASSERT_EQ(back.leaves[i].distance[slot], field.leaves[i].distance[slot]);
            ASSERT_EQ(back.leaves[i].triangle[slot], field.leaves[i].triangle[slot]);
        }
    }
}

TEST(VdbFile, HoldsVoxelsOfAnySizeExactly) {
    // OpenVDB refuses a transform whose determinant is under about 1e-15, which is a voxel of 1e-5.
    for (const double scale : {1e-8, 1e-3, 1.0, 1e6}) {
        TemporaryFolder folder;
        const fs::path path = folder.path() / "ball.vdb";
        const sdf::SampledField written =
            bake(moved(icosphere(2), scaling(glm::dvec3(scale)) * translation({0.3, 0.2, 0.1})), 16);
        sdf::write_field(path, written, "ball");
        const sdf::SampledField read = sdf::read_field(path);
        EXPECT_EQ(read.info.voxel_size, written.info.voxel_size);
        EXPECT_NEAR(read.info.origin.x / written.info.origin.x, 1.0, 1e-12);
        ASSERT_EQ(read.leaves.size(), written.leaves.size());
        for (std::size_t i = 0; i < read.leaves.size(); ++i) {
            for (int j = 0; j < sdf::kLeafSize; ++j) {
                if (!written.leaves[i].is_active(j)) continue;
                ASSERT_EQ(read.leaves[i].distance[static_cast<std::size_t>(j)],
                          written.leaves[i].distance[static_cast<std::size_t>(j)])
                    << "scale " << scale;
            }
        }
    }
}

TEST(VdbFile, TheSameFieldGivesTheSameBytes) {
    const TemporaryFolder folder;
    sdf::write_field(folder.path() / "a.vdb", bake(icosphere(2), 24), "ball");
    sdf::write_field(folder.path() / "b.vdb", bake(icosphere(2), 24), "ball");
    const std::string a = bytes_of(folder.path() / "a.vdb");
    EXPECT_GT(a.size(), 1000u);
    EXPECT_TRUE(a == bytes_of(folder.path() / "b.vdb"));
}

TEST(VdbFile, ClosedMeshesAreLevelSetsByOpenVdbsOwnCheck) {
    openvdb::initialize();
    for (const core::Mesh& mesh : {icosphere(3), torus(1.0f, 0.4f, 48, 24)}) {
        const TemporaryFolder folder;
        const fs::path path = folder.path() / "level_set.vdb";
        sdf::write_field(path, bake(mesh, 32), "shape");
        const openvdb::GridPtrVec grids = grids_in(path);
        ASSERT_EQ(grids.size(), 2u);
        const auto distance = openvdb::gridPtrCast<openvdb::FloatGrid>(grids[0]);
        ASSERT_TRUE(distance);
        EXPECT_EQ(distance->getName(), "distance");
        EXPECT_EQ(distance->getGridClass(), openvdb::GRID_LEVEL_SET);
        EXPECT_EQ(openvdb::tools::checkLevelSet(*distance, 9), "");
        // Space deep inside is negative too.
        const openvdb::Coord deep = mesh.positions.size() > 1000
                                        ? openvdb::Coord::round(distance->worldToIndex({1.0, 0.0, 0.0}))
                                        : openvdb::Coord(0, 0, 0);
        EXPECT_LT(distance->tree().getValue(deep), 0.0f);
    }
}

TEST(VdbFile, SheetsDoNotClaimToBeLevelSets) {
    const TemporaryFolder folder;
    sdf::write_field(folder.path() / "sheet.vdb", bake(quad(), 16), "sheet");
    const std::vector<sdf::VdbGridSummary> grids = sdf::summarise_vdb(folder.path() / "sheet.vdb");
    ASSERT_EQ(grids.size(), 2u);
    EXPECT_EQ(grids[0].name, "distance");
    EXPECT_EQ(grids[0].grid_class, "unknown");
    EXPECT_EQ(grids[0].metadata.at("fieldlight_class"), "sheet");
    EXPECT_EQ(grids[0].metadata.at("fieldlight_sheet_triangles"), "0-1");
}

TEST(VdbFile, SummaryTellsWhatIsThere) {
    const TemporaryFolder folder;
    const sdf::SampledField field = bake(icosphere(2), 16);
    sdf::write_field(folder.path() / "ball.vdb", field, "ball");
    const sdf::VdbGridSummary distance = sdf::summarise_vdb(folder.path() / "ball.vdb")[0];
    std::size_t active = 0;
    for_each_sample(field, [&](const glm::dvec3&, float, std::int32_t) { ++active; });
    EXPECT_EQ(distance.active_voxels, active);
    EXPECT_EQ(distance.type, "float");
    EXPECT_EQ(distance.grid_class, "level set");
    EXPECT_EQ(distance.nan_samples, 0u);
    EXPECT_NEAR(distance.voxel_size.x, field.info.voxel_size, 1e-15);
    // The band reaches four voxels beyond the unit ball, sampled at whole voxels.
    EXPECT_NEAR(distance.maximum.x, 1.0 + 4.0 * field.info.voxel_size, 2.0 * field.info.voxel_size);

    const SpoiledFile spoiled([](openvdb::FloatGrid& grid, openvdb::Int32Grid&) {
        grid.tree().beginLeaf()->beginValueOn().setValue(std::nanf(""));
    });
    EXPECT_EQ(sdf::summarise_vdb(spoiled.path())[0].nan_samples, 1u);
}

TEST(VdbFile, SpoiledFilesAreRefusedByName) {
    using Distance = openvdb::FloatGrid;
    using Index = openvdb::Int32Grid;
    const auto refused = [](const std::string& word, const std::function<void(Distance&, Index&)>& spoil) {
        const SpoiledFile file(spoil);
        expect_refused(file.path(), core::ErrorKind::kBadData, word);
    };
    refused("sample is nan",
            [](Distance& grid, Index&) { grid.tree().beginLeaf()->beginValueOn().setValue(std::nanf("")); });
    refused("sample is inf", [](Distance& grid, Index&) {
        grid.tree().beginLeaf()->beginValueOn().setValue(std::numeric_limits<float>::infinity());
    });
    refused("background", [](Distance& grid, Index&) { grid.tree().root().setBackground(0.0f, false); });
    refused("names triangle", [](Distance&, Index& index) {
        for (auto leaf = index.tree().beginLeaf(); leaf; ++leaf) leaf->fill(1'000'000);
    });
    refused("transform", [](Distance& grid, Index&) {
        grid.setTransform(openvdb::math::Transform::createLinearTransform(0.123));
    });
    refused("lattice coordinate",
            [](Distance& grid, Index&) { grid.tree().setValue(openvdb::Coord(1 << 28, 0, 0), 0.01f); });
    refused("no grid 'distance'", [](Distance& grid, Index&) { grid.setName("density"); });
    refused("no grid 'triangle'", [](Distance&, Index& index) { index.setName("density"); });
    refused("fieldlight_class", [](Distance& grid, Index&) { grid.removeMeta("fieldlight_class"); });
    refused("class 'gas'", [](Distance& grid, Index&) {
        grid.insertMeta("fieldlight_class", openvdb::StringMetadata("gas"));
    });
    refused("baked by", [](Distance& grid, Index&) {
        grid.insertMeta("fieldlight_writer", openvdb::StringMetadata("someone else"));
    });
    refused("fieldlight_voxel", [](Distance& grid, Index&) {
        grid.insertMeta("fieldlight_voxel", openvdb::DoubleMetadata(std::nan("")));
    });
    refused("ranges of triangles", [](Distance& grid, Index&) {
        grid.insertMeta("fieldlight_sheet_triangles", openvdb::StringMetadata("5-99999999999"));
    });
}

TEST(VdbFile, OfAnEarlierVersionIsNoBakeToUseAgain) {
    const SpoiledFile old([](openvdb::FloatGrid& grid, openvdb::Int32Grid&) {
        grid.insertMeta("fieldlight_writer",
                        openvdb::StringMetadata("fieldlight " FIELDLIGHT_VERSION " bake 3"));
        grid.removeMeta("fieldlight_sign_samples");
    });
    EXPECT_FALSE(sdf::read_bake_key(old.path()));
    expect_refused(old.path(), core::ErrorKind::kBadData, "bake it again");
    EXPECT_EQ(sdf::summarise_vdb(old.path()).size(), 2u) << "anyone may still look into it";
}

TEST(VdbFile, TruncatedAndForeignFilesAreRefusedByName) {
    const TemporaryFolder folder;
    const fs::path whole = folder.path() / "whole.vdb", part = folder.path() / "part.vdb";
    sdf::write_field(whole, bake(icosphere(2), 16), "ball");
    const std::string bytes = bytes_of(whole);
    for (const double fraction : {0.0, 0.001, 0.01, 0.1, 0.5, 0.9, 0.999}) {
        std::ofstream(part, std::ios::binary)
            .write(bytes.data(), static_cast<std::streamsize>(fraction * double(bytes.size())));
        expect_refused(part, core::ErrorKind::kBadData, "not a whole .vdb");
    }
    std::ofstream(part) << "this is no grid";
    expect_refused(part, core::ErrorKind::kBadData, "not a whole .vdb");
    expect_refused(folder.path() / "missing.vdb", core::ErrorKind::kNoInput, "no such file");
}

}  // namespace
}  // namespace tests
