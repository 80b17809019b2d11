// cli/inspect_vdb.h: what a .vdb file holds, as `fieldlight inspect` prints it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace cli {

/// Grids with class, voxel, bounds, active voxels, bytes, metadata and NaN samples, of any .vdb.
/// @throws core::InputError kNoInput if the file is missing, kBadData if it is not a readable .vdb; both name
/// it.
nlohmann::json inspect_vdb(const std::filesystem::path& path);

}  // namespace cli
