// cli/vdb_slice_picture.h: a plane through a distance field, drawn for a person to look at a bake.
#pragma once

#include <cstdint>
#include <vector>

#include "sdf/vdb_file.h"

namespace cli {

/// An 8-bit sRGB picture, top row first.
struct SlicePicture {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

/// Draws the trilinear field: blue outside and orange inside, the paler the nearer the surface; a thin line
/// at each whole voxel of distance, a bold one at the surface, flat colour beyond the stored band, magenta
/// where a value is not finite. Small slices are enlarged by a whole factor to some 900 pixels.
SlicePicture draw_slice(const sdf::VdbSlice& slice);

}  // namespace cli
