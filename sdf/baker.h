// sdf/baker.h: bakes every mesh of a scene, or takes the bakes of an earlier run from a folder.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/support/error.h"
#include "core/support/progress.h"
#include "sdf/brick_grid.h"
#include "sdf/mesh_to_sdf.h"

namespace sdf {

/// How the meshes of a scene are baked.
struct BakeSettings {
    /// Voxels on the longest side of each mesh's local box; ignored where `voxel_world` is set.
    int resolution = 128;
    /// Voxel in world units: h = voxel_world / (largest scale of the mesh over its instances).
    std::optional<double> voxel_world;
    /// No mesh gets more voxels than this along a side; coarser with a warning instead.
    int max_dimension = 1024;
    /// No mesh gets a field that takes more bytes than this in a tracer (see FieldMemory); coarser with a
    /// warning instead. 0: no limit.
    std::uint64_t max_field_bytes = 0;
    /// Of the fields in memory; files keep every bit.
    SampleBits sample_bits = SampleBits::k16;
    ClassOverride surface_class = ClassOverride::kAuto;
    /// Only the mesh of this name; empty: all.
    std::string only_mesh;
    /// Bake again even if the folder has a bake that fits.
    bool force = false;
};

/// What became of one mesh.
struct MeshBake {
    std::uint32_t mesh = 0;  ///< Index into Scene::meshes.
    std::string name;
    std::uint32_t triangle_count = 0;
    std::shared_ptr<const BrickGrid> grid;  ///< Null if it failed or was not asked for.
    std::filesystem::path file;             ///< Empty where nothing was written or read.
    std::uint64_t file_bytes = 0;
    std::uint64_t memory_bytes = 0;  ///< Of the field in a tracer.
    double seconds = 0.0;
    bool reused = false;  ///< Read from the folder instead of baked.
    /// Of the field (FieldInfo::warnings), and of this run: an earlier bake that was of no use.
    std::vector<std::string> warnings;
    /// Why there is no grid; names the mesh.
    std::optional<core::InputError> error;

    /// Class, voxel, error figures. @pre grid
    const FieldInfo& info() const { return grid->info(); }
};

struct BakeResult {
    /// One a mesh that was asked for, in the scene's order; meshes without a single face are left out.
    std::vector<MeshBake> meshes;
    double seconds = 0.0;  ///< Wall time of the whole.
};

/// Bakes what `folder` does not already hold with the same source, settings and version, and writes it there;
/// an empty folder path keeps everything in memory. Meshes bake in parallel. A mesh that cannot be baked
/// fails alone, in its MeshBake.
/// @throws core::InputError kCannotCreate if the folder cannot be made or written, kUsage if only_mesh names
/// no mesh or settings are out of range.
BakeResult bake_scene(const core::Scene& scene, const BakeSettings& settings,
                      const std::filesystem::path& folder, const core::Progress& progress = {},
                      const core::StopRequested& stop = {});

/// The grids by mesh index, as SdfTracer takes them; null where a mesh has none.
std::vector<std::shared_ptr<const BrickGrid>> grids_by_mesh(const core::Scene& scene,
                                                            const BakeResult& result);

}  // namespace sdf
