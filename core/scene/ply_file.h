// core/scene/ply_file.h: PLY files, text and binary of either byte order, to core::Scene.
//
// G. Turk, "The PLY Polygon File Format", 1994. Read without a library, since Debian 12 has none, and since
// every message must name the row and property that is wrong.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/scene/scene.h"

namespace core {

/// Reads a PLY file held in memory as one mesh with plain_material(): x y z, nx ny nz, red green blue alpha
/// and s t (u v) of `vertex`, polygons of `face` and strips of `tristrips`; all else is skipped. Colours of
/// integer types are sRGB-encoded, as scanners and editors write them, those of floating-point types linear.
/// Texture coordinates have t = 0 at the bottom. Without normals the mesh is flat-shaded. The unit and the
/// axes stay as they are.
/// @throws InputError (kBadData) naming the row and property, for point clouds too
Scene read_ply(std::span<const std::uint8_t> bytes, const std::string& file_name);

}  // namespace core
