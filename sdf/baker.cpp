#include "sdf/baker.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <new>

#include "core/support/hash.h"
#include "core/support/parallel.h"
#include "sdf/field_memory.h"
#include "sdf/transform_scale.h"
#include "sdf/vdb_file.h"

namespace sdf {

namespace {

namespace fs = std::filesystem;

/// Times a field may be made coarser to fit a budget of bytes.
constexpr int kMostCoarsenings = 6;

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::string source_hash(const core::Mesh& mesh) {
    core::Hasher hasher;
    hasher.add_range(std::span<const glm::vec3>(mesh.positions));
    hasher.add_range(std::span<const glm::uvec3>(mesh.triangles));
    return hasher.hex();
}

std::string settings_hash(double wanted_voxel, const BakeSettings& settings) {
    core::Hasher hasher;
    hasher.add(wanted_voxel);
    hasher.add(settings.max_dimension);
    hasher.add(settings.max_field_bytes);
    hasher.add(settings.surface_class);
    hasher.add(kHalfThicknessVoxels);
    return hasher.hex();
}

/// Letters, digits, '-', '_' and '.' of a name, others as '_'; short, and told apart by the mesh's number.
std::string file_name(const core::Mesh& mesh, std::uint32_t index) {
    constexpr std::size_t kLongestName = 80;
    std::string safe;
    for (const char c : mesh.name.substr(0, kLongestName)) {
        const bool is_safe = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                             c == '-' || c == '_' || (c == '.' && !safe.empty());
        safe += is_safe ? c : '_';
    }
    return fmt::format("{}_{}.vdb", safe.empty() ? "mesh" : safe, index);
}

/// The largest scale of a mesh over its instances; 1 where it has none.
double largest_scale(const core::Scene& scene, std::uint32_t mesh) {
    double scale = 0.0;
    for (const core::Instance& instance : scene.instances) {
        if (instance.mesh == mesh) {
            scale = std::max(scale, largest_singular_value(glm::dmat3(instance.world_from_local)));
        }
    }
    return scale > 0.0 ? scale : 1.0;
}

/// h as asked for, in local units; before any clamp.
double wanted_voxel(const core::Scene& scene, std::uint32_t mesh, double longest_side,
                    const BakeSettings& settings) {
    if (settings.voxel_world) return *settings.voxel_world / largest_scale(scene, mesh);
    return longest_side / settings.resolution;
}

MeshView view_of(const core::Mesh& mesh) {
    return {mesh.positions, mesh.triangles};
}

struct BakedGrid {
    SampledField field;
    std::shared_ptr<const BrickGrid> grid;
};

/// Bakes and lays out, coarser where limits ask for it.
BakedGrid bake_within_limits(const core::Mesh& mesh, double voxel, double longest_side,
                             const BakeSettings& settings, const BakeKey& key) {
    std::vector<std::string> warnings;
    const double finest = longest_side / settings.max_dimension;
    if (voxel < finest) {
        warnings.push_back(fmt::format("a voxel of {:g} would give {:.0f} voxels along a side; {:g} is used",
                                       voxel, longest_side / voxel, finest));
        voxel = finest;
    }
    const std::uint64_t limit = settings.max_field_bytes;
    std::string coarsened;  // What the first voxel would have taken.
    for (int attempt = 0;; ++attempt) {
        BakedGrid baked{bake_mesh(view_of(mesh), {voxel, settings.surface_class, settings.max_dimension}),
                        nullptr};
        FieldInfo& info = baked.field.info;
        info.source_hash = key.source_hash;
        info.settings_hash = key.settings_hash;
        if (attempt > 0) {
            warnings.back() = fmt::format("{}; a voxel of {:g} is used, {:.0f} along the longest side",
                                          coarsened, voxel, longest_side / voxel);
        }
        info.warnings.insert(info.warnings.begin(), warnings.begin(), warnings.end());
        baked.grid = std::make_shared<const BrickGrid>(baked.field, settings.sample_bits);
        const FieldMemory memory = field_memory(*baked.grid, mesh.triangles.size());
        if (limit == 0 || memory.total() <= limit) return baked;
        if (attempt == kMostCoarsenings || memory.triangles >= limit) {
            throw core::InputError(
                core::ErrorKind::kOutOfMemory,
                fmt::format(
                    "its field takes {} bytes of memory even with a voxel of {:g}, {} of them for its "
                    "triangles; --max-field-bytes allows {}",
                    memory.total(), voxel, memory.triangles, limit));
        }
        if (attempt == 0) {
            coarsened =
                fmt::format("a voxel of {:g} takes {} bytes of memory, and --max-field-bytes allows {}",
                            voxel, memory.total(), limit);
            warnings.emplace_back();
        }
        // Bricks follow the surface, so their bytes go with 1 / h^2; a little more so that one step is
        // enough.
        const double excess =
            static_cast<double>(memory.samples) / static_cast<double>(limit - memory.triangles);
        voxel *= std::max(1.1, 1.05 * std::sqrt(excess));
    }
}

/// Takes an earlier bake if it fits; says why in `warnings` if the file cannot be read at all.
std::shared_ptr<const BrickGrid> reuse(const fs::path& file, const BakeKey& key, SampleBits bits,
                                       std::vector<std::string>& warnings) {
    try {
        if (!fs::exists(file) || read_bake_key(file) != key) return nullptr;
        return std::make_shared<const BrickGrid>(read_field(file), bits);
    } catch (const core::InputError& error) {
        warnings.push_back(fmt::format("an earlier bake is of no use and was replaced: {}", error.what()));
        return nullptr;
    }
}

void bake_one(const core::Scene& scene, const BakeSettings& settings, const fs::path& folder,
              MeshBake& bake) {
    const core::Mesh& mesh = scene.meshes[bake.mesh];
    const glm::dvec3 extent = usable_extent(view_of(mesh));
    const double longest = std::max({extent.x, extent.y, extent.z});
    if (!(longest > 0.0)) {
        throw core::InputError(
            core::ErrorKind::kBadData,
            fmt::format("none of its {} faces can be baked; at least one needs an area and "
                        "finite coordinates",
                        mesh.triangles.size()));
    }
    const double voxel = wanted_voxel(scene, bake.mesh, longest, settings);
    const BakeKey key{source_hash(mesh), settings_hash(voxel, settings)};
    if (!folder.empty()) {
        bake.file = folder / file_name(mesh, bake.mesh);
        if (!settings.force) bake.grid = reuse(bake.file, key, settings.sample_bits, bake.warnings);
        bake.reused = bake.grid != nullptr;
    }
    if (!bake.reused) {
        const BakedGrid baked = bake_within_limits(mesh, voxel, longest, settings, key);
        if (!folder.empty()) write_field(bake.file, baked.field, mesh.name);
        bake.grid = baked.grid;
    }
    const std::vector<std::string>& lasting = bake.info().warnings;
    bake.warnings.insert(bake.warnings.end(), lasting.begin(), lasting.end());
    bake.memory_bytes = field_memory(*bake.grid, mesh.triangles.size()).total();
    if (!bake.file.empty()) bake.file_bytes = fs::file_size(bake.file);
}

void check_settings(const core::Scene& scene, const BakeSettings& settings) {
    const auto refuse = [](const std::string& message) {
        throw core::InputError(core::ErrorKind::kUsage, message);
    };
    if (settings.voxel_world && !(*settings.voxel_world > 0.0 && std::isfinite(*settings.voxel_world))) {
        refuse(fmt::format("a voxel of {} is not possible; it must be finite and above 0",
                           *settings.voxel_world));
    }
    if (!settings.voxel_world && (settings.resolution < 1 || settings.resolution > kMostVoxelsAlongSide)) {
        refuse(fmt::format("a resolution of {} is not possible; 1 to {} is", settings.resolution,
                           kMostVoxelsAlongSide));
    }
    if (settings.max_dimension < 1 || settings.max_dimension > kMostVoxelsAlongSide) {
        refuse(fmt::format("a largest dimension of {} is not possible; 1 to {} is", settings.max_dimension,
                           kMostVoxelsAlongSide));
    }
    if (settings.only_mesh.empty()) return;
    std::vector<std::string> names;
    for (const core::Mesh& mesh : scene.meshes) {
        if (mesh.name == settings.only_mesh) return;
        names.push_back(fmt::format("'{}'", mesh.name));
    }
    constexpr std::size_t kMostNames = 12;
    const bool is_long = names.size() > kMostNames;
    names.resize(std::min(names.size(), kMostNames));
    refuse(fmt::format("'{}' has no mesh '{}'; it has {}{}", scene.name, settings.only_mesh,
                       fmt::join(names, ", "), is_long ? ", ..." : ""));
}

void make_folder(const fs::path& folder) {
    if (folder.empty()) return;
    std::error_code error;
    fs::create_directories(folder, error);
    if (error || !fs::is_directory(folder)) {
        throw core::InputError(core::ErrorKind::kCannotCreate,
                               fmt::format("'{}': the folder cannot be made ({})", folder.string(),
                                           error ? error.message() : "something else has that name"));
    }
}

/// Trouble with this mesh alone, as opposed to a folder that no mesh can be written to.
bool is_about_mesh(const core::InputError& error) {
    return error.kind() == core::ErrorKind::kBadData || error.kind() == core::ErrorKind::kOutOfMemory;
}

}  // namespace

BakeResult bake_scene(const core::Scene& scene, const BakeSettings& settings, const fs::path& folder,
                      const core::Progress& progress, const core::StopRequested& stop) {
    const auto start = std::chrono::steady_clock::now();
    check_settings(scene, settings);
    make_folder(folder);
    BakeResult result;
    double total_triangles = 0.0;
    for (std::uint32_t i = 0; i < scene.meshes.size(); ++i) {
        const core::Mesh& mesh = scene.meshes[i];
        if (!settings.only_mesh.empty() && mesh.name != settings.only_mesh) continue;
        if (mesh.triangles.empty()) continue;
        MeshBake bake;
        bake.mesh = i;
        bake.name = mesh.name;
        bake.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
        total_triangles += bake.triangle_count;
        result.meshes.push_back(std::move(bake));
    }
    std::mutex progress_mutex;
    double done_triangles = 0.0;
    core::parallel_for(result.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            MeshBake& bake = result.meshes[i];
            if (stop && stop()) return;
            const auto mesh_start = std::chrono::steady_clock::now();
            const auto fail_alone = [&](core::ErrorKind kind, const char* reason) {
                bake.grid = nullptr;
                bake.file.clear();
                bake.error =
                    core::InputError(kind, fmt::format("'{}': mesh '{}': {}", scene.name, bake.name, reason));
            };
            try {
                bake_one(scene, settings, folder, bake);
            } catch (const core::InputError& error) {
                if (!is_about_mesh(error)) throw;
                fail_alone(error.kind(), error.what());
            } catch (const std::bad_alloc&) {
                fail_alone(core::ErrorKind::kOutOfMemory,
                           "memory ran out while its field was made; a coarser one needs less");
            }
            bake.seconds = seconds_since(mesh_start);
            const std::lock_guard lock(progress_mutex);
            done_triangles += bake.triangle_count;
            if (progress) progress("bake", total_triangles > 0.0 ? done_triangles / total_triangles : 1.0);
        }
    });
    result.seconds = seconds_since(start);
    return result;
}

std::vector<std::shared_ptr<const BrickGrid>> grids_by_mesh(const core::Scene& scene,
                                                            const BakeResult& result) {
    std::vector<std::shared_ptr<const BrickGrid>> grids(scene.meshes.size());
    for (const MeshBake& bake : result.meshes) grids[bake.mesh] = bake.grid;
    return grids;
}

}  // namespace sdf
