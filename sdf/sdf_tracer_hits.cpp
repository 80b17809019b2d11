// sdf/sdf_tracer_hits.cpp: from crossings of the field to hits of the scene.
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

/// A crossing farther than this from every stored triangle is the lid with which the winding number closes a
/// hole of the mesh, and no surface. Where the sign changes at the mesh, the surface passes through the cell,
/// whose diagonal is 1.74.
constexpr double kFarthestTriangleVoxels = 2.0;

/// Next to a thickened surface the shell covers plain ones as well. A crossing farther than this from its
/// triangle lies on a shell: plain surfaces are nearer than 0.2 voxels.
constexpr double kShellVoxels = 0.25;

/// How far beyond the place where a ray comes into a shell its triangles are looked for at once. Whatever
/// lies farther is looked for where the ray leaves the shell.
constexpr double kShellPassageVoxels = 8.0;

constexpr double kNever = std::numeric_limits<double>::infinity();

glm::dvec3 triangle_normal(const core::Mesh& mesh, std::uint32_t index) {
    const glm::uvec3& corners = mesh.triangles[index];
    const glm::dvec3 a(mesh.positions[corners.x]);
    return glm::normalize(
        glm::cross(glm::dvec3(mesh.positions[corners.y]) - a, glm::dvec3(mesh.positions[corners.z]) - a));
}

}  // namespace

bool SdfTracer::meet_triangle(LocalRay& ray, double t_min, double t_max, Nearest& found) const {
    const BrickGrid& grid = *ray.placed.grid;
    const double h = grid.voxel_size();
    const glm::dvec3 origin = grid.origin() + h * ray.origin;
    const glm::dvec3 direction = h * ray.direction;
    t_max = std::min(t_max, ray.t_max);
    while (t_min <= t_max) {
        const FirstHit met = ray.placed.triangles->hit({origin, direction, t_min, t_max});
        if (!met) break;
        const glm::uvec3& corner = ray.mesh.triangles[met.triangle];
        const Triangle triangle{glm::dvec3(ray.mesh.positions[corner.x]),
                                glm::dvec3(ray.mesh.positions[corner.y]),
                                glm::dvec3(ray.mesh.positions[corner.z])};
        found.barycentrics = glm::vec2(closest_point(triangle, origin + met.t * direction).barycentrics);
        if (!has_alpha_ ||
            core::is_visible(scene_, ray.instance, met.triangle, found.barycentrics, ray.world.seed)) {
            found.t = met.t;
            found.instance = ray.instance;
            found.triangle = met.triangle;
            found.is_front = glm::dot(direction, triangle.scaled_normal()) < 0.0;
            found.is_triangle = true;
            return true;
        }
        t_min = std::nextafter(met.t, kNever);
    }
    ray.unmet_since = std::max(ray.unmet_since, t_max);
    return false;
}

bool SdfTracer::accept(LocalRay& ray, const Crossing& crossing, const Surface& here, Nearest& found) const {
    ray.is_inside = crossing.enters_negative;
    // The ray was inside a shell, or inside a solid that a shell runs into.
    if (ray.placed.triangles && !crossing.enters_negative &&
        meet_triangle(ray, ray.unmet_since, crossing.t, found)) {
        return true;
    }
    if (here.triangle == kNoTriangle) return false;
    const Feature feature = ray.placed.grid->feature(here.triangle);
    const double farthest =
        kFarthestTriangleVoxels + (feature == Feature::kSurface ? 0.0 : kHalfThicknessVoxels);
    if (here.distance > farthest) return false;
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
    found.is_front = glm::dot(glm::vec3(ray.direction), here.scaled_normal) < 0.0f;
    found.gradient = here.gradient;
    found.enters_negative = crossing.enters_negative;
    found.is_triangle = false;
    return true;
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
    here.scaled_normal = glm::vec3(hit.corners.scaled_normal() / (grid.voxel_size() * grid.voxel_size()));
    here.gradient = glm::vec3(smooth_gradient(grid, crossing.cell, crossing.point));
    return here;
}

SdfTracer::Surface SdfTracer::surface_found(const Work& work, std::size_t at,
                                            std::int32_t triangle_base) const {
    const SurfacePoints& surface = work.surface;
    Surface here;
    if (surface.triangle[at] < 0) return here;
    here.triangle = static_cast<std::uint32_t>(surface.triangle[at] - triangle_base);
    here.distance = std::sqrt(surface.distance_squared[at]);
    here.barycentrics = {surface.u[at], surface.v[at]};
    here.scaled_normal = atlas_.triangle(surface.triangle[at]).scaled_normal();
    here.gradient = {surface.gradient_x[at], surface.gradient_y[at], surface.gradient_z[at]};
    return here;
}

SdfTracer::LocalRay SdfTracer::local_ray(const core::Ray& ray, const Traced& traced) const {
    const PlacedGrid& placed = placed_[traced.passage.instance];
    LocalRay local{ray,
                   traced.passage.instance,
                   placed,
                   scene_.meshes[scene_.instances[traced.passage.instance].mesh],
                   placed.voxel_from_world_direction * glm::dvec3(ray.origin) + placed.voxel_origin,
                   placed.voxel_from_world_direction * glm::dvec3(ray.direction),
                   traced.nearest.t,
                   ray.t_min,
                   false};
    if (placed.triangles) {
        const glm::dvec3 start = local.origin + traced.passage.t_min * local.direction;
        local.is_inside = distance_at(*placed.grid, start).value_or(1.0) < 0.0;
    }
    return local;
}

void SdfTracer::keep_nearer(const Nearest& found, Traced& traced) const {
    // At equal distance the lowest instance wins, whatever the order of the walk.
    Nearest& nearest = traced.nearest;
    if (found.found() && (found.t < nearest.t || !nearest.found() || found.instance < nearest.instance)) {
        nearest = found;
    }
}

void SdfTracer::finish_crossing(const Work& work, std::size_t at, Traced& traced) const {
    const std::uint32_t entry = work.met[at];
    const MarchHit& march_hit = work.march_hits[entry];
    const Passage& passage = traced.passage;
    const PlacedGrid& placed = placed_[passage.instance];
    const Surface here = surface_found(work, at, placed.place.triangle_base);
    Crossing crossing;
    crossing.t = passage.t_at(march_hit);
    crossing.enters_negative = march_hit.enters_negative;
    Nearest found;
    if (placed.is_opaque && here.triangle != kNoTriangle && here.distance <= kFarthestTriangleVoxels) {
        // What accept() would say, without a ray in double.
        const float* direction = work.march_rays[entry].direction;
        found.t = crossing.t;
        found.instance = passage.instance;
        found.triangle = here.triangle;
        found.barycentrics = here.barycentrics;
        found.is_front =
            glm::dot(glm::vec3(direction[0], direction[1], direction[2]), here.scaled_normal) < 0.0f;
        found.gradient = here.gradient;
        found.enters_negative = crossing.enters_negative;
    } else {
        const core::Ray ray = work.ray(work.active[entry]);
        LocalRay local = local_ray(ray, traced);
        // What lies behind a crossing that is no visible surface is walked to one by one.
        if (!accept(local, crossing, here, found)) walk_crossings(local, traced, found);
        meet_shell_at_end(local, passage.t_max, found);
    }
    keep_nearer(found, traced);
}

void SdfTracer::finish_without_crossing(const core::Ray& ray, Traced& traced) const {
    LocalRay local = local_ray(ray, traced);
    Nearest found;
    meet_shell_at_end(local, traced.passage.t_max, found);
    keep_nearer(found, traced);
}

void SdfTracer::meet_shell_at_end(LocalRay& local, double t_max, Nearest& found) const {
    if (local.placed.triangles && !found.found() && local.is_inside) {
        meet_triangle(local, local.unmet_since, t_max, found);
    }
}

void SdfTracer::walk_crossings(LocalRay& local, Traced& traced, Nearest& found) const {
    const Passage& passage = traced.passage;
    RayMarch march(*local.placed.grid, local.origin, local.direction, passage.t_min, passage.t_max);
    Crossing crossing;
    while (!found.found() && march.next(crossing))
        accept(local, crossing, surface_at(local, crossing), found);
    traced.steps += march.steps();
    traced.is_exhausted = traced.is_exhausted || march.is_exhausted();
}

glm::vec3 SdfTracer::triangle_side(const core::Ray& ray, const Nearest& nearest) const {
    const core::Instance& instance = scene_.instances[nearest.instance];
    const glm::dvec3 normal = glm::normalize(glm::transpose(glm::dmat3(instance.local_from_world)) *
                                             triangle_normal(scene_.meshes[instance.mesh], nearest.triangle));
    return glm::vec3(glm::dot(normal, glm::dvec3(ray.direction)) > 0.0 ? -normal : normal);
}

glm::vec3 SdfTracer::field_side(const core::Ray& ray, const Nearest& nearest) const {
    const PlacedGrid& placed = placed_[nearest.instance];
    glm::vec3 gradient = nearest.gradient;
    if (!(glm::dot(gradient, gradient) >= 1e-12f)) {
        const core::Mesh& mesh = scene_.meshes[scene_.instances[nearest.instance].mesh];
        const glm::dvec3 normal = triangle_normal(mesh, nearest.triangle);
        const bool enters =
            glm::dot(normal, placed.voxel_from_world_direction * glm::dvec3(ray.direction)) < 0.0;
        gradient = glm::vec3(enters == nearest.enters_negative ? normal : -normal);
    }
    // Inverse transpose: gradients map by the transpose of voxel_from_world.
    glm::vec3 normal = glm::normalize(placed.world_from_voxel_gradient * gradient);
    if (!nearest.enters_negative) normal = -normal;
    const float cosine = glm::dot(normal, ray.direction);
    // The smooth normal may turn away from a ray that only just meets the surface. Its side stays what the
    // crossing says; it is tilted until it faces the ray.
    constexpr float kFacing = 1e-6f;
    if (cosine > -kFacing) normal = glm::normalize(normal - (cosine + 2.0f * kFacing) * ray.direction);
    return normal;
}

core::Hit SdfTracer::finish(const core::Ray& ray, const Traced& traced) const {
    core::Hit hit;
    const Nearest& nearest = traced.nearest;
    hit.status = core::HitStatus::kHit;
    hit.t = std::clamp(static_cast<float>(nearest.t), ray.t_min, ray.t_max);
    hit.normal = nearest.is_triangle ? triangle_side(ray, nearest) : field_side(ray, nearest);
    hit.instance = nearest.instance;
    hit.triangle = nearest.triangle;
    hit.barycentrics = nearest.barycentrics;
    hit.front = nearest.is_front;
    const glm::vec3 position = ray.origin + hit.t * ray.direction;
    const float magnitude = std::max({glm::length(position), glm::length(ray.origin), hit.t});
    const double clearance_voxels = nearest.is_triangle ? 0.0 : kSurfaceClearanceVoxels;
    hit.offset = static_cast<float>(
        std::max(clearance_voxels * placed_[nearest.instance].world_from_voxel_scale, four_ulp(magnitude)));
    return hit;
}

}  // namespace sdf
