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

/// Rays that are traced together: enough to keep the lanes of a kernel busy, few enough for the cache.
constexpr std::size_t kBlockRays = 512;

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

/// A ray's way through the box of one instance's field.
struct SdfTracer::Passage {
    std::uint32_t instance = core::kNoIndex;
    glm::dvec3 origin{0.0};     ///< Voxel coordinates.
    glm::dvec3 direction{0.0};  ///< Voxels a world unit.
    double speed = 1.0;         ///< Its length.
    double t_min = 0.0, t_max = 0.0;
};

/// A ray on its way through the scene.
struct SdfTracer::Traced {
    core::Ray ray;
    std::size_t number = 0;  ///< In its stream.
    InstanceTree::Walk walk;
    Nearest nearest;
    Passage passage;
    std::uint32_t steps = 0;
    bool is_exhausted = false;
};

struct SdfTracer::Work {
    std::uint64_t rays = 0;
    std::uint64_t steps = 0;
    std::uint64_t exhausted = 0;
    std::vector<Traced> traced;
    std::vector<MarchRay> rays_to_march;
    std::vector<MarchHit> march_hits;
};

SdfTracer::SdfTracer(const core::Scene& scene, std::vector<std::shared_ptr<const BrickGrid>> grids,
                     HitMode hit_mode)
    : scene_(scene),
      grids_(std::move(grids)),
      atlas_(grids_),
      hit_mode_(hit_mode),
      has_alpha_(core::has_alpha(scene)) {
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
        placed.place = atlas_.place(instance.mesh);
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
    const CellTriangles triangles(ray.mesh, grid, grid.brick_at(crossing.brick), cell);
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

bool SdfTracer::enter_next_instance(Traced& traced) const {
    Passage& passage = traced.passage;
    while (traced.walk.next(traced.nearest.t, passage.instance)) {
        const PlacedGrid& placed = placed_[passage.instance];
        passage.origin =
            placed.voxel_from_world_direction * glm::dvec3(traced.ray.origin) + placed.voxel_origin;
        passage.direction = placed.voxel_from_world_direction * glm::dvec3(traced.ray.direction);
        passage.t_min = traced.ray.t_min;
        passage.t_max = traced.nearest.t;
        if (clip_to_box(placed.grid->traced_voxels(), passage.origin, finite_inverse(passage.direction),
                        passage.t_min, passage.t_max)) {
            passage.speed = glm::length(passage.direction);
            return true;
        }
    }
    return false;
}

MarchRay SdfTracer::march_ray(const Passage& passage) const {
    // A hit close to the end is the kernel's to find and finish_passage()'s to judge, in double.
    constexpr double kBeyond = 1e-3;
    constexpr double kParallel = 1e-20;
    const FieldAtlas::Place& place = placed_[passage.instance].place;
    // From here on single precision suffices: it is that of the field's own box.
    const glm::dvec3 start = passage.origin + passage.t_min * passage.direction;
    const double inverse_speed = 1.0 / passage.speed;
    MarchRay ray;
    for (int axis = 0; axis < 3; ++axis) {
        const double direction = passage.direction[axis] * inverse_speed;
        ray.origin[axis] = glm::clamp(static_cast<float>(start[axis]), 0.0f, place.cell_count[axis]);
        ray.direction[axis] = std::abs(direction) < kParallel ? 0.0f : static_cast<float>(direction);
        ray.cell_count[axis] = place.cell_count[axis];
    }
    ray.length = static_cast<float>((passage.t_max - passage.t_min) * passage.speed + kBeyond);
    ray.top_base = place.top_base;
    ray.top_stride_x = place.stride_x;
    ray.top_stride_y = place.stride_y;
    return ray;
}

void SdfTracer::finish_passage(const MarchHit& march_hit, Traced& traced) const {
    const Passage& passage = traced.passage;
    const PlacedGrid& placed = placed_[passage.instance];
    traced.steps += march_hit.steps;
    const bool is_hit = march_hit.status == MarchStatus::kHit;
    if (!is_hit && !placed.triangles) {
        traced.is_exhausted = traced.is_exhausted || march_hit.status == MarchStatus::kExhausted;
        return;
    }
    LocalRay local{traced.ray,
                   passage.instance,
                   placed,
                   scene_.meshes[scene_.instances[passage.instance].mesh],
                   passage.origin,
                   passage.direction,
                   traced.nearest.t,
                   traced.ray.t_min,
                   false};
    if (placed.triangles) {
        local.is_inside =
            distance_at(*placed.grid, passage.origin + passage.t_min * passage.direction).value_or(1.0) < 0.0;
    }
    Nearest found;
    Crossing crossing;
    if (is_hit) {
        crossing.t = passage.t_min + march_hit.distance / passage.speed;
        if (crossing.t <= passage.t_max) {
            crossing.cell = {march_hit.cell[0], march_hit.cell[1], march_hit.cell[2]};
            crossing.point = glm::clamp(
                passage.origin + crossing.t * passage.direction - glm::dvec3(crossing.cell), 0.0, 1.0);
            crossing.brick = march_hit.brick - placed.place.brick_base;
            crossing.enters_negative = march_hit.enters_negative;
            // What lies behind a crossing that is no visible surface is walked to one by one.
            if (!resolve(local, crossing, found)) walk_crossings(local, passage, found, traced);
        }
    }
    // The ray ends within a shell.
    if (placed.triangles && !found.found() && local.is_inside) {
        meet_triangle(local, local.unmet_since, passage.t_max, found);
    }
    // At equal distance the lowest instance wins, whatever the order of the walk.
    Nearest& nearest = traced.nearest;
    if (found.found() && (found.t < nearest.t || !nearest.found() || passage.instance < nearest.instance)) {
        nearest = found;
    }
}

void SdfTracer::walk_crossings(LocalRay& local, const Passage& passage, Nearest& found,
                               Traced& traced) const {
    RayMarch march(*local.placed.grid, passage.origin, passage.direction, passage.t_min, passage.t_max);
    Crossing crossing;
    while (!found.found() && march.next(crossing)) resolve(local, crossing, found);
    traced.steps += march.steps();
    traced.is_exhausted = traced.is_exhausted || march.is_exhausted();
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

core::Hit SdfTracer::finish(const Traced& traced) const {
    const core::Ray& ray = traced.ray;
    const Nearest& nearest = traced.nearest;
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

template <typename Finished>
void SdfTracer::trace_block(const core::RayStream& rays, std::size_t begin, std::size_t end, bool any,
                            Work& work, const Finished& finished) const {
    std::vector<Traced>& traced = work.traced;
    traced.clear();
    const auto end_ray = [&](Traced& ray) {
        work.steps += ray.steps;
        work.exhausted += ray.is_exhausted;
        finished(ray);
    };
    for (std::size_t i = begin; i < end; ++i) {
        Traced& ray = traced.emplace_back();
        ray.ray = rays.get(i);
        ray.number = i;
        ray.nearest.t = ray.ray.t_max;
        if (core::is_valid_ray(ray.ray)) {
            ray.walk = InstanceTree::Walk(tree_, glm::dvec3(ray.ray.origin), glm::dvec3(ray.ray.direction),
                                          ray.ray.t_min, ray.nearest.t);
            if (enter_next_instance(ray)) continue;
        }
        end_ray(ray);
        traced.pop_back();
    }
    work.rays += end - begin;
    while (!traced.empty()) {
        work.rays_to_march.resize(traced.size());
        work.march_hits.resize(traced.size());
        for (std::size_t i = 0; i < traced.size(); ++i) work.rays_to_march[i] = march_ray(traced[i].passage);
        march_rays(atlas_.table(), hit_mode_, work.rays_to_march, work.march_hits);
        std::size_t kept = 0;
        for (std::size_t i = 0; i < traced.size(); ++i) {
            finish_passage(work.march_hits[i], traced[i]);
            if ((any && traced[i].nearest.found()) || !enter_next_instance(traced[i])) {
                end_ray(traced[i]);
            } else {
                if (kept != i) traced[kept] = traced[i];
                ++kept;
            }
        }
        traced.resize(kept);
    }
}

void SdfTracer::trace_closest(const core::RayStream& rays, core::HitStream& hits) const {
    hits.resize(rays.size());
    Work work;
    for (std::size_t begin = 0; begin < rays.size(); begin += kBlockRays) {
        trace_block(rays, begin, std::min(begin + kBlockRays, rays.size()), false, work,
                    [&](const Traced& traced) {
                        core::Hit hit;
                        if (traced.nearest.found()) {
                            hit = finish(traced);
                        } else if (traced.is_exhausted) {
                            hit.status = core::HitStatus::kExhausted;
                        }
                        hit.steps = traced.steps;
                        hits.set(traced.number, hit);
                    });
    }
    count(work);
}

void SdfTracer::trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const {
    assert(occluded.size() == rays.size());
    Work work;
    for (std::size_t begin = 0; begin < rays.size(); begin += kBlockRays) {
        trace_block(rays, begin, std::min(begin + kBlockRays, rays.size()), true, work,
                    [&](const Traced& traced) { occluded[traced.number] = traced.nearest.found() ? 1 : 0; });
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
    std::size_t total = placed_.capacity() * sizeof(PlacedGrid) + tree_.bytes() + atlas_.bytes();
    std::set<const BrickGrid*> counted;
    for (const auto& grid : grids_) {
        if (grid && counted.insert(grid.get()).second) total += grid->bytes();
    }
    for (const TriangleBvh& triangles : triangles_) total += triangles.bytes();
    return total;
}

}  // namespace sdf
