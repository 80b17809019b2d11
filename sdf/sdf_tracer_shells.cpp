// sdf/sdf_tracer_shells.cpp: what a crossing of the field stands for, and where a ray goes on if for nothing.
//
// A ray that comes into a shell looks for the triangles within, among all of its mesh, a few voxels far. If
// it meets none, it goes on to its next crossing with the kernels, together with the others of its block.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/trace/surface.h"
#include "sdf/cell_triangles.h"
#include "sdf/distance.h"
#include "sdf/sdf_tracer.h"
#include "sdf/sdf_tracer_work.h"
#include "sdf/sphere_trace.h"

namespace sdf {

namespace {

/// Next to a thickened surface the shell covers plain ones as well. A crossing farther than this from its
/// triangle lies on a shell: plain surfaces are nearer than 0.2 voxels.
constexpr double kShellVoxels = 0.25;

/// How far beyond the place where a ray comes into a shell its triangles are looked for at once. Whatever
/// lies farther is looked for where the ray leaves the shell.
constexpr double kShellPassageVoxels = 8.0;

/// So far behind a crossing that is none, a ray goes on: farther than positions in single precision round.
constexpr double kPastCrossingVoxels = 0.01;

/// Crossings that are none, after which the rest is left to the scalar walk: along a face of the lattice the
/// same surface may be crossed again and again.
constexpr int kMostRounds = 64;

constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

SdfTracer::LocalRay SdfTracer::local_ray(const core::Ray& ray, std::uint32_t slot, const Traced& traced,
                                         bool any) const {
    const PlacedGrid& placed = placed_[traced.passage.instance];
    return {ray,
            slot,
            traced.passage.instance,
            placed,
            scene_.meshes[scene_.instances[traced.passage.instance].mesh],
            placed.voxel_from_world_direction * glm::dvec3(ray.origin) + placed.voxel_origin,
            placed.voxel_from_world_direction * glm::dvec3(ray.direction),
            traced.nearest.t,
            ray.t_min,
            traced.passage.t_min,
            false,
            any && !has_alpha_};
}

bool SdfTracer::meet_triangle(LocalRay& ray, double t_min, double t_max, NearestHit& found) const {
    const BrickGrid& grid = *ray.placed.grid;
    const double h = grid.voxel_size();
    const glm::dvec3 origin = grid.origin() + h * ray.origin;
    const glm::dvec3 direction = h * ray.direction;
    t_max = std::min(t_max, ray.t_max);
    while (t_min <= t_max) {
        const FirstHit met = ray.placed.triangles->hit({origin, direction, t_min, t_max},
                                                       ray.any ? FirstOrAny::kAny : FirstOrAny::kFirst);
        if (!met) break;
        found.t = met.t;
        found.triangle = met.triangle;
        found.is_triangle = true;
        if (ray.any) {
            found.instance = ray.instance;
            return true;
        }
        const glm::uvec3& corner = ray.mesh.triangles[met.triangle];
        const Triangle triangle{glm::dvec3(ray.mesh.positions[corner.x]),
                                glm::dvec3(ray.mesh.positions[corner.y]),
                                glm::dvec3(ray.mesh.positions[corner.z])};
        found.barycentrics = glm::vec2(closest_point(triangle, origin + met.t * direction).barycentrics);
        if (!has_alpha_ ||
            core::is_visible(scene_, ray.instance, met.triangle, found.barycentrics, ray.world.seed)) {
            found.instance = ray.instance;
            found.is_front = glm::dot(direction, triangle.scaled_normal()) < 0.0;
            return true;
        }
        t_min = std::nextafter(met.t, kNever);
    }
    ray.unmet_since = std::max(ray.unmet_since, t_max);
    return false;
}

bool SdfTracer::accept(LocalRay& ray, const Crossing& crossing, const Surface& here,
                       NearestHit& found) const {
    ray.come_to = crossing.t;
    ray.is_inside = crossing.enters_negative;
    // The ray was inside a shell, or inside a solid that a shell runs into.
    if (ray.placed.triangles && !crossing.enters_negative &&
        meet_triangle(ray, ray.unmet_since, crossing.t, found)) {
        return true;
    }
    if (!ray.placed.is_sheet && here.triangle == kNoTriangle) return false;
    const Feature feature = ray.placed.is_sheet ? Feature::kSheet : ray.placed.grid->feature(here.triangle);
    const double farthest =
        kFarthestTriangleVoxels + (feature == Feature::kSurface ? 0.0 : kHalfThicknessVoxels);
    if (!ray.placed.is_sheet && here.distance > farthest) return false;
    if (feature != Feature::kSurface || (ray.placed.triangles && here.distance > kShellVoxels)) {
        if (!crossing.enters_negative) return false;
        // The field of a plain surface next to the shell may lie behind its triangles.
        const double speed = glm::length(ray.direction);
        return meet_triangle(ray, std::max(ray.unmet_since, crossing.t - kFarthestTriangleVoxels / speed),
                             crossing.t + kShellPassageVoxels / speed, found);
    }
    if (has_alpha_ &&
        !core::is_visible(scene_, ray.instance, here.triangle, here.barycentrics, ray.world.seed)) {
        return false;
    }
    found.t = crossing.t;
    found.instance = ray.instance;
    found.triangle = here.triangle;
    found.barycentrics = here.barycentrics;
    found.is_front = here.is_front;
    found.gradient = here.gradient;
    found.enters_negative = crossing.enters_negative;
    found.is_triangle = false;
    return true;
}

void SdfTracer::take_or_go_on(LocalRay& local, const Crossing& crossing, const Surface& here,
                              Work& work) const {
    Traced& traced = work.traced[local.slot];
    NearestHit found;
    if (accept(local, crossing, here, found)) {
        keep_nearer(found, traced);
        return;
    }
    // Up to `unmet_since` the triangles themselves have answered.
    local.come_to =
        std::max(crossing.t + kPastCrossingVoxels * traced.passage.t_per_voxel, local.unmet_since);
    if (local.come_to < traced.passage.t_max) {
        work.going_on.push_back(local);
    } else {
        meet_shell_at_end(local, traced);
    }
}

void SdfTracer::finish_without_crossing(LocalRay local, Traced& traced) const {
    const glm::dvec3 start = local.origin + traced.passage.t_min * local.direction;
    local.is_inside = distance_at(*local.placed.grid, start).value_or(1.0) < 0.0;
    meet_shell_at_end(local, traced);
}

void SdfTracer::meet_shell_at_end(LocalRay& local, Traced& traced) const {
    if (!local.placed.triangles || !local.is_inside) return;
    NearestHit found;
    meet_triangle(local, local.unmet_since, traced.passage.t_max, found);
    keep_nearer(found, traced);
}

void SdfTracer::go_on(Work& work) const {
    for (int round = 0; !work.going_on.empty(); ++round) {
        work.walking.swap(work.going_on);
        work.going_on.clear();
        const std::size_t count = work.walking.size();
        if (round == kMostRounds) {
            for (LocalRay& local : work.walking) walk_crossings(local, work.traced[local.slot]);
            return;
        }
        for (std::size_t i = 0; i < count; ++i) {
            const LocalRay& local = work.walking[i];
            work.march_rays[i] = march_ray(local, work.traced[local.slot].passage);
        }
        march_rays(atlas_.table(), HitMode::kCubic, std::span(work.march_rays).first(count),
                   std::span(work.march_hits).first(count));
        work.met.clear();
        for (std::size_t i = 0; i < count; ++i) {
            LocalRay& local = work.walking[i];
            Traced& traced = work.traced[local.slot];
            const MarchHit& march_hit = work.march_hits[i];
            traced.steps += march_hit.steps;
            traced.is_exhausted = traced.is_exhausted || march_hit.status == MarchStatus::kExhausted;
            const Crossing crossing = crossing_of(march_hit, local.come_to, traced.passage);
            if (march_hit.status != MarchStatus::kHit || !(crossing.t <= traced.passage.t_max)) {
                // Whether it is still inside, where the triangles had answered.
                local.is_inside =
                    local.is_inside &&
                    distance_at(*local.placed.grid, local.origin + local.come_to * local.direction)
                            .value_or(-1.0) < 0.0;
                meet_shell_at_end(local, traced);
            } else if (local.placed.is_sheet) {
                take_or_go_on(local, crossing, {}, work);
            } else {
                work.met.push_back(static_cast<std::uint32_t>(i));
            }
        }
        find_surfaces(work);
        for (std::size_t i = 0; i < work.met.size(); ++i) {
            LocalRay& local = work.walking[work.met[i]];
            take_or_go_on(
                local,
                crossing_of(work.march_hits[work.met[i]], local.come_to, work.traced[local.slot].passage),
                surface_found(work, i, local.placed.place.triangle_base), work);
        }
    }
}

Crossing SdfTracer::crossing_of(const MarchHit& march_hit, double from, const Passage& passage) {
    Crossing crossing;
    crossing.t = from + march_hit.distance * passage.t_per_voxel;
    crossing.enters_negative = march_hit.enters_negative;
    return crossing;
}

MarchRay SdfTracer::march_ray(const LocalRay& local, const Passage& passage) const {
    // As enter_fields() does it.
    constexpr double kParallel = 1e-20, kBeyondEnd = 1e-3;
    const FieldPlacement& placement = placements_[local.instance];
    MarchRay to;
    for (int axis = 0; axis < 3; ++axis) {
        const double at = local.origin[axis] + local.come_to * local.direction[axis];
        const double unit = local.direction[axis] * passage.t_per_voxel;
        to.origin[axis] = static_cast<float>(std::clamp(at, 0.0, placement.box[axis]));
        to.direction[axis] = std::abs(unit) < kParallel ? 0.0f : static_cast<float>(unit);
        to.cell_count[axis] = static_cast<float>(placement.box[axis]);
    }
    to.length = static_cast<float>((passage.t_max - local.come_to) / passage.t_per_voxel + kBeyondEnd);
    to.top_base = placement.top_base;
    to.top_octant = placement.top_octant;
    to.top_stride_x = placement.top_stride_x;
    to.top_stride_y = placement.top_stride_y;
    return to;
}

SdfTracer::Surface SdfTracer::surface_at(const LocalRay& ray, const Crossing& crossing) const {
    const BrickGrid& grid = *ray.placed.grid;
    const glm::ivec3 cell = crossing.cell - crossing.cell / kBrickCells * kBrickCells;
    const CellTriangles triangles(ray.mesh, grid, grid.brick_at(crossing.brick), cell);
    const glm::dvec3 voxel = glm::dvec3(crossing.cell) + crossing.point;
    const TriangleHit hit = triangles.closest(grid.origin() + grid.voxel_size() * voxel);
    Surface here;
    if (!hit) return here;
    here.triangle = hit.index;
    here.distance = hit.distance / grid.voxel_size();
    here.barycentrics = glm::vec2(hit.point.barycentrics);
    here.is_front = glm::dot(ray.direction, hit.corners.scaled_normal()) < 0.0;
    here.gradient = glm::vec3(smooth_gradient(grid, crossing.cell, crossing.point));
    return here;
}

void SdfTracer::walk_crossings(LocalRay& local, Traced& traced) const {
    const Passage& passage = traced.passage;
    RayMarch march(*local.placed.grid, local.origin, local.direction, local.come_to, passage.t_max);
    NearestHit found;
    Crossing crossing;
    while (!found.found() && march.next(crossing)) {
        accept(local, crossing, surface_at(local, crossing), found);
    }
    traced.steps += march.steps();
    traced.is_exhausted = traced.is_exhausted || march.is_exhausted();
    if (found.found()) {
        keep_nearer(found, traced);
    } else {
        meet_shell_at_end(local, traced);
    }
}

}  // namespace sdf
