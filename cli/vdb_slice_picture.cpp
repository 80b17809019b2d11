#include "cli/vdb_slice_picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>

namespace cli {

namespace {

constexpr int kWantedSide = 900;

/// Half-widths of lines, in pixels of the picture.
constexpr float kSurfaceLine = 1.6f;
constexpr float kVoxelLine = 0.6f;

const glm::vec3 kOutside(0.16f, 0.38f, 0.62f), kInside(0.80f, 0.42f, 0.10f),
    kNearSurface(0.97f, 0.96f, 0.93f);
const glm::vec3 kSurface(0.05f, 0.05f, 0.06f), kNotFinite(1.0f, 0.0f, 1.0f);

/// The field in voxels at a point of the slice, bilinear between lattice points.
float value_at(const sdf::VdbSlice& slice, float x, float y) {
    x = std::clamp(x, 0.0f, static_cast<float>(slice.width - 1));
    y = std::clamp(y, 0.0f, static_cast<float>(slice.height - 1));
    const int left = std::min(static_cast<int>(x), std::max(slice.width - 2, 0));
    const int top = std::min(static_cast<int>(y), std::max(slice.height - 2, 0));
    const int right = std::min(left + 1, slice.width - 1), bottom = std::min(top + 1, slice.height - 1);
    const auto at = [&](int column, int row) {
        return slice.distance_voxels[static_cast<std::size_t>(row) * static_cast<std::size_t>(slice.width) +
                                     static_cast<std::size_t>(column)];
    };
    const float u = x - static_cast<float>(left), v = y - static_cast<float>(top);
    return glm::mix(glm::mix(at(left, top), at(right, top), u),
                    glm::mix(at(left, bottom), at(right, bottom), u), v);
}

/// How much of a line of this half-width covers a pixel that lies `distance` pixels from its middle.
float coverage(float distance, float half_width) {
    return std::clamp(half_width + 0.5f - distance, 0.0f, 1.0f);
}

glm::vec3 color_at(const sdf::VdbSlice& slice, float x, float y, float pixels_per_voxel) {
    const float value = value_at(slice, x, y);
    if (!std::isfinite(value)) return kNotFinite;
    const auto band = static_cast<float>(slice.background_voxels);
    const float share = band > 0.0f ? std::min(std::abs(value) / band, 1.0f) : 1.0f;
    glm::vec3 color = glm::mix(kNearSurface, value < 0.0f ? kInside : kOutside, std::sqrt(share));
    const float step = 1.0f / pixels_per_voxel;
    const glm::vec2 slope((value_at(slice, x + step, y) - value_at(slice, x - step, y)) / 2.0f,
                          (value_at(slice, x, y + step) - value_at(slice, x, y - step)) / 2.0f);
    const float slope_per_pixel = glm::length(slope);
    // Beyond the band the field is flat and has no lines.
    if (!(slope_per_pixel > 1e-4f * step)) return color;
    const float off_whole = std::abs(value - std::round(value)) / slope_per_pixel;
    if (share < 1.0f) color = glm::mix(color, kSurface, 0.25f * coverage(off_whole, kVoxelLine));
    return glm::mix(color, kSurface, coverage(std::abs(value) / slope_per_pixel, kSurfaceLine));
}

}  // namespace

SlicePicture draw_slice(const sdf::VdbSlice& slice) {
    const int scale = std::max(1, kWantedSide / std::max(slice.width, slice.height));
    SlicePicture picture;
    picture.width = slice.width * scale;
    picture.height = slice.height * scale;
    picture.rgb.reserve(3 * static_cast<std::size_t>(picture.width) *
                        static_cast<std::size_t>(picture.height));
    const auto factor = static_cast<float>(scale);
    for (int row = 0; row < picture.height; ++row) {
        for (int column = 0; column < picture.width; ++column) {
            const float x = (static_cast<float>(column) + 0.5f) / factor - 0.5f;
            const float y = (static_cast<float>(row) + 0.5f) / factor - 0.5f;
            const glm::vec3 color = color_at(slice, x, y, factor);
            for (int channel = 0; channel < 3; ++channel) {
                picture.rgb.push_back(static_cast<std::uint8_t>(std::lround(255.0f * color[channel])));
            }
        }
    }
    return picture;
}

}  // namespace cli
