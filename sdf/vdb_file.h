// sdf/vdb_file.h: baked fields on disk: one .vdb a mesh, readable by other programs.
//
// Grid "distance" holds the samples (class level set only where it is one: closed, signed, nothing
// inflated), grid "triangle" each active sample's closest source triangle. Everything of FieldInfo is
// metadata of "distance", under names that start with `fieldlight_`. The same field gives the same bytes.
// Coordinates and distances are the mesh's local ones times `fieldlight_unit`, which is 1 unless a voxel is
// smaller than OpenVDB can hold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sdf/sampled_field.h"

namespace sdf {

/// Writes a field, atomically. @param name of the mesh, for other programs.
/// @throws core::InputError kCannotCreate or kInputOutput, naming the path.
void write_field(const std::filesystem::path& path, const SampledField& field, const std::string& name);

/// Reads what write_field wrote.
/// @throws core::InputError kNoInput if the file is missing; kBadData, naming what is wrong, if it is not a
/// whole .vdb, was not baked by this program, or holds NaN samples, a zero background, numbers of triangles
/// that the mesh has not, or absurd sizes.
SampledField read_field(const std::filesystem::path& path);

/// What decides whether a bake can be used again, or nothing if the file holds none of this program's
/// version.
struct BakeKey {
    std::string source_hash;
    std::string settings_hash;

    bool operator==(const BakeKey&) const = default;
};

/// Reads the key of a bake without its samples. @throws as read_field
std::optional<BakeKey> read_bake_key(const std::filesystem::path& path);

/// One grid of any .vdb.
struct VdbGridSummary {
    std::string name;
    std::string type;
    std::string grid_class;
    glm::dvec3 voxel_size{0.0};
    bool has_voxels = false;                ///< Whether any voxel is active; else the bounds mean nothing.
    glm::dvec3 minimum{0.0}, maximum{0.0};  ///< World positions of the outermost active voxels.
    std::uint64_t active_voxels = 0;
    std::uint64_t bytes = 0;
    std::uint64_t nan_samples = 0;
    std::map<std::string, std::string> metadata;
};

/// A plane through a grid of distances.
struct VdbSlice {
    std::string grid;           ///< Its name.
    int width = 0, height = 0;  ///< Lattice points.
    /// Row-major, as seen along the axis: for x y z columns run along z x x, rows along -y z -y, so that +Y
    /// is up. Units are the grid's voxels; beyond the band +-background.
    std::vector<float> distance_voxels;
    double background_voxels = 0.0;
    double position = 0.0;  ///< World coordinate of the plane.
};

/// Cuts the first float grid of a .vdb, whoever wrote it.
/// @param axis 0, 1, 2: the plane's normal. @param at from 0 to 1 through the active voxels' box.
/// @throws as read_field; also kBadData where no float grid with uniform voxels holds a finite active voxel,
/// and where the box has more than 4,096 voxels along a side.
VdbSlice read_vdb_slice(const std::filesystem::path& path, int axis, double at);

/// Reads every grid of a .vdb, whoever wrote it. @throws as read_field
std::vector<VdbGridSummary> summarise_vdb(const std::filesystem::path& path);

}  // namespace sdf
