#include "sdf/mesh_to_sdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/support/error.h"
#include "core/support/memory.h"
#include "core/support/parallel.h"
#include "sdf/bake_error.h"
#include "sdf/band.h"
#include "sdf/clean_mesh.h"
#include "sdf/thin_walls.h"
#include "sdf/triangle_bvh.h"
#include "sdf/winding_number.h"

namespace sdf {

namespace {

constexpr int kSampleCount = kLeafSize;

/// The triangles of a mesh in voxel units, by kind.
struct Sources {
    std::vector<Triangle> corners;
    std::vector<std::uint8_t> is_sheet;
    bool has_solids = false;
    bool has_sheets = false;
    bool solids_are_closed = true;
    std::optional<TriangleBvh> solids, sheets;
    std::optional<WindingNumber> winding;
};

std::vector<Triangle> corners_in_voxels(const CleanMesh& mesh, const glm::dvec3& origin, double voxel_size) {
    std::vector<Triangle> corners;
    corners.reserve(mesh.triangles.size());
    const auto to_voxels = [&](std::uint32_t vertex) {
        return (mesh.vertices[vertex] - origin) / voxel_size;
    };
    for (const glm::uvec3& triangle : mesh.triangles) {
        corners.push_back({to_voxels(triangle.x), to_voxels(triangle.y), to_voxels(triangle.z)});
    }
    return corners;
}

void build_sources(const std::vector<Component>& components, Sources& sources) {
    std::vector<std::uint32_t> solid, sheet;
    sources.is_sheet.assign(sources.corners.size(), 0);
    for (const Component& component : components) {
        std::vector<std::uint32_t>& kind = component.is_sheet ? sheet : solid;
        kind.insert(kind.end(), component.triangles.begin(), component.triangles.end());
        if (component.is_sheet) {
            for (const std::uint32_t triangle : component.triangles) sources.is_sheet[triangle] = 1;
        } else if (!component.is_closed) {
            sources.solids_are_closed = false;
        }
    }
    sources.has_solids = !solid.empty();
    sources.has_sheets = !sheet.empty();
    sources.solids.emplace(sources.corners, solid);
    sources.sheets.emplace(sources.corners, sheet);
    sources.winding.emplace(*sources.solids);
}

/// What one leaf's samples need before their signs: distances in voxels.
struct LeafDistances {
    std::array<double, kSampleCount> solid;
    std::array<double, kSampleCount> sheet;
    std::array<std::uint32_t, kSampleCount> solid_triangle;
    std::array<std::uint32_t, kSampleCount> sheet_triangle;
};

glm::ivec3 sample_position(const FieldLeaf& leaf, int i) {
    return leaf.origin + glm::ivec3(i / 64, i / 8 % 8, i % 8);
}

ClosestTriangle closest_of_kind(const Sources& sources, const FieldLeaf& leaf, int i, const glm::dvec3& point,
                                bool sheet) {
    // Nothing farther than the band matters, but the band's edge itself is only known to a voxel or so.
    constexpr double kFarthest = kBandVoxels + 3.0;
    ClosestTriangle seed{kFarthest * kFarthest, kNoTriangle};
    const std::int32_t near = leaf.triangle[static_cast<std::size_t>(i)];
    if (near >= 0 && (sources.is_sheet[static_cast<std::size_t>(near)] != 0) == sheet) {
        const glm::dvec3 offset =
            closest_point(sources.corners[static_cast<std::size_t>(near)], point).position - point;
        const double distance = glm::dot(offset, offset);
        if (distance < seed.distance_squared) seed = {distance, static_cast<std::uint32_t>(near)};
    }
    return (sheet ? *sources.sheets : *sources.solids).closest(point, seed);
}

void measure_distances(const Sources& sources, const FieldLeaf& leaf, LeafDistances& distances) {
    for (int i = 0; i < kSampleCount; ++i) {
        const auto slot = static_cast<std::size_t>(i);
        if (!leaf.is_active(i)) continue;
        const glm::dvec3 point(sample_position(leaf, i));
        const ClosestTriangle solid =
            sources.has_solids ? closest_of_kind(sources, leaf, i, point, false) : ClosestTriangle{};
        const ClosestTriangle sheet =
            sources.has_sheets ? closest_of_kind(sources, leaf, i, point, true) : ClosestTriangle{};
        distances.solid[slot] = std::sqrt(solid.distance_squared);
        distances.solid_triangle[slot] = solid.triangle;
        distances.sheet[slot] = std::sqrt(sheet.distance_squared);
        distances.sheet_triangle[slot] = sheet.triangle;
    }
}

/// Samples nearer to a triangle than this lie on it, in voxels; and how far off it its sides are asked for.
constexpr double kOnSurface = 1e-7, kOffSurface = 1e-3;

/// Signs of one leaf's active samples: true inside. Where all solids are closed, two neighbours whose
/// distances add up to more than their spacing lie on the same side, so one winding number serves each set of
/// samples linked that way. Otherwise a sign may change far from any triangle, and every sample asks.
void find_signs(const Sources& sources, const FieldLeaf& leaf, const LeafDistances& distances,
                std::array<std::uint8_t, kSampleCount>& inside) {
    inside.fill(0);
    if (!sources.has_solids) return;
    const auto ask = [&](int i) {
        const glm::dvec3 point(sample_position(leaf, i));
        const auto slot = static_cast<std::size_t>(i);
        bool is_inside = false;
        if (distances.solid[slot] < kOnSurface) {
            // On a surface there is no side to ask for. It counts as outside, save where both sides of the
            // surface lie within another solid.
            const glm::dvec3 step =
                kOffSurface * glm::normalize(sources.corners[distances.solid_triangle[slot]].scaled_normal());
            is_inside = sources.winding->is_inside(point + step) && sources.winding->is_inside(point - step);
        } else {
            is_inside = sources.winding->is_inside(point);
        }
        return is_inside ? std::uint8_t{1} : std::uint8_t{0};
    };
    if (!sources.solids_are_closed) {
        for (int i = 0; i < kSampleCount; ++i) {
            if (leaf.is_active(i)) inside[static_cast<std::size_t>(i)] = ask(i);
        }
        return;
    }
    constexpr double kSpacing = 1.0 + 1e-6;
    std::array<std::uint8_t, kSampleCount> done{};
    std::array<std::int16_t, kSampleCount> queue;
    for (int start = 0; start < kSampleCount; ++start) {
        if (!leaf.is_active(start) || done[static_cast<std::size_t>(start)]) continue;
        const std::uint8_t side = ask(start);
        std::size_t head = 0, tail = 0;
        queue[tail++] = static_cast<std::int16_t>(start);
        done[static_cast<std::size_t>(start)] = 1;
        while (head < tail) {
            const int i = queue[head++];
            inside[static_cast<std::size_t>(i)] = side;
            const int coordinates[3] = {i / 64, i / 8 % 8, i % 8};
            constexpr int kStride[3] = {64, 8, 1};
            for (int axis = 0; axis < 3; ++axis) {
                for (const int step : {-1, 1}) {
                    const int moved = coordinates[axis] + step;
                    if (moved < 0 || moved >= kLeafSide) continue;
                    const auto next = static_cast<std::size_t>(i + step * kStride[axis]);
                    if (done[next] || !leaf.is_active(static_cast<int>(next))) continue;
                    if (distances.solid[static_cast<std::size_t>(i)] + distances.solid[next] <= kSpacing) {
                        continue;
                    }
                    done[next] = 1;
                    queue[tail++] = static_cast<std::int16_t>(next);
                }
            }
        }
    }
}

/// Fills one leaf with signed distances in voxels and clean triangle numbers. Within solids all is negative,
/// on both sides of a shell's face: a ray that has been inside looks for the sheets behind it where it comes
/// out. Where a sheet lies in the opening of a solid, as a deck in a hull, one of its sides is inside; the
/// field must be as deep there as on the other side, or the ray comes out before it has reached the sheet.
void fill_leaf(const Sources& sources, FieldLeaf& leaf) {
    LeafDistances distances;
    measure_distances(sources, leaf, distances);
    std::array<std::uint8_t, kSampleCount> inside;
    find_signs(sources, leaf, distances, inside);
    for (int i = 0; i < kSampleCount; ++i) {
        const auto slot = static_cast<std::size_t>(i);
        if (!leaf.is_active(i)) {
            leaf.distance[slot] = kBandVoxels;
            leaf.triangle[slot] = -1;
            continue;
        }
        const double shell = distances.sheet[slot] - kHalfThicknessVoxels;
        const bool sheet_is_near = sources.has_sheets && shell < distances.solid[slot];
        const double magnitude =
            std::min(sheet_is_near ? shell : distances.solid[slot], static_cast<double>(kBandVoxels));
        // Inside stays inside: 0 counts as positive.
        leaf.distance[slot] =
            static_cast<float>(inside[slot] ? -std::max(std::abs(magnitude), kOnSurface) : magnitude);
        leaf.triangle[slot] = static_cast<std::int32_t>(sheet_is_near ? distances.sheet_triangle[slot]
                                                                      : distances.solid_triangle[slot]);
    }
}

/// Adds a shell of the half-thickness round what the lattice cannot hold.
void thicken(const ThinWalls& walls, std::vector<FieldLeaf>& leaves) {
    std::vector<std::uint32_t> all(walls.pieces.size());
    std::iota(all.begin(), all.end(), 0u);
    const TriangleBvh tree(walls.pieces, all);
    core::parallel_for(leaves.size(), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t leaf_number = begin; leaf_number < end; ++leaf_number) {
            FieldLeaf& leaf = leaves[leaf_number];
            for (int i = 0; i < kSampleCount; ++i) {
                if (!leaf.is_active(i)) continue;
                float& value = leaf.distance[static_cast<std::size_t>(i)];
                const double reach = value + kHalfThicknessVoxels;
                if (reach <= 0.0) continue;
                const ClosestTriangle found =
                    tree.closest(glm::dvec3(sample_position(leaf, i)), {reach * reach, kNoTriangle});
                if (found.triangle == kNoTriangle) continue;
                value = static_cast<float>(std::sqrt(found.distance_squared) - kHalfThicknessVoxels);
                leaf.triangle[static_cast<std::size_t>(i)] =
                    static_cast<std::int32_t>(walls.triangle_of_piece[found.triangle]);
            }
        }
    });
}

/// From voxels and clean triangles to local units and source triangles; drops leaves without samples.
void to_local_units(const CleanMesh& mesh, double voxel_size, std::vector<FieldLeaf>& leaves) {
    const float background = static_cast<float>(kBandVoxels * voxel_size);
    core::parallel_for(leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t number = begin; number < end; ++number) {
            FieldLeaf& leaf = leaves[number];
            for (std::size_t i = 0; i < kSampleCount; ++i) {
                // Adding 0 turns -0 into +0: a sample on the surface counts as outside.
                const float value = static_cast<float>(leaf.distance[i] * voxel_size) + 0.0f;
                leaf.distance[i] = std::clamp(value, -background, background);
                if (leaf.triangle[i] >= 0) {
                    leaf.triangle[i] = static_cast<std::int32_t>(
                        mesh.source_triangle[static_cast<std::size_t>(leaf.triangle[i])]);
                }
            }
        }
    });
}

void describe_drops(const CleanMesh& mesh, std::vector<std::string>& warnings) {
    const auto say = [&](std::uint32_t count, const char* what) {
        if (count > 0)
            warnings.push_back(fmt::format("{} face{} dropped: {}", count, count == 1 ? "" : "s", what));
    };
    say(mesh.out_of_range_count, "an index beyond the mesh's positions");
    say(mesh.not_finite_count, "a coordinate that is not finite");
    say(mesh.zero_area_count, "no area");
    say(mesh.duplicate_count, "the same three vertices as another face");
}

/// Names the thinnest wall and the resolution that holds it. Thinner spots than were seen may lie between the
/// pieces, so it is a little finer than those need.
void describe_thin_walls(const ThinWalls& found, FieldInfo& info, double longest, int most_resolution) {
    const double h = info.voxel_size;
    const auto resolution_for = [&](double thickness_voxels) {
        constexpr double kMargin = 1.05;
        return std::ceil(kMargin * kSafeThickness * longest / (thickness_voxels * h));
    };
    const ThinWalls::Walls& walls = found.walls;
    if (walls.area_fraction > 0.0) {
        const glm::dvec3 at = info.origin + h * walls.thinnest_at;
        const double all = resolution_for(walls.thinnest), most = resolution_for(walls.tenth_percentile);
        std::string cure = fmt::format("no --resolution up to {} would hold them", most_resolution);
        if (all <= most_resolution) {
            cure = fmt::format("--resolution {:.0f} would hold all", all);
        } else if (most <= most_resolution) {
            cure = fmt::format("--resolution {:.0f} would hold nine tenths of them, none up to {} all", most,
                               most_resolution);
        }
        info.warnings.push_back(fmt::format(
            "{:.3g} % of the surface bounds walls too thin for the voxel of {:g} and is thickened by "
            "{:g} on each side; the thinnest is {:g} thick, at ({:g}, {:g}, {:g}); {}",
            100.0 * walls.area_fraction, h, kHalfThicknessVoxels * h, walls.thinnest * h, at.x, at.y, at.z,
            cure));
    }
    if (found.edge_area_fraction > 0.0) {
        info.warnings.push_back(fmt::format(
            "{:.3g} % of the surface lies where sharp edges are thinner than the voxel of {:g} and is "
            "thickened by {:g} on each side, and a finer --resolution makes that less",
            100.0 * found.edge_area_fraction, h, kHalfThicknessVoxels * h));
    }
}

/// What the samples take at least: a surface passes through no fewer leaves than its area has leaf faces, but
/// through no more than there are in the box (pieces may lie on one another).
std::uint64_t least_field_bytes(const std::vector<Triangle>& corners, const glm::dvec3& extent_voxels) {
    double area = 0.0;
    for (const Triangle& triangle : corners) area += 0.5 * glm::length(triangle.scaled_normal());
    const glm::dvec3 leaves = extent_voxels / static_cast<double>(kLeafSide) + 2.0;
    const double count = std::min(area / (kLeafSide * kLeafSide), leaves.x * leaves.y * leaves.z);
    return static_cast<std::uint64_t>(count) * sizeof(FieldLeaf);
}

}  // namespace

std::string_view class_name(MeshClass value) {
    switch (value) {
        case MeshClass::kSolid:
            return "solid";
        case MeshClass::kSheet:
            return "sheet";
        case MeshClass::kMixed:
            break;
    }
    return "mixed";
}

glm::dvec3 usable_extent(const MeshView& mesh) {
    return clean_mesh(mesh).bounds.extent();
}

SampledField bake_mesh(const MeshView& mesh, const MeshBakeOptions& options) {
    const CleanMesh clean = clean_mesh(mesh);
    if (clean.triangles.empty()) {
        throw core::InputError(
            core::ErrorKind::kBadData,
            fmt::format("none of its {} faces can be baked; at least one needs an area and "
                        "finite coordinates",
                        mesh.triangles.size()));
    }
    const double h = options.voxel_size;
    const glm::dvec3 extent = clean.bounds.extent();
    const double longest = std::max({extent.x, extent.y, extent.z});
    if (!(h > 0.0) || !std::isfinite(h) || !(longest / h <= kMostVoxelsAlongSide)) {
        throw core::InputError(
            core::ErrorKind::kBadData,
            fmt::format("a voxel of {:g} gives {:g} voxels along its longest side; at most "
                        "{} can be baked",
                        h, longest / h, kMostVoxelsAlongSide));
    }

    SampledField field;
    FieldInfo& info = field.info;
    info.voxel_size = h;
    info.origin = clean.bounds.center();
    info.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
    info.dropped_faces = clean.dropped_count();
    describe_drops(clean, info.warnings);

    Sources sources;
    sources.corners = corners_in_voxels(clean, info.origin, h);
    core::require_memory(least_field_bytes(sources.corners, extent / h),
                         fmt::format("a field of {:.0f} voxels along its longest side", longest / h));
    const std::vector<Component> components =
        classify_components(clean, sources.corners, options.surface_class);
    build_sources(components, sources);
    info.mesh_class = !sources.has_sheets   ? MeshClass::kSolid
                      : !sources.has_solids ? MeshClass::kSheet
                                            : MeshClass::kMixed;

    field.leaves = find_band(sources.corners);
    core::parallel_for(field.leaves.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) fill_leaf(sources, field.leaves[i]);
    });

    std::vector<Feature> features;
    features.reserve(sources.is_sheet.size());
    for (const std::uint8_t is_sheet : sources.is_sheet) {
        features.push_back(is_sheet ? Feature::kSheet : Feature::kSurface);
    }
    bool has_thin_walls = false;
    if (sources.has_solids) {
        ThinWalls walls = find_thin_walls(sources.corners, components, *sources.solids, *sources.winding,
                                          LeafMap(field.leaves));
        if (!sources.solids_are_closed) {
            add_pieces(sources.corners, find_rims(sources.is_sheet, field.leaves), walls);
        }
        has_thin_walls = !walls.pieces.empty();
        if (has_thin_walls) {
            thicken(walls, field.leaves);
            for (const std::uint32_t triangle : walls.triangle_of_piece)
                features[triangle] = Feature::kThinWall;
            describe_thin_walls(walls, info, longest, options.most_resolution);
        }
    }
    info.half_thickness = sources.has_sheets || has_thin_walls ? kHalfThicknessVoxels * h : 0.0;
    info.clean_level_set =
        sources.has_solids && !sources.has_sheets && sources.solids_are_closed && !has_thin_walls;
    const BakedSurfaces surfaces{sources.corners, features, *sources.solids, *sources.sheets,
                                 *sources.winding};
    info.error_voxels = measure_error(surfaces, LeafMap(field.leaves));
    info.error_field_voxels = measure_field_error(surfaces, field.leaves);
    info.sign_mismatches = count_sign_mismatches(surfaces, field.leaves);

    if (info.half_thickness > 0.0) {
        field.features.assign(mesh.triangles.size(), Feature::kSurface);
        for (std::size_t i = 0; i < features.size(); ++i) {
            field.features[clean.source_triangle[i]] = features[i];
        }
    }
    to_local_units(clean, h, field.leaves);
    return field;
}

}  // namespace sdf
