// core/scene/obj_file.h: Wavefront OBJ files to core::Scene.
//
// Alias|Wavefront, "Advanced Visualizer" appendix B1, 1995, as far as it describes polygons. Read without a
// library: Debian's tinyobjloader tells neither the line of an error nor an index out of range, and takes
// memory before it checks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "core/scene/load_options.h"
#include "core/scene/scene.h"

namespace core {

/// Reads an OBJ file held in memory, with the material libraries and pictures that it names. Every `o` begins
/// a mesh (groups do not: they cut closed surfaces open), every `usemtl` a part of it. Faces without normals
/// are flat; smoothing groups are not read. Colours after `v` are sRGB-encoded, as editors write them.
/// Texture coordinates have v = 0 at the bottom. Without `usemtl`, plain_material(). The unit is the file's,
/// +Y is up. Lines, points and free-form surfaces are skipped with a warning.
/// @param path of the file, for messages and for what lies beside it.
/// @throws InputError naming the line
Scene read_obj(std::span<const std::uint8_t> bytes, const std::filesystem::path& path,
               const LoadOptions& options);

}  // namespace core
