// core/scene/stl_file.h: STL files, binary and text, to core::Scene.
//
// 3D Systems, "StereoLithography Interface Specification", 1989. Read without a library: the format is a list
// of triangles, and the care lies in telling its two forms apart and in naming what is wrong.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/scene/scene.h"

namespace core {

/// Reads an STL file held in memory: one mesh a `solid`, flat-shaded, with plain_material(). A file is binary
/// if its facet count fits its size, whatever it begins with. Normals follow from the order of the corners;
/// the file's own are only compared. Colours in attribute bytes are not read. The unit and the axes stay as
/// they are.
/// @throws InputError (kBadData) naming the facet or line
Scene read_stl(std::span<const std::uint8_t> bytes, const std::string& file_name);

}  // namespace core
