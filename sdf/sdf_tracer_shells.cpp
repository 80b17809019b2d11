// sdf/sdf_tracer_shells.cpp: what a crossing of the field stands for, and where a ray goes on if for nothing.
//
// A ray that comes into a shell asks for the triangles within, among all of its mesh, a few voxels far. If it
// meets none, it goes on to its next crossing. Kernels do both, for all such rays of a block at once. Where
// there are shells alone, the triangles answer from the first of them to the end: as measured, that takes
// less time than to ask a few voxels far and to go on, where sheets lie one behind the other, too.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/trace/surface.h"
#include "sdf/distance.h"
#include "sdf/sdf_tracer.h"
#include "sdf/sdf_tracer_work.h"

namespace sdf {

namespace {

/// Next to a thickened surface the shell covers plain ones as well. A crossing farther than this from its
/// triangle lies on a shell: plain surfaces are nearer than 0.2 voxels.
constexpr double kShellVoxels = 0.1;

/// How far beyond the place where a ray comes into a shell its triangles are looked for at once. Whatever
/// lies farther is looked for where the ray leaves the shell.
constexpr double kShellPassageVoxels = 8.0;

/// How far beyond the place where a ray comes out its triangles are looked for: where no shell is, the field
/// of a solid may end before its triangles do.
constexpr double kExitVoxels = 0.5;

constexpr double kNever = std::numeric_limits<double>::infinity();

/// So far behind a crossing that is none, a ray goes on: farther than positions in single precision round. It
/// doubles every so many rounds: along a face of the lattice the same surface may be crossed again and again.
double past_crossing_voxels(int round) {
    constexpr int kDoubling = 16, kMost = 7;
    return std::ldexp(0.01, std::min(round / kDoubling, kMost));
}

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

void SdfTracer::take_sheet(LocalRay& ray, const Crossing& crossing, Work& work) const {
    const Passage& passage = work.traced[ray.slot].passage;
    // Into a shell: before it there is nothing. Out of one: the ray began within.
    const double t_min =
        crossing.enters_negative
            ? std::max(ray.unmet_since, crossing.t - kFarthestTriangleVoxels * passage.t_per_voxel)
            : ray.unmet_since;
    ask(ray, t_min, passage.t_max, {}, IfUnmet::kEnd, work);
}

void SdfTracer::take_crossing(LocalRay& ray, const Crossing& crossing, const Surface& here,
                              Work& work) const {
    ray.come_to = crossing.t;
    // A ray that comes in though it was inside has left through a lid far from all samples, unseen.
    const bool was_inside = ray.is_inside || !crossing.enters_negative;
    ray.is_inside = crossing.enters_negative;
    const Stands stands = stands_for(ray.placed, here);
    const IfUnmet if_unmet = stands == Stands::kSurface ? IfUnmet::kTakeSurface : IfUnmet::kGoOn;
    const double voxel = work.traced[ray.slot].passage.t_per_voxel;
    const double ahead = !crossing.enters_negative  ? kExitVoxels
                         : stands == Stands::kShell ? kShellPassageVoxels
                                                    : 0.0;
    if (ray.placed.triangles && was_inside) {
        // The ray was inside a shell, or inside a solid that a shell runs into.
        ask(ray, ray.unmet_since, crossing.t + ahead * voxel, here, if_unmet, work);
    } else if (stands == Stands::kShell) {
        // The field of a plain surface next to the shell may lie behind its triangles.
        ask(ray, std::max(ray.unmet_since, crossing.t - kFarthestTriangleVoxels * voxel),
            crossing.t + ahead * voxel, here, IfUnmet::kGoOn, work);
    } else {
        settle(ray, here, if_unmet, work);
    }
}

SdfTracer::Stands SdfTracer::stands_for(const PlacedGrid& placed, const Surface& here) {
    if (here.triangle == kNoTriangle) return Stands::kNothing;
    const bool is_thickened = placed.grid->feature(here.triangle) != Feature::kSurface;
    if (here.distance > kFarthestTriangleVoxels + (is_thickened ? kHalfThicknessVoxels : 0.0)) {
        return Stands::kNothing;
    }
    return is_thickened || (placed.triangles && here.distance > kShellVoxels) ? Stands::kShell
                                                                              : Stands::kSurface;
}

void SdfTracer::ask(LocalRay& ray, double t_min, double t_max, const Surface& here, IfUnmet if_unmet,
                    Work& work) const {
    t_max = std::min(t_max, ray.t_max);
    if (!(t_min <= t_max)) {
        settle(ray, here, if_unmet, work);
        return;
    }
    const BrickGrid& grid = *ray.placed.grid;
    const double h = grid.voxel_size();
    work.asked.push_back({ray, here, if_unmet});
    work.queries.push_back({ray.placed.triangles,
                            {grid.origin() + h * ray.origin, h * ray.direction, t_min, t_max},
                            ray.any ? FirstOrAny::kAny : FirstOrAny::kFirst,
                            {}});
}

void SdfTracer::answer(Work& work) const {
    while (!work.queries.empty()) {
        hit_triangles(work.queries);
        work.asked.swap(work.answered);
        work.queries.swap(work.answers);
        work.asked.clear();
        work.queries.clear();
        for (std::size_t i = 0; i < work.answered.size(); ++i) {
            Asked& asked = work.answered[i];
            const TriangleQuery& query = work.answers[i];
            if (!query.hit) {
                asked.ray.unmet_since = std::max(asked.ray.unmet_since, query.ray.t_max);
                settle(asked.ray, asked.here, asked.if_unmet, work);
            } else if (!take_triangle(asked.ray, query, work)) {
                ask(asked.ray, std::nextafter(query.hit.t, kNever), query.ray.t_max, asked.here,
                    asked.if_unmet, work);
            }
        }
    }
}

bool SdfTracer::take_triangle(const LocalRay& ray, const TriangleQuery& query, Work& work) const {
    NearestHit found;
    found.t = query.hit.t;
    found.instance = ray.instance;
    found.triangle = query.hit.triangle;
    found.is_triangle = true;
    if (!ray.any) {
        const glm::uvec3& corner = ray.mesh.triangles[found.triangle];
        const Triangle triangle{glm::dvec3(ray.mesh.positions[corner.x]),
                                glm::dvec3(ray.mesh.positions[corner.y]),
                                glm::dvec3(ray.mesh.positions[corner.z])};
        const glm::dvec3 position = query.ray.origin + found.t * query.ray.direction;
        found.barycentrics = glm::vec2(closest_point(triangle, position).barycentrics);
        if (has_alpha_ &&
            !core::is_visible(scene_, ray.instance, found.triangle, found.barycentrics, ray.world.seed)) {
            return false;
        }
        found.is_front = glm::dot(query.ray.direction, triangle.scaled_normal()) < 0.0;
    }
    keep_nearer(found, work.traced[ray.slot]);
    return true;
}

void SdfTracer::settle(LocalRay& ray, const Surface& here, IfUnmet if_unmet, Work& work) const {
    Traced& traced = work.traced[ray.slot];
    if (if_unmet == IfUnmet::kEnd) return;
    if (if_unmet == IfUnmet::kTakeSurface &&
        (!has_alpha_ ||
         core::is_visible(scene_, ray.instance, here.triangle, here.barycentrics, ray.world.seed))) {
        keep_nearer(here.hit(ray.come_to, ray.instance, ray.is_inside), traced);
        return;
    }
    // Up to `unmet_since` the triangles themselves have answered.
    ray.come_to = std::max(ray.come_to + past_crossing_voxels(work.round) * traced.passage.t_per_voxel,
                           ray.unmet_since);
    if (ray.come_to < traced.passage.t_max) {
        work.going_on.push_back(ray);
    } else {
        ask_at_end(ray, work);
    }
}

void SdfTracer::ask_at_end(LocalRay& ray, Work& work) const {
    // No crossing parts this place from the end, so that one sign should hold; but a lid far from all samples
    // is passed unseen. Where the triangles had answered, the ray may have left the shell.
    const Traced& traced = work.traced[ray.slot];
    if (!ray.placed.triangles) return;
    if (may_be_inside(ray, ray.come_to) ||
        (traced.may_end_inside() && may_be_inside(ray, traced.passage.t_max))) {
        ask(ray, ray.unmet_since, traced.passage.t_max, {}, IfUnmet::kEnd, work);
    }
}

bool SdfTracer::may_be_inside(const LocalRay& ray, double t) {
    // Far from all surfaces nothing says so; but no sheet has an inside there.
    const std::optional<double> value = distance_at(*ray.placed.grid, ray.origin + t * ray.direction);
    return value ? *value < 0.0 : !ray.placed.is_sheet;
}

void SdfTracer::go_on(Work& work) const {
    for (work.round = 0;; ++work.round) {
        answer(work);
        if (work.going_on.empty()) return;
        work.walking.swap(work.going_on);
        work.going_on.clear();
        const std::size_t count = work.walking.size();
        for (std::size_t i = 0; i < count; ++i) {
            const LocalRay& ray = work.walking[i];
            work.march_rays[i] = march_ray(ray, work.traced[ray.slot].passage);
        }
        march_rays(atlas_.table(), HitMode::kCubic, std::span(work.march_rays).first(count),
                   std::span(work.march_hits).first(count));
        work.met.clear();
        for (std::size_t i = 0; i < count; ++i) {
            LocalRay& ray = work.walking[i];
            Traced& traced = work.traced[ray.slot];
            const MarchHit& march_hit = work.march_hits[i];
            traced.steps += march_hit.steps;
            traced.is_exhausted = traced.is_exhausted || march_hit.status == MarchStatus::kExhausted;
            const Crossing crossing = crossing_of(march_hit, ray.come_to, traced.passage);
            if (march_hit.status != MarchStatus::kHit || !(crossing.t <= traced.passage.t_max)) {
                ask_at_end(ray, work);
            } else {
                work.met.push_back(static_cast<std::uint32_t>(i));
            }
        }
        find_surfaces(work);
        for (std::size_t i = 0; i < work.met.size(); ++i) {
            LocalRay& ray = work.walking[work.met[i]];
            const Passage& passage = work.traced[ray.slot].passage;
            take_crossing(ray, crossing_of(work.march_hits[work.met[i]], ray.come_to, passage),
                          surface_found(work, i, ray.placed.place.triangle_base), work);
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

}  // namespace sdf
