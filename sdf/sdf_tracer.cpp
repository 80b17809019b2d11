#include "sdf/sdf_tracer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <set>

#include "core/support/parallel.h"
#include "core/trace/surface.h"
#include "sdf/border_edges.h"
#include "sdf/cell_triangles.h"
#include "sdf/transform_scale.h"

namespace sdf {

namespace {

/// How far off a solid's surface rays start that leave it. The solver's own error is far smaller; this clears
/// the facets of the trilinear surface, which rise 1 / 8r over the smooth surface that the normal belongs to,
/// r its radius in voxels.
constexpr double kSurfaceClearanceVoxels = 0.05;

/// A crossing farther than this from every stored triangle is the lid with which the winding number closes a
/// hole of the mesh, and no surface. Where the sign changes at the mesh, the surface passes through the cell,
/// whose diagonal is 1.74.
constexpr double kFarthestTriangleVoxels = 2.0;

/// A triangle of a thin wall may be thickened in one place and not in another. Beyond this distance a hit
/// lies on the thickened shell: that of a flat sheet is found at 0.32 to 0.78 voxels, plain surfaces nearer
/// than 0.2.
constexpr double kShellVoxels = 0.25;

/// The shell's surface lies no farther than this from the plane of the triangle it stands for.
constexpr double kShellReachVoxels = 0.9;

/// No ray is taken to be within one shell for longer.
constexpr double kShellPassageVoxels = 8.0;

/// Room between a ray that leaves a shell and the shell.
constexpr double kShellClearanceVoxels = 0.05;

constexpr double kNever = std::numeric_limits<double>::infinity();

glm::dvec3 triangle_normal(const core::Mesh& mesh, std::uint32_t index) {
    const glm::uvec3& corners = mesh.triangles[index];
    const glm::dvec3 a(mesh.positions[corners.x]);
    return glm::normalize(
        glm::cross(glm::dvec3(mesh.positions[corners.y]) - a, glm::dvec3(mesh.positions[corners.z]) - a));
}

/// Four units in the last place of a float of this magnitude.
double four_ulp(double magnitude) {
    return 4.0 * magnitude * static_cast<double>(std::numeric_limits<float>::epsilon());
}

/// Whether the closest point lies on a border edge that the ray passes beyond.
bool touches_border(const TriangleHit& hit, std::uint8_t beyond, std::uint8_t borders) {
    const glm::dvec2& b = hit.point.barycentrics;
    const unsigned touched =
        (1.0 - b.x - b.y <= 0.0 ? 1u : 0u) | (b.x <= 0.0 ? 2u : 0u) | (b.y <= 0.0 ? 4u : 0u);
    return (touched & beyond & borders) != 0;
}

}  // namespace

/// A ray in an instance's voxels, and what it has met there so far.
struct SdfTracer::LocalRay {
    const core::Ray& world;
    std::uint32_t instance;
    const PlacedGrid& placed;
    const core::Mesh& mesh;
    glm::dvec3 origin;     ///< Voxel coordinates.
    glm::dvec3 direction;  ///< Voxels a world unit.
    /// From where on the ray may have come into a shell without meeting its surface: at first its start, for
    /// it may start within one.
    double unmet_since;
};

/// The nearest visible crossing so far.
struct SdfTracer::Nearest {
    double t = 0.0;  ///< Until there is one: t_max.
    std::uint32_t instance = core::kNoIndex;
    std::uint32_t triangle = core::kNoIndex;
    glm::dvec2 barycentrics{0.0};
    bool is_front = true;
    bool is_shell = false;
    Crossing crossing;

    bool found() const { return instance != core::kNoIndex; }
};

struct SdfTracer::Work {
    std::uint64_t rays = 0;
    std::uint64_t steps = 0;
    std::uint64_t exhausted = 0;
    std::uint32_t ray_steps = 0;
    bool ray_exhausted = false;
};

SdfTracer::SdfTracer(const core::Scene& scene, std::vector<std::shared_ptr<const BrickGrid>> grids)
    : scene_(scene), grids_(std::move(grids)), has_alpha_(core::has_alpha(scene)) {
    assert(grids_.size() == scene.meshes.size());
    borders_.resize(grids_.size());
    core::parallel_for(grids_.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!grids_[i] || grids_[i]->half_thickness_voxels() == 0.0) continue;
            borders_[i] = find_border_edges({scene.meshes[i].positions, scene.meshes[i].triangles});
        }
    });
    std::vector<core::DoubleBounds> boxes(scene.instances.size());
    placed_.resize(scene.instances.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const core::Instance& instance = scene.instances[i];
        const BrickGrid* grid = grids_[instance.mesh].get();
        if (!grid || grid->traced_voxels().empty()) continue;
        const double h = grid->voxel_size();
        PlacedGrid& placed = placed_[i];
        placed.grid = grid;
        placed.borders = &borders_[instance.mesh];
        placed.voxel_from_world_direction = glm::dmat3(instance.local_from_world) / h;
        placed.voxel_origin = (glm::dvec3(instance.local_from_world[3]) - grid->origin()) / h;
        placed.world_from_voxel_scale = largest_singular_value(glm::dmat3(instance.world_from_local)) * h;
        const double representation = std::min(grid->info().error_voxels.max, 1.0);
        placed.start_offset =
            static_cast<float>(placed.world_from_voxel_scale *
                               (grid->half_thickness_voxels() + representation + kShellClearanceVoxels));
        boxes[i] = core::transformed(grid->local_bounds(), instance.world_from_local);
        // The corners are rounded; rays are clipped exactly later, in the grid's own space.
        const glm::dvec3 slack =
            1e-12 * (glm::abs(boxes[i].minimum) + glm::abs(boxes[i].maximum)) + 1e-6 * boxes[i].extent();
        boxes[i].minimum -= slack;
        boxes[i].maximum += slack;
    }
    tree_ = InstanceTree(boxes);
}

bool SdfTracer::resolve(LocalRay& ray, const Crossing& crossing, Nearest& found) const {
    const BrickGrid& grid = *ray.placed.grid;
    const double h = grid.voxel_size();
    const glm::ivec3 cell = crossing.cell - crossing.cell / kBrickCells * kBrickCells;
    const CellTriangles triangles(ray.mesh, grid.brick_at(crossing.brick), cell);
    const glm::dvec3 point = grid.origin() + h * (glm::dvec3(crossing.cell) + crossing.point);
    TriangleHit hit = triangles.closest(point);
    if (!hit) return false;
    const Feature feature = grid.feature(hit.index);
    const double farthest =
        kFarthestTriangleVoxels + (feature == Feature::kSurface ? 0.0 : kHalfThicknessVoxels);
    if (hit.distance > farthest * h) return false;
    found.is_shell =
        feature == Feature::kSheet || (feature == Feature::kThinWall && hit.distance > kShellVoxels * h);
    if (found.is_shell && !resolve_shell(ray, crossing.t, point, triangles, hit)) return false;

    found.triangle = hit.index;
    found.barycentrics = hit.point.barycentrics;
    if (has_alpha_ && !core::is_visible(scene_, ray.instance, found.triangle, glm::vec2(found.barycentrics),
                                        ray.world.seed)) {
        return false;
    }
    found.t = crossing.t;
    found.instance = ray.instance;
    // Directions in voxels and in local units differ by h alone, which no sign depends on.
    found.is_front = glm::dot(ray.direction, hit.corners.scaled_normal()) < 0.0;
    found.crossing = crossing;
    return true;
}

/// Whether a crossing of a thickened shell is a hit of the surface within, and at which of its triangles.
bool SdfTracer::resolve_shell(LocalRay& ray, double t, const glm::dvec3& point,
                              const CellTriangles& triangles, TriangleHit& hit) const {
    const BrickGrid& grid = *ray.placed.grid;
    const double h = grid.voxel_size();
    const glm::dvec3 origin = grid.origin() + h * ray.origin;
    const glm::dvec3 direction = h * ray.direction;
    const double reach = kShellReachVoxels * h;
    const bool leaves = glm::dot(point - hit.point.position, ray.direction) > 0.0;
    if (leaves) {
        // Only what lies between here and the place where the ray came to be in the shell without having met
        // anything: its start, or the rim.
        const TriangleHit met = triangles.first_met(origin, direction, ray.unmet_since, t, point, reach);
        ray.unmet_since = kNever;
        if (met) hit = met;
        return static_cast<bool>(met);
    }
    const double t_far = t + kShellPassageVoxels / glm::length(ray.direction);
    const TriangleHit met = triangles.first_met(origin, direction, t, t_far, point, reach);
    if (met) {
        // The point that the ray truly meets: alpha and uv as they are on triangles. If it turns out
        // transparent, another triangle within the same shell may still be met.
        hit = met;
        ray.unmet_since = std::nextafter(met.t, kNever);
        return true;
    }
    if (passes_rim(ray, hit, origin, direction, t_far)) {
        ray.unmet_since = t;
        return false;
    }
    return true;
}

/// Whether a ray that comes into a shell near the triangle of `hit`, and meets none there, only passes the
/// rim beyond the sheet's border. Follows the ray to where it comes through the sheet's plane, cell by cell,
/// since a slanted ray does so some way off. If it meets a triangle there, `hit` becomes that.
bool SdfTracer::passes_rim(LocalRay& ray, TriangleHit& hit, const glm::dvec3& origin,
                           const glm::dvec3& direction, double t_far) const {
    constexpr int kMostSteps = 4;
    const BrickGrid& grid = *ray.placed.grid;
    const double reach = kShellReachVoxels * grid.voxel_size();
    ray.unmet_since = kNever;
    TriangleHit near = hit;
    for (int step = 0; step < kMostSteps; ++step) {
        const PlanePassage passage = pass_plane(near.corners, origin, direction);
        const std::uint8_t borders = (*ray.placed.borders)[near.index];
        const bool beyond_border_alone = passage.beyond != 0 && (passage.beyond & ~borders) == 0;
        // Parallel to the sheet: what is seen is its edge, which has no extent.
        if (passage.beyond == 7) return borders != 0;
        if (!(passage.t <= t_far)) return beyond_border_alone;
        const glm::dvec3 voxel = (passage.point - grid.origin()) / grid.voxel_size();
        const glm::ivec3 cell(glm::floor(voxel));
        const Brick* brick = grid.brick_or_null(cell);
        // Nothing is near the place where the ray comes through.
        if (!brick) return (passage.beyond & borders) != 0;
        const CellTriangles there(ray.mesh, *brick, cell - cell / kBrickCells * kBrickCells);
        const TriangleHit met =
            there.first_met(origin, direction, ray.world.t_min, t_far, passage.point, reach);
        if (met) {
            hit = met;
            ray.unmet_since = std::nextafter(met.t, kNever);
            return false;
        }
        const TriangleHit next = there.closest(passage.point);
        if (!next) return (passage.beyond & borders) != 0;
        if (next.index == near.index) {
            return beyond_border_alone || touches_border(next, passage.beyond, borders);
        }
        near = next;
    }
    return false;
}

void SdfTracer::trace_instance(const core::Ray& ray, std::uint32_t instance, Nearest& nearest,
                               Work& work) const {
    const PlacedGrid& placed = placed_[instance];
    LocalRay local{ray,
                   instance,
                   placed,
                   scene_.meshes[scene_.instances[instance].mesh],
                   placed.voxel_from_world_direction * glm::dvec3(ray.origin) + placed.voxel_origin,
                   placed.voxel_from_world_direction * glm::dvec3(ray.direction),
                   ray.t_min};
    double t_min = ray.t_min, t_max = nearest.t;
    if (!clip_to_box(placed.grid->traced_voxels(), local.origin, finite_inverse(local.direction), t_min,
                     t_max)) {
        return;
    }
    RayMarch march(*placed.grid, local.origin, local.direction, t_min, t_max);
    Crossing crossing;
    while (march.next(crossing)) {
        Nearest found;
        if (resolve(local, crossing, found)) {
            // At equal distance the lowest instance wins, whatever the order of the walk.
            if (found.t < nearest.t || !nearest.found() || instance < nearest.instance) nearest = found;
            break;
        }
    }
    work.ray_steps += march.steps();
    work.ray_exhausted = work.ray_exhausted || march.is_exhausted();
}

core::Hit SdfTracer::finish(const core::Ray& ray, const Nearest& nearest) const {
    const PlacedGrid& placed = placed_[nearest.instance];
    const BrickGrid& grid = *placed.grid;
    glm::dvec3 gradient = smooth_gradient(grid, nearest.crossing.cell, nearest.crossing.point);
    if (!(glm::length(gradient) >= 1e-6)) {
        const core::Mesh& mesh = scene_.meshes[scene_.instances[nearest.instance].mesh];
        gradient = triangle_normal(mesh, nearest.triangle);
        if ((glm::dot(gradient, placed.voxel_from_world_direction * glm::dvec3(ray.direction)) < 0.0) !=
            nearest.crossing.enters_negative) {
            gradient = -gradient;
        }
    }
    const glm::dvec3 direction(ray.direction);
    // Inverse transpose: gradients map by the transpose of voxel_from_world.
    glm::dvec3 normal = glm::normalize(glm::transpose(placed.voxel_from_world_direction) * gradient);
    if (!nearest.crossing.enters_negative) normal = -normal;
    const double cosine = glm::dot(normal, direction);
    // The smooth normal may turn away from a ray that only just meets the surface. Its side stays what the
    // crossing says; it is tilted until it faces the ray.
    constexpr double kFacing = 1e-6;
    if (cosine > -kFacing) normal = glm::normalize(normal - (cosine + 2.0 * kFacing) * direction);

    core::Hit hit;
    hit.status = core::HitStatus::kHit;
    hit.t = std::clamp(static_cast<float>(nearest.t), ray.t_min, ray.t_max);
    hit.normal = glm::vec3(normal);
    hit.instance = nearest.instance;
    hit.triangle = nearest.triangle;
    hit.barycentrics = glm::vec2(nearest.barycentrics);
    hit.front = nearest.is_front;
    const glm::dvec3 origin(ray.origin);
    const glm::dvec3 position = origin + nearest.t * direction;
    const double magnitude = std::max({glm::length(position), glm::length(origin), nearest.t});
    double clearance_voxels = kSurfaceClearanceVoxels;
    if (nearest.is_shell) clearance_voxels = grid.half_thickness_voxels() + kShellClearanceVoxels;
    hit.offset =
        static_cast<float>(std::max(clearance_voxels * placed.world_from_voxel_scale, four_ulp(magnitude)));
    return hit;
}

core::Hit SdfTracer::trace_one(const core::Ray& ray, bool any, Work& work) const {
    ++work.rays;
    core::Hit hit;
    if (!core::is_valid_ray(ray)) return hit;
    work.ray_steps = 0;
    work.ray_exhausted = false;
    Nearest nearest;
    nearest.t = ray.t_max;
    tree_.walk(
        glm::dvec3(ray.origin), glm::dvec3(ray.direction), ray.t_min, [&] { return nearest.t; },
        [&](std::uint32_t instance) {
            trace_instance(ray, instance, nearest, work);
            return any && nearest.found();
        });
    work.steps += work.ray_steps;
    work.exhausted += work.ray_exhausted;
    if (nearest.found()) {
        if (any) {
            hit.status = core::HitStatus::kHit;
        } else {
            hit = finish(ray, nearest);
        }
    } else if (work.ray_exhausted) {
        hit.status = core::HitStatus::kExhausted;
    }
    hit.steps = work.ray_steps;
    return hit;
}

void SdfTracer::trace_closest(const core::RayStream& rays, core::HitStream& hits) const {
    hits.resize(rays.size());
    Work work;
    for (std::size_t i = 0; i < rays.size(); ++i) hits.set(i, trace_one(rays.get(i), false, work));
    count(work);
}

void SdfTracer::trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const {
    assert(occluded.size() == rays.size());
    Work work;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        occluded[i] = trace_one(rays.get(i), true, work).hit() ? 1 : 0;
    }
    count(work);
}

float SdfTracer::start_offset(std::uint32_t instance) const {
    return placed_[instance].start_offset;
}

void SdfTracer::count(const Work& work) const {
    ray_count_.fetch_add(work.rays, std::memory_order_relaxed);
    step_count_.fetch_add(work.steps, std::memory_order_relaxed);
    exhausted_count_.fetch_add(work.exhausted, std::memory_order_relaxed);
}

SdfTracer::Statistics SdfTracer::statistics() const {
    return {ray_count_.load(std::memory_order_relaxed), step_count_.load(std::memory_order_relaxed),
            exhausted_count_.load(std::memory_order_relaxed)};
}

std::size_t SdfTracer::bytes() const {
    std::size_t total = placed_.capacity() * sizeof(PlacedGrid) + tree_.bytes();
    std::set<const BrickGrid*> counted;
    for (const auto& grid : grids_) {
        if (grid && counted.insert(grid.get()).second) total += grid->bytes();
    }
    for (const auto& borders : borders_) total += borders.capacity();
    return total;
}

}  // namespace sdf
