// tests/cli/vdb_slice_test.cpp: the picture of a plane through a field, as drawn and as asked for.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/vdb_slice_picture.h"
#include "tests/sdf/baked_shapes.h"
#include "tests/support/program_run.h"
#include "tests/support/shared_data.h"

namespace {

namespace fs = std::filesystem;

/// A disc of this radius round the middle, in lattice points.
sdf::VdbSlice disc(int side, float radius) {
    sdf::VdbSlice slice;
    slice.width = slice.height = side;
    slice.background_voxels = 4.0;
    const float middle = 0.5f * static_cast<float>(side - 1);
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            const float distance =
                std::hypot(static_cast<float>(column) - middle, static_cast<float>(row) - middle) - radius;
            slice.distance_voxels.push_back(std::clamp(distance, -4.0f, 4.0f));
        }
    }
    return slice;
}

glm::ivec3 pixel(const cli::SlicePicture& picture, float x, float y) {
    const int column = static_cast<int>(x * static_cast<float>(picture.width));
    const int row = static_cast<int>(y * static_cast<float>(picture.height));
    const std::size_t index = 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width) +
                                   static_cast<std::size_t>(column));
    return {picture.rgb[index], picture.rgb[index + 1], picture.rgb[index + 2]};
}

TEST(VdbSlice, IsOrangeInsideBlueOutsideAndBlackAtTheSurface) {
    const cli::SlicePicture picture = cli::draw_slice(disc(41, 12.0f));
    EXPECT_GE(std::max(picture.width, picture.height), 800);
    const glm::ivec3 inside = pixel(picture, 0.5f, 0.5f), outside = pixel(picture, 0.03f, 0.03f);
    EXPECT_GT(inside.r, inside.b + 60);
    EXPECT_GT(outside.b, outside.r + 60);
    // The surface lies 12 lattice points from the middle, all round.
    for (int i = 0; i < 16; ++i) {
        const float angle = 0.3927f * static_cast<float>(i);
        const glm::ivec3 surface =
            pixel(picture, 0.5f + 12.0f / 41.0f * std::cos(angle), 0.5f + 12.0f / 41.0f * std::sin(angle));
        EXPECT_LT(surface.r + surface.g + surface.b, 150) << "at angle " << angle;
    }
}

TEST(VdbSlice, ShowsWhatIsNotFinite) {
    sdf::VdbSlice slice = disc(21, 6.0f);
    slice.distance_voxels[10 * 21 + 10] = std::nanf("");
    EXPECT_EQ(pixel(cli::draw_slice(slice), 0.5f, 0.5f), glm::ivec3(255, 0, 255));
}

TEST(VdbSlice, ReadsThePlaneAskedFor) {
    const tests::TemporaryFolder folder;
    const fs::path file = folder.path() / "ball.vdb";
    // A ball of radius 1 round (3, 0, 0): 40 voxels across.
    const sdf::SampledField field =
        tests::bake(tests::moved(tests::icosphere(4), tests::translation({3, 0, 0})), 40);
    sdf::write_field(file, field, "ball");
    for (int axis = 0; axis < 3; ++axis) {
        const sdf::VdbSlice middle = sdf::read_vdb_slice(file, axis, 0.5),
                            rim = sdf::read_vdb_slice(file, axis, 0.0);
        EXPECT_NEAR(middle.position, axis == 0 ? 3.0 : 0.0, 0.6 * field.info.voxel_size);
        const auto inside = [](const sdf::VdbSlice& slice) {
            return std::count_if(slice.distance_voxels.begin(), slice.distance_voxels.end(),
                                 [](float value) { return value < 0.0f; });
        };
        // The middle plane cuts a disc of 20 voxels; the first plane lies a band outside.
        EXPECT_NEAR(static_cast<double>(inside(middle)), 3.14159 * 20.0 * 20.0, 40.0);
        EXPECT_EQ(inside(rim), 0);
    }
}

TEST(VdbSlice, IsWrittenByInspect) {
    const tests::TemporaryFolder folder;
    const std::string scene = (tests::assets_folder() / "cornell_box.glb").string();
    ASSERT_EQ(tests::run_program({"bake", scene, "-o", folder.path().string(), "--mesh", "tall block",
                                  "--resolution", "16", "--quiet"})
                  .exit_code,
              0);
    std::string field;
    for (const auto& entry : fs::directory_iterator(folder.path())) field = entry.path().string();
    const std::string picture = (folder.path() / "slice.png").string();
    const tests::ProgramRun run =
        tests::run_program({"inspect", field, "--slice", picture, "--axis", "y", "--at", "0.25", "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const nlohmann::json slice = nlohmann::json::parse(run.out)["slice"];
    EXPECT_EQ(slice["axis"], "y");
    EXPECT_EQ(slice["file"], picture);
    EXPECT_GT(fs::file_size(picture), 1000u);

    EXPECT_EQ(tests::run_program({"inspect", scene, "--slice", picture}).exit_code, 64);
    EXPECT_EQ(tests::run_program({"inspect", field, "--slice", "slice.jpg"}).exit_code, 64);
    EXPECT_EQ(tests::run_program({"inspect", field, "--slice", picture, "--axis", "w"}).exit_code, 64);
}

}  // namespace
