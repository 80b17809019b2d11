#include "sdf/sdf_tracer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <set>

#include "core/support/parallel.h"
#include "core/trace/surface.h"
#include "sdf/cell_triangles.h"
#include "sdf/distance.h"
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

/// Four units in the last place of a float of this magnitude.
double four_ulp(double magnitude) {
    return 4.0 * magnitude * static_cast<double>(std::numeric_limits<float>::epsilon());
}

/// All triangles of a mesh that a ray can meet, in local units.
TriangleBvh triangle_tree(const core::Mesh& mesh) {
    std::vector<Triangle> triangles(mesh.triangles.size());
    std::vector<std::uint32_t> usable;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const glm::uvec3& corners = mesh.triangles[i];
        triangles[i] = {glm::dvec3(mesh.positions[corners.x]), glm::dvec3(mesh.positions[corners.y]),
                        glm::dvec3(mesh.positions[corners.z])};
        const double area = glm::length(triangles[i].scaled_normal());
        if (area > 0.0 && std::isfinite(area)) usable.push_back(static_cast<std::uint32_t>(i));
    }
    return TriangleBvh(triangles, usable);
}

/// How far off an exact point of the mesh a ray must start not to meet the field that stands for it.
double surface_offset_voxels(const BrickGrid& grid) {
    if (grid.info().mesh_class == MeshClass::kSheet) return 0.0;
    return std::min(grid.info().error_voxels.max, 1.0) + kSurfaceClearanceVoxels;
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
    double t_max;          ///< The nearest hit of other instances, or the ray's own end.
    double unmet_since;    ///< No visible triangle is met before; at first the ray's start.
    bool is_inside;        ///< Whether the field is negative where the walk has come to.
};

/// The nearest visible crossing so far.
struct SdfTracer::Nearest {
    double t = 0.0;  ///< Until there is one: t_max.
    std::uint32_t instance = core::kNoIndex;
    std::uint32_t triangle = core::kNoIndex;
    glm::dvec2 barycentrics{0.0};
    bool is_front = true;
    bool is_triangle = false;  ///< The ray meets the triangle itself, not the field that stands for it.
    Crossing crossing;         ///< Where not is_triangle.

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
    triangles_.resize(grids_.size(), TriangleBvh({}, {}));
    core::parallel_for(grids_.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (grids_[i] && grids_[i]->half_thickness_voxels() > 0.0) {
                triangles_[i] = triangle_tree(scene.meshes[i]);
            }
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
        placed.triangles = triangles_[instance.mesh].empty() ? nullptr : &triangles_[instance.mesh];
        placed.voxel_from_world_direction = glm::dmat3(instance.local_from_world) / h;
        placed.voxel_origin = (glm::dvec3(instance.local_from_world[3]) - grid->origin()) / h;
        placed.world_from_voxel_scale = largest_singular_value(glm::dmat3(instance.world_from_local)) * h;
        boxes[i] = core::transformed(grid->local_bounds(), instance.world_from_local);
        const double reach = glm::length(glm::max(glm::abs(boxes[i].minimum), glm::abs(boxes[i].maximum)));
        placed.start_offset = static_cast<float>(
            surface_offset_voxels(*grid) * placed.world_from_voxel_scale + four_ulp(reach));
        // The corners are rounded; rays are clipped exactly later, in the grid's own space.
        const glm::dvec3 slack =
            1e-12 * (glm::abs(boxes[i].minimum) + glm::abs(boxes[i].maximum)) + 1e-6 * boxes[i].extent();
        boxes[i].minimum -= slack;
        boxes[i].maximum += slack;
    }
    tree_ = InstanceTree(boxes);
}

bool SdfTracer::meet_triangle(LocalRay& ray, double t_min, double t_max, Nearest& found) const {
    const BrickGrid& grid = *ray.placed.grid;
    const double h = grid.voxel_size();
    const glm::dvec3 origin = grid.origin() + h * ray.origin;
    const glm::dvec3 direction = h * ray.direction;
    t_max = std::min(t_max, ray.t_max);
    while (t_min <= t_max) {
        const FirstHit met = ray.placed.triangles->first_hit(origin, direction, t_min, t_max);
        if (!met) break;
        const glm::uvec3& corner = ray.mesh.triangles[met.triangle];
        const Triangle triangle{glm::dvec3(ray.mesh.positions[corner.x]),
                                glm::dvec3(ray.mesh.positions[corner.y]),
                                glm::dvec3(ray.mesh.positions[corner.z])};
        found.barycentrics = closest_point(triangle, origin + met.t * direction).barycentrics;
        if (!has_alpha_ || core::is_visible(scene_, ray.instance, met.triangle, glm::vec2(found.barycentrics),
                                            ray.world.seed)) {
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

bool SdfTracer::resolve(LocalRay& ray, const Crossing& crossing, Nearest& found) const {
    const BrickGrid& grid = *ray.placed.grid;
    const double h = grid.voxel_size();
    ray.is_inside = crossing.enters_negative;
    // The ray was inside a shell, or inside a solid that a shell runs into.
    if (ray.placed.triangles && !crossing.enters_negative &&
        meet_triangle(ray, ray.unmet_since, crossing.t, found)) {
        return true;
    }
    const glm::ivec3 cell = crossing.cell - crossing.cell / kBrickCells * kBrickCells;
    const CellTriangles triangles(ray.mesh, grid.brick_at(crossing.brick), cell);
    const glm::dvec3 point = grid.origin() + h * (glm::dvec3(crossing.cell) + crossing.point);
    const TriangleHit hit = triangles.closest(point);
    if (!hit) return false;
    const Feature feature = grid.feature(hit.index);
    const double farthest =
        kFarthestTriangleVoxels + (feature == Feature::kSurface ? 0.0 : kHalfThicknessVoxels);
    if (hit.distance > farthest * h) return false;
    if (feature != Feature::kSurface || (ray.placed.triangles && hit.distance > kShellVoxels * h)) {
        if (!crossing.enters_negative) return false;
        // The field of a plain surface next to the shell may lie behind its triangles.
        const double speed = glm::length(ray.direction);
        return meet_triangle(ray, std::max(ray.unmet_since, crossing.t - kFarthestTriangleVoxels / speed),
                             crossing.t + kShellPassageVoxels / speed, found);
    }
    if (has_alpha_ && !core::is_visible(scene_, ray.instance, hit.index, glm::vec2(hit.point.barycentrics),
                                        ray.world.seed)) {
        return false;
    }
    found.t = crossing.t;
    found.instance = ray.instance;
    found.triangle = hit.index;
    found.barycentrics = hit.point.barycentrics;
    // Directions in voxels and in local units differ by h alone, which no sign depends on.
    found.is_front = glm::dot(ray.direction, hit.corners.scaled_normal()) < 0.0;
    found.crossing = crossing;
    return true;
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
                   nearest.t,
                   ray.t_min,
                   false};
    double t_min = ray.t_min, t_max = nearest.t;
    if (!clip_to_box(placed.grid->traced_voxels(), local.origin, finite_inverse(local.direction), t_min,
                     t_max)) {
        return;
    }
    if (placed.triangles) {
        local.is_inside =
            distance_at(*placed.grid, local.origin + t_min * local.direction).value_or(1.0) < 0.0;
    }
    RayMarch march(*placed.grid, local.origin, local.direction, t_min, t_max);
    Crossing crossing;
    Nearest found;
    while (!found.found() && march.next(crossing)) resolve(local, crossing, found);
    // The ray ends within a shell.
    if (placed.triangles && !found.found() && local.is_inside) {
        meet_triangle(local, local.unmet_since, t_max, found);
    }
    // At equal distance the lowest instance wins, whatever the order of the walk.
    if (found.found() && (found.t < nearest.t || !nearest.found() || instance < nearest.instance)) {
        nearest = found;
    }
    work.ray_steps += march.steps();
    work.ray_exhausted = work.ray_exhausted || march.is_exhausted();
}

glm::dvec3 SdfTracer::triangle_side(const core::Ray& ray, const Nearest& nearest) const {
    const core::Instance& instance = scene_.instances[nearest.instance];
    const glm::dvec3 normal = glm::normalize(glm::transpose(glm::dmat3(instance.local_from_world)) *
                                             triangle_normal(scene_.meshes[instance.mesh], nearest.triangle));
    return glm::dot(normal, glm::dvec3(ray.direction)) > 0.0 ? -normal : normal;
}

glm::dvec3 SdfTracer::field_side(const core::Ray& ray, const Nearest& nearest) const {
    const PlacedGrid& placed = placed_[nearest.instance];
    glm::dvec3 gradient = smooth_gradient(*placed.grid, nearest.crossing.cell, nearest.crossing.point);
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
    return normal;
}

core::Hit SdfTracer::finish(const core::Ray& ray, const Nearest& nearest) const {
    const PlacedGrid& placed = placed_[nearest.instance];
    const glm::dvec3 direction(ray.direction);
    const glm::dvec3 normal = nearest.is_triangle ? triangle_side(ray, nearest) : field_side(ray, nearest);

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
    const double clearance_voxels = nearest.is_triangle ? 0.0 : kSurfaceClearanceVoxels;
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
    for (const TriangleBvh& triangles : triangles_) total += triangles.bytes();
    return total;
}

}  // namespace sdf
