#include "sdf/vdb_file.h"

#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <new>
#include <sstream>
#include <stdexcept>

#include "core/support/atomic_file.h"
#include "core/support/error.h"
#include "core/support/file_bytes.h"
#include "core/support/hash.h"
#include "core/support/memory.h"
#include "sdf/feature_ranges.h"
#include "sdf/vdb_scan.h"

namespace sdf {

namespace {

namespace fs = std::filesystem;

/// Of the files' layout and of what the samples mean; part of what decides whether a bake is used again.
constexpr const char* kWriter = "fieldlight " FIELDLIGHT_VERSION " bake 5";

constexpr const char* kDistanceGrid = "distance";
constexpr const char* kTriangleGrid = "triangle";

constexpr std::uint64_t kMostFileBytes = std::uint64_t{1} << 34;

/// Lattice coordinates beyond this do not come from a bake.
constexpr int kFarthestLattice = kMostVoxelsAlongSide / 2 + 4 * kLeafSide;

void initialize_openvdb() {
    [[maybe_unused]] static const bool once = [] {
        openvdb::initialize();
        return true;
    }();
}

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
    throw core::InputError(core::ErrorKind::kBadData, fmt::format("'{}': {}", path.string(), what));
}

/// Scans a file and opens it, hands it over, and gives whatever OpenVDB throws the file's name.
void with_open_file(const fs::path& path, const std::function<void(openvdb::io::File&)>& work) {
    initialize_openvdb();
    scan_vdb(core::read_file_bytes(path, kMostFileBytes), path.string());
    try {
        const core::ScopedCheckedAlignedMemory checked;
        openvdb::io::File file(path.string());
        // Delayed loading maps the file, and a truncated one would then kill the program at first touch.
        file.open(false);
        work(file);
        file.close();
    } catch (const core::InputError&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw core::InputError(
            core::ErrorKind::kOutOfMemory,
            fmt::format("'{}': takes more memory than there is, or is damaged and asks for it",
                        path.string()));
    } catch (const std::exception& error) {
        fail(path, fmt::format("not a whole .vdb file ({})", error.what()));
    }
}

std::string class_text(MeshClass value) {
    return std::string(class_name(value));
}

/// File units per local unit: 1, but a power of two where voxels are so small that OpenVDB takes their
/// transform for singular (it refuses a determinant under about 1e-15). Exact, so that nothing is rounded.
double file_unit(double voxel_size) {
    constexpr double kLeastVoxel = 1e-3;
    return voxel_size >= kLeastVoxel ? 1.0 : std::exp2(std::ceil(std::log2(kLeastVoxel / voxel_size)));
}

void write_metadata(const FieldInfo& info, const std::vector<Feature>& features, openvdb::MetaMap& metadata) {
    const auto text = [&](const char* name, const std::string& value) {
        metadata.insertMeta(name, openvdb::StringMetadata(value));
    };
    const auto number = [&](const char* name, double value) {
        metadata.insertMeta(name, openvdb::DoubleMetadata(value));
    };
    text("fieldlight_writer", kWriter);
    text("fieldlight_class", class_text(info.mesh_class));
    number("fieldlight_voxel", info.voxel_size);
    number("fieldlight_unit", file_unit(info.voxel_size));
    number("fieldlight_half_thickness", info.half_thickness);
    metadata.insertMeta("fieldlight_clean_level_set", openvdb::BoolMetadata(info.clean_level_set));
    metadata.insertMeta("fieldlight_triangle_count", openvdb::Int64Metadata(info.triangle_count));
    metadata.insertMeta("fieldlight_dropped_faces", openvdb::Int64Metadata(info.dropped_faces));
    number("fieldlight_error_voxels_mean", info.error_voxels.mean);
    number("fieldlight_error_voxels_p99", info.error_voxels.p99);
    number("fieldlight_error_voxels_max", info.error_voxels.max);
    number("fieldlight_error_field_voxels_mean", info.error_field_voxels.mean);
    number("fieldlight_error_field_voxels_p99", info.error_field_voxels.p99);
    number("fieldlight_error_field_voxels_max", info.error_field_voxels.max);
    metadata.insertMeta("fieldlight_sign_samples", openvdb::Int64Metadata(info.sign_mismatches.samples));
    metadata.insertMeta("fieldlight_sign_mismatches", openvdb::Int64Metadata(info.sign_mismatches.wrong));
    text("fieldlight_source_hash", info.source_hash);
    text("fieldlight_settings_hash", info.settings_hash);
    text("fieldlight_warnings", fmt::format("{}", fmt::join(info.warnings, "\n")));
    text("fieldlight_sheet_triangles", feature_ranges(features, Feature::kSheet));
    text("fieldlight_thin_wall_triangles", feature_ranges(features, Feature::kThinWall));
}

openvdb::math::Transform::Ptr make_transform(const FieldInfo& info) {
    const double unit = file_unit(info.voxel_size);
    auto transform = openvdb::math::Transform::createLinearTransform(unit * info.voxel_size);
    transform->postTranslate({unit * info.origin.x, unit * info.origin.y, unit * info.origin.z});
    return transform;
}

/// The file's header carries random bytes as an identity. They become a hash of what decides the samples, so
/// that the same bake is the same file.
void make_identity_reproducible(std::iostream& file, const FieldInfo& info) {
    constexpr std::streamoff kIdentityOffset = 21;
    constexpr std::array<std::size_t, 4> kDashes{8, 13, 18, 23};
    std::array<char, 36> identity{};
    file.seekg(kIdentityOffset);
    file.read(identity.data(), identity.size());
    for (const std::size_t dash : kDashes) {
        if (!file || identity[dash] != '-') return;
    }
    core::Hasher hasher;
    hasher.add_text(info.source_hash);
    hasher.add_text(info.settings_hash);
    const std::string digits = hasher.hex();
    std::size_t next = 0;
    for (std::size_t i = 0; i < identity.size(); ++i) {
        if (std::find(kDashes.begin(), kDashes.end(), i) == kDashes.end()) identity[i] = digits[next++];
    }
    file.seekp(kIdentityOffset);
    file.write(identity.data(), identity.size());
}

/// Writes what openvdb::io::File writes, which says nothing where the disk is full, to a stream that does.
class SeekableArchive : public openvdb::io::Archive {
public:
    void write_grids(std::ostream& stream, const openvdb::GridCPtrVec& grids) const {
        Archive::write(stream, grids, /*seekable=*/true);
    }
};

}  // namespace

void write_field(const fs::path& path, const SampledField& field, const std::string& name) {
    initialize_openvdb();
    const FieldInfo& info = field.info;
    const auto unit = static_cast<float>(file_unit(info.voxel_size));
    const auto distance = openvdb::FloatGrid::create(unit * field.background());
    const auto triangle = openvdb::Int32Grid::create(-1);
    for (const FieldLeaf& leaf : field.leaves) {
        const openvdb::Coord origin(leaf.origin.x, leaf.origin.y, leaf.origin.z);
        auto* distance_leaf = distance->tree().touchLeaf(origin);
        auto* triangle_leaf = triangle->tree().touchLeaf(origin);
        for (int i = 0; i < kLeafSize; ++i) {
            if (!leaf.is_active(i)) continue;
            const auto offset = static_cast<openvdb::Index>(i);
            distance_leaf->setValueOn(offset, unit * leaf.distance[offset]);
            triangle_leaf->setValueOn(offset, leaf.triangle[offset]);
        }
    }
    // Elsewhere a flood from leaf to leaf is only right where the surface has no holes.
    if (info.clean_level_set) openvdb::tools::signedFloodFill(distance->tree());
    distance->setTransform(make_transform(info));
    triangle->setTransform(make_transform(info));
    distance->setName(kDistanceGrid);
    triangle->setName(kTriangleGrid);
    distance->setGridClass(info.clean_level_set ? openvdb::GRID_LEVEL_SET : openvdb::GRID_UNKNOWN);
    write_metadata(info, field.features, *distance);
    distance->insertMeta("fieldlight_mesh", openvdb::StringMetadata(name));

    core::write_file_atomically(path, [&](const fs::path& temporary) {
        try {
            const core::ScopedCheckedAlignedMemory checked;
            std::fstream file(temporary, std::ios::in | std::ios::out | std::ios::binary | std::ios::trunc);
            SeekableArchive archive;
            archive.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
            archive.write_grids(file, {distance, triangle});
            make_identity_reproducible(file, info);
            file.close();
            if (!file) throw std::runtime_error("not all bytes could be written; the disk may be full");
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception& error) {
            throw core::InputError(core::ErrorKind::kInputOutput,
                                   fmt::format("'{}': cannot be written ({})", path.string(), error.what()));
        }
    });
}

namespace {

/// Typed access to metadata that must be there.
class MetadataReader {
public:
    MetadataReader(const fs::path& path, const openvdb::MetaMap& metadata)
        : path_(path), metadata_(metadata) {}

    template <typename T>
    T get(const char* name) const {
        const auto found = metadata_.getMetadata<openvdb::TypedMetadata<T>>(name);
        if (!found)
            fail(path_,
                 fmt::format("grid '{}' has no metadata '{}'; bake the mesh again", kDistanceGrid, name));
        return found->value();
    }
    double finite(const char* name) const {
        const double value = get<double>(name);
        if (!std::isfinite(value) || value < 0.0) {
            fail(path_, fmt::format("metadata '{}' is {}; it must be finite and not negative", name, value));
        }
        return value;
    }
    std::uint32_t count(const char* name) const {
        const std::int64_t value = get<std::int64_t>(name);
        if (value < 0 || value > std::numeric_limits<std::int32_t>::max()) {
            fail(path_, fmt::format("metadata '{}' is {}, which is no count", name, value));
        }
        return static_cast<std::uint32_t>(value);
    }

private:
    const fs::path& path_;
    const openvdb::MetaMap& metadata_;
};

MeshClass parse_class(const fs::path& path, const std::string& text) {
    for (const MeshClass value : {MeshClass::kSolid, MeshClass::kSheet, MeshClass::kMixed}) {
        if (text == class_name(value)) return value;
    }
    fail(path, fmt::format("class '{}' is unknown; solid, sheet or mixed is needed", text));
}

std::vector<std::string> split_lines(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

FieldInfo read_info(const fs::path& path, const openvdb::MetaMap& metadata) {
    const MetadataReader reader(path, metadata);
    FieldInfo info;
    const std::string writer = reader.get<std::string>("fieldlight_writer");
    if (writer != kWriter) {
        fail(path, fmt::format("baked by '{}', and this is '{}'; bake it again", writer, kWriter));
    }
    info.mesh_class = parse_class(path, reader.get<std::string>("fieldlight_class"));
    info.voxel_size = reader.finite("fieldlight_voxel");
    info.half_thickness = reader.finite("fieldlight_half_thickness");
    info.clean_level_set = reader.get<bool>("fieldlight_clean_level_set");
    info.triangle_count = reader.count("fieldlight_triangle_count");
    info.dropped_faces = reader.count("fieldlight_dropped_faces");
    info.error_voxels = {reader.finite("fieldlight_error_voxels_mean"),
                         reader.finite("fieldlight_error_voxels_p99"),
                         reader.finite("fieldlight_error_voxels_max")};
    info.error_field_voxels = {reader.finite("fieldlight_error_field_voxels_mean"),
                               reader.finite("fieldlight_error_field_voxels_p99"),
                               reader.finite("fieldlight_error_field_voxels_max")};
    info.sign_mismatches = {reader.count("fieldlight_sign_samples"),
                            reader.count("fieldlight_sign_mismatches")};
    info.source_hash = reader.get<std::string>("fieldlight_source_hash");
    info.settings_hash = reader.get<std::string>("fieldlight_settings_hash");
    info.warnings = split_lines(reader.get<std::string>("fieldlight_warnings"));
    return info;
}

void check_transform(const fs::path& path, const openvdb::math::Transform& transform, FieldInfo& info) {
    const openvdb::Vec3d voxel = transform.voxelSize();
    const double unit = file_unit(info.voxel_size);
    if (!transform.isLinear() || !transform.hasUniformScale() || !(voxel[0] > 0.0) ||
        !(std::abs(voxel[0] - unit * info.voxel_size) <= 1e-12 * unit * info.voxel_size)) {
        fail(path, fmt::format("the transform scales by ({}, {}, {}); a uniform {} is needed", voxel[0],
                               voxel[1], voxel[2], unit * info.voxel_size));
    }
    const openvdb::Vec3d origin = transform.indexToWorld(openvdb::Vec3d(0.0));
    info.origin = {origin[0] / unit, origin[1] / unit, origin[2] / unit};
    if (!std::isfinite(info.origin.x + info.origin.y + info.origin.z)) {
        fail(path, "the transform is not finite");
    }
}

template <typename Grid>
typename Grid::Ptr read_grid(const fs::path& path, openvdb::io::File& file, const char* name) {
    if (!file.hasGrid(name)) fail(path, fmt::format("has no grid '{}'; bake the mesh again", name));
    auto grid = openvdb::gridPtrCast<Grid>(file.readGrid(name));
    if (!grid) fail(path, fmt::format("grid '{}' must be of type {}", name, Grid::gridType()));
    return grid;
}

FieldLeaf read_leaf(const fs::path& path, const openvdb::FloatTree::LeafNodeType& distances,
                    const openvdb::Int32Tree& triangles, const FieldInfo& info, float background) {
    const auto unit = static_cast<float>(file_unit(info.voxel_size));
    const openvdb::Coord origin = distances.origin();
    FieldLeaf leaf;
    leaf.origin = {origin.x(), origin.y(), origin.z()};
    for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(leaf.origin[axis]) > kFarthestLattice) {
            fail(path, fmt::format("has samples at lattice coordinate {}; at most {} can be",
                                   leaf.origin[axis], kFarthestLattice));
        }
    }
    const auto* triangle_leaf = triangles.probeConstLeaf(origin);
    leaf.distance.fill(background);
    leaf.triangle.fill(-1);
    for (auto value = distances.cbeginValueOn(); value; ++value) {
        const auto i = static_cast<std::size_t>(value.pos());
        const float sample = *value / unit;
        if (!(std::abs(sample) <= background)) {
            fail(path, fmt::format("a sample is {}; all must be numbers within the background of {}", sample,
                                   background));
        }
        const std::int32_t triangle = triangle_leaf ? triangle_leaf->getValue(value.pos()) : -1;
        if (triangle < -1 || triangle >= static_cast<std::int64_t>(info.triangle_count)) {
            fail(path, fmt::format("a sample names triangle {} of {}", triangle, info.triangle_count));
        }
        leaf.set_active(static_cast<int>(i));
        leaf.distance[i] = sample;
        leaf.triangle[i] = triangle;
    }
    return leaf;
}

}  // namespace

SampledField read_field(const fs::path& path) {
    SampledField field;
    with_open_file(path, [&](openvdb::io::File& file) {
        const auto distance = read_grid<openvdb::FloatGrid>(path, file, kDistanceGrid);
        const auto triangle = read_grid<openvdb::Int32Grid>(path, file, kTriangleGrid);
        field.info = read_info(path, *distance);
        check_transform(path, distance->transform(), field.info);
        const float background = field.background();
        const auto unit = static_cast<float>(file_unit(field.info.voxel_size));
        if (!(distance->background() > 0.0f) || distance->background() != unit * background) {
            fail(path, fmt::format("the background is {}; {} voxels, {}, are needed", distance->background(),
                                   kBandVoxels, unit * background));
        }
        field.leaves.reserve(distance->tree().leafCount());
        for (auto leaf = distance->tree().cbeginLeaf(); leaf; ++leaf) {
            field.leaves.push_back(read_leaf(path, *leaf, triangle->tree(), field.info, background));
        }
        std::sort(field.leaves.begin(), field.leaves.end(), [](const FieldLeaf& a, const FieldLeaf& b) {
            return std::array{a.origin.x, a.origin.y, a.origin.z} <
                   std::array{b.origin.x, b.origin.y, b.origin.z};
        });
        const MetadataReader reader(path, *distance);
        for (const auto& [name, feature] :
             {std::pair{"fieldlight_sheet_triangles", Feature::kSheet},
              std::pair{"fieldlight_thin_wall_triangles", Feature::kThinWall}}) {
            if (!parse_feature_ranges(reader.get<std::string>(name), feature, field.info.triangle_count,
                                      field.features)) {
                fail(path, fmt::format("metadata '{}' is no list of ranges of triangles", name));
            }
        }
    });
    return field;
}

std::optional<BakeKey> read_bake_key(const fs::path& path) {
    std::optional<BakeKey> key;
    with_open_file(path, [&](openvdb::io::File& file) {
        if (!file.hasGrid(kDistanceGrid)) return;
        const auto grid = file.readGridMetadata(kDistanceGrid);
        const auto text = [&](const char* name) {
            const auto found = grid->getMetadata<openvdb::StringMetadata>(name);
            return found ? found->value() : std::string();
        };
        if (text("fieldlight_writer") != kWriter) return;
        key = BakeKey{text("fieldlight_source_hash"), text("fieldlight_settings_hash")};
    });
    return key;
}

namespace {

template <typename Grid>
std::uint64_t count_nan(const Grid& grid) {
    std::uint64_t count = 0;
    for (auto value = grid.cbeginValueOn(); value; ++value) {
        if constexpr (std::is_floating_point_v<typename Grid::ValueType>) {
            count += std::isnan(*value);
        } else {
            count += std::isnan((*value)[0]) || std::isnan((*value)[1]) || std::isnan((*value)[2]);
        }
    }
    return count;
}

std::uint64_t count_nan(const openvdb::GridBase& grid) {
    std::uint64_t count = 0;
    grid.apply<
        openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Vec3SGrid, openvdb::Vec3DGrid>>(
        [&](const auto& typed) { count = count_nan(typed); });
    return count;
}

VdbGridSummary summarise(const openvdb::GridBase& grid) {
    VdbGridSummary summary;
    summary.name = grid.getName();
    summary.type = grid.valueType();
    summary.grid_class = openvdb::GridBase::gridClassToString(grid.getGridClass());
    const openvdb::Vec3d voxel = grid.voxelSize();
    summary.voxel_size = {voxel[0], voxel[1], voxel[2]};
    summary.active_voxels = grid.activeVoxelCount();
    summary.bytes = grid.memUsage();
    summary.has_voxels = summary.active_voxels > 0;
    if (summary.has_voxels) {
        const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
        const openvdb::BBoxd world = grid.transform().indexToWorld(box);
        summary.minimum = {world.min()[0], world.min()[1], world.min()[2]};
        summary.maximum = {world.max()[0], world.max()[1], world.max()[2]};
    }
    summary.nan_samples = count_nan(grid);
    for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry) {
        summary.metadata[entry->first] = entry->second->str();
    }
    return summary;
}

}  // namespace

namespace {

VdbSlice cut(const fs::path& path, const openvdb::FloatGrid& grid, int axis, double at) {
    constexpr int kMostVoxels = 4096;
    const openvdb::Vec3d size = grid.voxelSize();
    if (!grid.hasUniformVoxels() || !(size[0] > 0.0)) fail(path, "its voxels are not cubes");
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    if (box.empty()) fail(path, fmt::format("grid '{}' has no active voxel", grid.getName()));
    const openvdb::Coord extent = box.dim();
    for (int i = 0; i < 3; ++i) {
        if (extent[i] < 1 || extent[i] > kMostVoxels) {
            fail(path,
                 fmt::format("spans {} voxels along a side; at most {} are drawn", extent[i], kMostVoxels));
        }
    }
    // Columns and rows of the picture; rows run down.
    const int column_axis = axis == 0 ? 2 : 0, row_axis = axis == 1 ? 2 : 1;
    openvdb::Coord point;
    point[axis] = box.min()[axis] + static_cast<int>(std::lround(at * (extent[axis] - 1)));

    VdbSlice slice;
    slice.grid = grid.getName();
    slice.width = extent[column_axis];
    slice.height = extent[row_axis];
    slice.background_voxels = std::abs(static_cast<double>(grid.background())) / size[0];
    slice.position = grid.indexToWorld(point)[axis];
    slice.distance_voxels.reserve(static_cast<std::size_t>(slice.width) *
                                  static_cast<std::size_t>(slice.height));
    const auto values = grid.getConstAccessor();
    for (int row = 0; row < slice.height; ++row) {
        point[row_axis] = axis == 1 ? box.min()[row_axis] + row : box.max()[row_axis] - row;
        for (int column = 0; column < slice.width; ++column) {
            point[column_axis] = box.min()[column_axis] + column;
            slice.distance_voxels.push_back(static_cast<float>(values.getValue(point) / size[0]));
        }
    }
    return slice;
}

}  // namespace

VdbSlice read_vdb_slice(const fs::path& path, int axis, double at) {
    std::optional<VdbSlice> slice;
    with_open_file(path, [&](openvdb::io::File& file) {
        const auto grids = file.getGrids();
        for (const auto& grid : *grids) {
            const auto distances = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
            if (distances && !slice) slice = cut(path, *distances, axis, at);
        }
    });
    if (!slice) fail(path, "holds no grid of floats to draw");
    return *std::move(slice);
}

std::vector<VdbGridSummary> summarise_vdb(const fs::path& path) {
    std::vector<VdbGridSummary> summaries;
    with_open_file(path, [&](openvdb::io::File& file) {
        const auto grids = file.getGrids();
        for (const auto& grid : *grids) summaries.push_back(summarise(*grid));
    });
    return summaries;
}

}  // namespace sdf
