#include "cli/inspect_vdb.h"

#include <glm/glm.hpp>

#include "sdf/vdb_file.h"

namespace cli {

namespace {

nlohmann::json as_json(const glm::dvec3& v) {
    return {v.x, v.y, v.z};
}

}  // namespace

nlohmann::json inspect_vdb(const std::filesystem::path& path) {
    nlohmann::json result = {{"schema", 1}, {"grids", nlohmann::json::array()}};
    for (const sdf::VdbGridSummary& grid : sdf::summarise_vdb(path)) {
        const bool is_uniform =
            grid.voxel_size.x == grid.voxel_size.y && grid.voxel_size.y == grid.voxel_size.z;
        nlohmann::json entry = {
            {"name", grid.name},
            {"type", grid.type},
            {"class", grid.grid_class},
            {"voxel", is_uniform ? nlohmann::json(grid.voxel_size.x) : as_json(grid.voxel_size)},
            {"bounds", nullptr},
            {"active_voxels", grid.active_voxels},
            {"bytes", grid.bytes},
            {"nan_samples", grid.nan_samples},
            {"metadata", grid.metadata}};
        if (grid.has_voxels) entry["bounds"] = {as_json(grid.minimum), as_json(grid.maximum)};
        result["grids"].push_back(std::move(entry));
    }
    return result;
}

}  // namespace cli
