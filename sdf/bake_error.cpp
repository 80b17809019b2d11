#include "sdf/bake_error.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/support/parallel.h"
#include "sdf/distance.h"
#include "sdf/surface_samples.h"

namespace sdf {

namespace {

constexpr std::size_t kMostSamples = 100'000, kFewestSamples = 2'000;

/// As many points as a small surface needs: this many a square voxel.
constexpr double kSamplesPerArea = 2.0;

/// An error so large that the point may be buried in another solid.
constexpr double kSuspectVoxels = 0.5;

/// Samples of the band among which cells with a crossing are looked for: about one in eight has one, and each
/// such cell gives about one point of the isosurface. Enough for the 99th percentile, at a few percent of the
/// bake's time.
constexpr std::size_t kMostCandidates = 80'000;

/// Times that a cell is sampled where there are few of them.
constexpr std::size_t kMostRepeats = 16;

/// The closer a sample lies to the surface, the less its sign says.
constexpr double kSignMargin = 0.01;

double error_at(const SurfaceSample& sample, bool inflated, const WindingNumber& winding,
                const LeafMap& field) {
    double value = 0.0;
    if (!field.interpolate(sample.position, value)) return kBandVoxels;
    double error = std::abs(value);
    if (inflated) error = std::min(error, std::abs(error - kHalfThicknessVoxels));
    if (error > kSuspectVoxels) {
        const glm::dvec3 step = 0.25 * sample.normal;
        if (winding.is_inside(sample.position + step) && winding.is_inside(sample.position - step)) {
            return -1.0;
        }
    }
    return error;
}

std::size_t sample_count(const std::vector<Triangle>& corners) {
    double area = 0.0;
    for (const Triangle& triangle : corners) area += 0.5 * glm::length(triangle.scaled_normal());
    return static_cast<std::size_t>(std::clamp(kSamplesPerArea * area, static_cast<double>(kFewestSamples),
                                               static_cast<double>(kMostSamples)));
}

ErrorFigures figures_of(std::vector<double>& errors) {
    ErrorFigures figures;
    if (errors.empty()) return figures;
    std::sort(errors.begin(), errors.end());
    figures.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
    figures.p99 = errors[std::min(errors.size() - 1, errors.size() * 99 / 100)];
    figures.max = errors.back();
    return figures;
}

/// A number for a lattice point that has nothing to do with its neighbours' (splitmix64).
std::uint64_t hash_of(const glm::ivec3& point, std::uint64_t salt) {
    std::uint64_t state = salt;
    for (int axis = 0; axis < 3; ++axis) {
        state += 0x9e3779b97f4a7c15u + static_cast<std::uint32_t>(point[axis]);
        state = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9u;
        state = (state ^ (state >> 27)) * 0x94d049bb133111ebu;
        state ^= state >> 31;
    }
    return state;
}

/// In [0, 1), of 16 bits of a hash.
double fraction_of(std::uint64_t hash, int which) {
    return (static_cast<double>(hash >> (16 * which) & 0xffff) + 0.5) / 65536.0;
}

glm::ivec3 position_of(const FieldLeaf& leaf, int i) {
    return leaf.origin + glm::ivec3(i / 64, i / 8 % 8, i % 8);
}

std::size_t active_count(const std::vector<FieldLeaf>& leaves) {
    std::size_t count = 0;
    for (const FieldLeaf& leaf : leaves) {
        for (const std::uint64_t word : leaf.active) count += static_cast<std::size_t>(std::popcount(word));
    }
    return count;
}

/// A cell that the surface passes through.
struct CrossedCell {
    glm::ivec3 position{0};
    CellCorners corners;
    std::array<std::int32_t, 8> triangle{};  ///< Of the corners.
};

/// Looks at the cell above a sample.
bool load_crossed(const LeafMap& map, const glm::ivec3& position, CrossedCell& cell) {
    int negative = 0;
    for (int i = 0; i < 8; ++i) {
        const glm::ivec3 corner = position + glm::ivec3(i >> 2, i >> 1 & 1, i & 1);
        const FieldLeaf* leaf = map.find(corner);
        const int offset = LeafMap::offset_in_leaf(corner);
        if (!leaf || !leaf->is_active(offset)) return false;
        const auto at = static_cast<std::size_t>(i);
        cell.corners.value[at] = leaf->distance[static_cast<std::size_t>(offset)];
        cell.triangle[at] = leaf->triangle[static_cast<std::size_t>(offset)];
        negative += cell.corners.value[at] < 0.0;
    }
    cell.position = position;
    return negative != 0 && negative != 8;
}

std::vector<CrossedCell> crossed_cells(const std::vector<FieldLeaf>& leaves) {
    const LeafMap map(leaves);
    const std::size_t stride = active_count(leaves) / kMostCandidates + 1;
    std::vector<std::vector<CrossedCell>> found(leaves.size());
    core::parallel_for(leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
        CrossedCell cell;
        for (std::size_t number = begin; number < end; ++number) {
            for (int i = 0; i < kLeafSize; ++i) {
                if (!leaves[number].is_active(i)) continue;
                const glm::ivec3 position = position_of(leaves[number], i);
                if (stride > 1 && hash_of(position, 1) % stride != 0) continue;
                if (load_crossed(map, position, cell)) found[number].push_back(cell);
            }
        }
    });
    std::vector<CrossedCell> cells;
    for (const auto& of_leaf : found) cells.insert(cells.end(), of_leaf.begin(), of_leaf.end());
    return cells;
}

/// Distance to the closest triangle of one kind; seeded by those that the cell's corners name.
ClosestTriangle closest_in(const TriangleBvh& tree, const BakedSurfaces& surfaces, const CrossedCell& cell,
                           bool sheets, const glm::dvec3& point) {
    ClosestTriangle seed{static_cast<double>(kBandVoxels) * kBandVoxels, kNoTriangle};
    if (tree.empty()) return seed;
    for (const std::int32_t triangle : cell.triangle) {
        if (triangle < 0) continue;
        const auto index = static_cast<std::size_t>(triangle);
        if ((surfaces.features[index] == Feature::kSheet) != sheets) continue;
        const glm::dvec3 offset = closest_point(surfaces.corners[index], point).position - point;
        const double squared = glm::dot(offset, offset);
        if (squared < seed.distance_squared) seed = {squared, static_cast<std::uint32_t>(triangle)};
    }
    return tree.closest(point, seed);
}

double field_error_at(const BakedSurfaces& surfaces, const CrossedCell& cell, const glm::dvec3& point) {
    const ClosestTriangle solid = closest_in(surfaces.solids, surfaces, cell, false, point);
    double error = std::sqrt(solid.distance_squared);
    if (!surfaces.sheets.empty()) {
        const ClosestTriangle sheet = closest_in(surfaces.sheets, surfaces, cell, true, point);
        error = std::min(error, std::abs(std::sqrt(sheet.distance_squared) - kHalfThicknessVoxels));
    }
    // The shell of a thin wall, beside which a triangle without one may be nearer.
    for (const std::int32_t triangle : cell.triangle) {
        if (triangle < 0) continue;
        const auto index = static_cast<std::size_t>(triangle);
        if (surfaces.features[index] != Feature::kThinWall) continue;
        const double distance = glm::distance(closest_point(surfaces.corners[index], point).position, point);
        error = std::min(error, std::abs(distance - kHalfThicknessVoxels));
    }
    return error;
}

/// Along an axis the trilinear field is linear, so that lines parallel to the axes meet the isosurface where
/// a division says. Lines along axis k meet a piece of normal n in proportion to |n_k|; taking one in
/// |n_x| + |n_y| + |n_z| of the points spreads them evenly over the area.
void add_errors(const BakedSurfaces& surfaces, const CrossedCell& cell, std::uint64_t round,
                std::vector<double>& errors) {
    for (int axis = 0; axis < 3; ++axis) {
        const std::uint64_t hash = hash_of(cell.position, 3 * round + static_cast<std::uint64_t>(axis) + 2);
        glm::dvec3 u(0.0);
        u[(axis + 1) % 3] = fraction_of(hash, 0);
        u[(axis + 2) % 3] = fraction_of(hash, 1);
        const double near = cell.corners.at(u);
        u[axis] = 1.0;
        const double far = cell.corners.at(u);
        if ((near < 0.0) == (far < 0.0)) continue;
        u[axis] = near / (near - far);
        glm::dvec3 gradient(0.0);
        for (int k = 0; k < 3; ++k) {
            glm::dvec3 low = u, high = u;
            low[k] = 0.0;
            high[k] = 1.0;
            gradient[k] = cell.corners.at(high) - cell.corners.at(low);
        }
        const double sum = std::abs(gradient.x) + std::abs(gradient.y) + std::abs(gradient.z);
        if (fraction_of(hash, 2) * sum >= glm::length(gradient)) continue;
        errors.push_back(field_error_at(surfaces, cell, glm::dvec3(cell.position) + u));
    }
}

/// |w| >= 0.5 by a sum that no expansion can turn over: with this beta it is off by some 1e-3.
bool is_inside_exactly(const WindingNumber& winding, const glm::dvec3& point) {
    constexpr double kBeta = 4.0, kDoubtful = 0.1;
    double w = std::abs(winding.at(point, kBeta));
    if (std::abs(w - 0.5) < kDoubtful) {
        w = std::abs(winding.at(point, std::numeric_limits<double>::infinity()));
    }
    return w >= 0.5;
}

}  // namespace

ErrorFigures measure_error(const BakedSurfaces& surfaces, const LeafMap& field) {
    const SurfaceSamples samples(surfaces.corners, sample_count(surfaces.corners));
    std::vector<double> errors(sample_count(surfaces.corners));
    core::parallel_for(errors.size(), 512, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const SurfaceSample sample = samples.at(i);
            errors[i] = error_at(sample, surfaces.features[sample.triangle] != Feature::kSurface,
                                 surfaces.winding, field);
        }
    });
    std::erase_if(errors, [](double error) { return error < 0.0; });
    return figures_of(errors);
}

ErrorFigures measure_field_error(const BakedSurfaces& surfaces, const std::vector<FieldLeaf>& leaves) {
    const std::vector<CrossedCell> cells = crossed_cells(leaves);
    if (cells.empty()) return {};
    const std::size_t rounds = std::min(kMostRepeats, kFewestSamples / cells.size() + 1);
    constexpr std::size_t kGrain = 256;
    std::vector<std::vector<double>> parts((cells.size() + kGrain - 1) / kGrain);
    core::parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t part = begin; part < end; ++part) {
            for (std::size_t i = part * kGrain; i < std::min(cells.size(), (part + 1) * kGrain); ++i) {
                for (std::size_t round = 0; round < rounds; ++round) {
                    add_errors(surfaces, cells[i], round, parts[part]);
                }
            }
        }
    });
    std::vector<double> errors;
    for (const auto& part : parts) errors.insert(errors.end(), part.begin(), part.end());
    return figures_of(errors);
}

SignMismatches count_sign_mismatches(const BakedSurfaces& surfaces, const std::vector<FieldLeaf>& leaves,
                                     std::size_t most) {
    if (surfaces.solids.empty()) return {};
    const std::size_t stride = active_count(leaves) / most + 1;
    std::vector<SignMismatches> parts(leaves.size());
    core::parallel_for(leaves.size(), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t number = begin; number < end; ++number) {
            const FieldLeaf& leaf = leaves[number];
            for (int i = 0; i < kLeafSize; ++i) {
                if (!leaf.is_active(i)) continue;
                const glm::ivec3 position = position_of(leaf, i);
                if (stride > 1 && hash_of(position, 0) % stride != 0) continue;
                const double value = leaf.distance[static_cast<std::size_t>(i)];
                const std::int32_t triangle = leaf.triangle[static_cast<std::size_t>(i)];
                if (!(std::abs(value) > kSignMargin)) continue;
                if (triangle >= 0 &&
                    surfaces.features[static_cast<std::size_t>(triangle)] != Feature::kSurface) {
                    continue;
                }
                ++parts[number].samples;
                parts[number].wrong +=
                    (value < 0.0) != is_inside_exactly(surfaces.winding, glm::dvec3(position));
            }
        }
    });
    SignMismatches total;
    for (const SignMismatches& part : parts) {
        total.samples += part.samples;
        total.wrong += part.wrong;
    }
    return total;
}

}  // namespace sdf
