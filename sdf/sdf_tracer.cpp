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
constexpr std::size_t kBlockRays = 2048;

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

FieldPlacement placement_of(const SdfTracer::PlacedGrid& placed) {
    FieldPlacement placement;
    for (int axis = 0; axis < 3; ++axis) {
        for (int row = 0; row < 3; ++row) {
            placement.voxel_from_world[3 * axis + row] = placed.voxel_from_world_direction[axis][row];
        }
        placement.voxel_origin[axis] = placed.voxel_origin[axis];
        placement.box[axis] = placed.grid->traced_voxels().maximum[axis];
    }
    placement.top_base = placed.place.top_base;
    placement.top_stride_x = placed.place.stride_x;
    placement.top_stride_y = placed.place.stride_y;
    return placement;
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
    glm::vec2 barycentrics{0.0f};
    glm::vec3 gradient{0.0f};  ///< Of the field, in voxels, where not is_triangle.
    bool enters_negative = true;
    bool is_front = true;
    bool is_triangle = false;  ///< The ray meets the triangle itself, not the field that stands for it.

    bool found() const { return instance != core::kNoIndex; }
};

/// A ray's way through the box of one instance's field.
struct SdfTracer::Passage {
    std::uint32_t instance = core::kNoIndex;
    double t_min = 0.0, t_max = 0.0;
    double t_per_voxel = 1.0;

    double t_at(const MarchHit& march_hit) const { return t_min + march_hit.distance * t_per_voxel; }
};

/// A ray on its way through the scene.
struct SdfTracer::Traced {
    Nearest nearest;
    Passage passage;
    std::uint32_t steps = 0;
    bool is_exhausted = false;
};

/// The memory of a block of rays.
struct SdfTracer::Work {
    const core::RayStream* rays = nullptr;
    std::size_t first_ray = 0;  ///< Of the block.
    std::vector<std::uint8_t> valid = std::vector<std::uint8_t>(kBlockRays);
    std::vector<Traced> traced{kBlockRays};
    std::vector<InstanceTree::Walk> walks{kBlockRays};  ///< Of the same rays.
    std::vector<std::uint32_t> leaving;                 ///< Rays that go on to their next instance.
    Entries entries{kBlockRays};
    std::vector<std::uint32_t> active;             ///< Rays that are within a field's box.
    std::vector<MarchRay> march_rays{kBlockRays};  ///< Of the active rays.
    std::vector<MarchHit> march_hits{kBlockRays};
    std::vector<std::uint32_t> met;  ///< Entries of `active` whose crossing is looked up in `surface`.
    SurfacePoints surface;

    core::Ray ray(std::uint32_t slot) const { return rays->get(first_ray + slot); }
};

SdfTracer::SdfTracer(const core::Scene& scene, std::vector<std::shared_ptr<const BrickGrid>> grids,
                     HitMode hit_mode)
    : scene_(scene),
      grids_(std::move(grids)),
      atlas_(grids_, scene.meshes),
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
    placements_.resize(scene.instances.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const core::Instance& instance = scene.instances[i];
        const BrickGrid* grid = grids_[instance.mesh].get();
        if (!grid || grid->traced_voxels().empty()) continue;
        const double h = grid->voxel_size();
        PlacedGrid& placed = placed_[i];
        placed.grid = grid;
        placed.place = atlas_.place(instance.mesh);
        placed.triangles = triangles_[instance.mesh].empty() ? nullptr : &triangles_[instance.mesh];
        placed.is_opaque_solid = grid->info().clean_level_set && !has_alpha_;
        placed.voxel_from_world_direction = glm::dmat3(instance.local_from_world) / h;
        placed.world_from_voxel_gradient =
            glm::mat3(glm::transpose(placed.voxel_from_world_direction) * grid->voxel_size());
        placed.voxel_origin = (glm::dvec3(instance.local_from_world[3]) - grid->origin()) / h;
        placed.world_from_voxel_scale = largest_singular_value(glm::dmat3(instance.world_from_local)) * h;
        placements_[i] = placement_of(placed);
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
    only_instance_ = tree_.only_instance();
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
    found.barycentrics = glm::vec2(hit.point.barycentrics);
    // Directions in voxels and in local units differ by h alone, which no sign depends on.
    found.is_front = glm::dot(ray.direction, hit.corners.scaled_normal()) < 0.0;
    found.gradient = glm::vec3(smooth_gradient(grid, crossing.cell, crossing.point));
    found.enters_negative = crossing.enters_negative;
    found.is_triangle = false;
    return true;
}

void SdfTracer::enter_next_instances(Work& work) const {
    work.active.clear();
    Entries& entries = work.entries;
    while (!work.leaving.empty()) {
        // Those without another instance drop out.
        std::size_t count = 0;
        for (const std::uint32_t slot : work.leaving) {
            std::uint32_t instance = only_instance_;
            const double limit = work.traced[slot].nearest.t;
            if (instance == core::kNoIndex && !work.walks[slot].next(limit, instance)) continue;
            entries.ray[count] = static_cast<std::int32_t>(work.first_ray + slot);
            entries.instance[count] = static_cast<std::int32_t>(instance);
            entries.limit[count] = limit;
            work.leaving[count++] = slot;
        }
        if (count > 0) {
            enter_fields(*work.rays, placements_.data(), entries, count,
                         work.march_rays.data() + work.active.size());
        }
        std::size_t missing = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint32_t slot = work.leaving[i];
            if (entries.t_min[i] <= entries.t_max[i]) {
                work.traced[slot].passage = {static_cast<std::uint32_t>(entries.instance[i]),
                                             entries.t_min[i], entries.t_max[i], entries.t_per_voxel[i]};
                work.active.push_back(slot);
            } else {
                work.leaving[missing++] = slot;
            }
        }
        work.leaving.resize(only_instance_ == core::kNoIndex ? missing : 0);
    }
}

SdfTracer::LocalRay SdfTracer::local_ray(const core::Ray& ray, const Traced& traced) const {
    const PlacedGrid& placed = placed_[traced.passage.instance];
    return {ray,
            traced.passage.instance,
            placed,
            scene_.meshes[scene_.instances[traced.passage.instance].mesh],
            placed.voxel_from_world_direction * glm::dvec3(ray.origin) + placed.voxel_origin,
            placed.voxel_from_world_direction * glm::dvec3(ray.direction),
            traced.nearest.t,
            ray.t_min,
            false};
}

void SdfTracer::keep_nearer(const Nearest& found, Traced& traced) const {
    // At equal distance the lowest instance wins, whatever the order of the walk.
    Nearest& nearest = traced.nearest;
    if (found.found() && (found.t < nearest.t || !nearest.found() || found.instance < nearest.instance)) {
        nearest = found;
    }
}

void SdfTracer::finish_thickened(const core::Ray& ray, const MarchHit& march_hit, Traced& traced) const {
    const Passage& passage = traced.passage;
    LocalRay local = local_ray(ray, traced);
    local.is_inside =
        distance_at(*local.placed.grid, local.origin + passage.t_min * local.direction).value_or(1.0) < 0.0;
    Nearest found;
    if (march_hit.status == MarchStatus::kHit) {
        Crossing crossing;
        crossing.t = passage.t_at(march_hit);
        if (crossing.t <= passage.t_max) {
            crossing.cell = {march_hit.cell[0], march_hit.cell[1], march_hit.cell[2]};
            crossing.point =
                glm::clamp(local.origin + crossing.t * local.direction - glm::dvec3(crossing.cell), 0.0, 1.0);
            crossing.brick = march_hit.brick - local.placed.place.brick_base;
            crossing.enters_negative = march_hit.enters_negative;
            // What lies behind a crossing that is no visible surface is walked to one by one.
            if (!resolve(local, crossing, found)) walk_crossings(local, traced, found);
        }
    }
    // The ray ends within a shell.
    if (!found.found() && local.is_inside) meet_triangle(local, local.unmet_since, passage.t_max, found);
    keep_nearer(found, traced);
}

void SdfTracer::finish_plain(const Work& work, std::size_t at, Traced& traced) const {
    const std::uint32_t entry = work.met[at];
    const MarchHit& march_hit = work.march_hits[entry];
    const Passage& passage = traced.passage;
    const PlacedGrid& placed = placed_[passage.instance];
    const SurfacePoints& surface = work.surface;
    Nearest found;
    found.t = passage.t_at(march_hit);
    found.triangle = static_cast<std::uint32_t>(surface.triangle[at] - placed.place.triangle_base);
    found.barycentrics = {surface.u[at], surface.v[at]};
    const bool is_surface = surface.triangle[at] >= 0 &&
                            surface.distance_squared[at] <= kFarthestTriangleVoxels * kFarthestTriangleVoxels;
    if (is_surface &&
        (!has_alpha_ || core::is_visible(scene_, passage.instance, found.triangle, found.barycentrics,
                                         work.ray(work.active[entry]).seed))) {
        found.instance = passage.instance;
        found.gradient = {surface.gradient_x[at], surface.gradient_y[at], surface.gradient_z[at]};
        found.enters_negative = march_hit.enters_negative;
        const float* direction = work.march_rays[entry].direction;
        found.is_front = glm::dot(glm::vec3(direction[0], direction[1], direction[2]),
                                  atlas_.triangle(surface.triangle[at]).scaled_normal()) < 0.0f;
    } else {
        const core::Ray ray = work.ray(work.active[entry]);
        LocalRay local = local_ray(ray, traced);
        found = Nearest();
        walk_crossings(local, traced, found);
    }
    keep_nearer(found, traced);
}

void SdfTracer::walk_crossings(LocalRay& local, Traced& traced, Nearest& found) const {
    const Passage& passage = traced.passage;
    RayMarch march(*local.placed.grid, local.origin, local.direction, passage.t_min, passage.t_max);
    Crossing crossing;
    while (!found.found() && march.next(crossing)) resolve(local, crossing, found);
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

void SdfTracer::march_active(bool any, Work& work) const {
    const std::size_t count = work.active.size();
    march_rays(atlas_.table(), hit_mode_, std::span(work.march_rays).first(count),
               std::span(work.march_hits).first(count));

    work.met.clear();
    for (std::size_t i = 0; i < count; ++i) {
        Traced& traced = work.traced[work.active[i]];
        const MarchHit& march_hit = work.march_hits[i];
        const PlacedGrid& placed = placed_[traced.passage.instance];
        traced.steps += march_hit.steps;
        if (placed.triangles) {
            finish_thickened(work.ray(work.active[i]), march_hit, traced);
        } else if (march_hit.status == MarchStatus::kExhausted) {
            traced.is_exhausted = true;
        } else if (march_hit.status == MarchStatus::kHit) {
            const double t = traced.passage.t_at(march_hit);
            if (!(t <= traced.passage.t_max)) continue;
            if (any && placed.is_opaque_solid) {
                traced.nearest.t = t;
                traced.nearest.instance = traced.passage.instance;
            } else {
                work.met.push_back(static_cast<std::uint32_t>(i));
            }
        }
    }
    if (work.met.empty()) return;
    work.surface.resize(work.met.size());
    for (std::size_t i = 0; i < work.met.size(); ++i) {
        work.surface.set(i, work.march_rays[work.met[i]], work.march_hits[work.met[i]]);
    }
    find_surface(atlas_.surface_table(), work.surface);
    for (std::size_t i = 0; i < work.met.size(); ++i) {
        finish_plain(work, i, work.traced[work.active[work.met[i]]]);
    }
}

void SdfTracer::trace_block(std::size_t begin, std::size_t end, bool any, Work& work) const {
    const core::RayStream& rays = *work.rays;
    const bool is_one_instance = only_instance_ != core::kNoIndex;
    work.first_ray = begin;
    core::find_valid_rays(rays, begin, end, work.valid.data());
    work.leaving.clear();
    for (std::size_t i = begin; i < end; ++i) {
        const std::size_t slot = i - begin;
        Traced& traced = work.traced[slot];
        traced.steps = 0;
        traced.is_exhausted = false;
        traced.nearest.instance = core::kNoIndex;
        if (!work.valid[slot]) continue;
        traced.nearest.t = rays.t_max[i];
        if (!is_one_instance) {
            const core::Ray ray = rays.get(i);
            work.walks[slot].start(tree_, glm::dvec3(ray.origin), glm::dvec3(ray.direction), ray.t_min,
                                   ray.t_max);
        }
        work.leaving.push_back(static_cast<std::uint32_t>(slot));
    }
    for (;;) {
        enter_next_instances(work);
        if (work.active.empty()) break;
        march_active(any, work);
        if (is_one_instance) break;
        for (const std::uint32_t slot : work.active) {
            if (!any || !work.traced[slot].nearest.found()) work.leaving.push_back(slot);
        }
    }
}

template <typename Finished>
void SdfTracer::trace(const core::RayStream& rays, bool any, const Finished& finished) const {
    // Kept from call to call: to take and to clear so much memory would cost more than to trace a few rays.
    static thread_local Work work;
    work.rays = &rays;
    std::uint64_t steps = 0, exhausted = 0;
    for (std::size_t begin = 0; begin < rays.size(); begin += kBlockRays) {
        const std::size_t end = std::min(begin + kBlockRays, rays.size());
        trace_block(begin, end, any, work);
        for (std::size_t i = begin; i < end; ++i) {
            const Traced& traced = work.traced[i - begin];
            steps += traced.steps;
            exhausted += traced.is_exhausted;
            finished(i, traced);
        }
    }
    ray_count_.fetch_add(rays.size(), std::memory_order_relaxed);
    step_count_.fetch_add(steps, std::memory_order_relaxed);
    exhausted_count_.fetch_add(exhausted, std::memory_order_relaxed);
}

void SdfTracer::trace_closest(const core::RayStream& rays, core::HitStream& hits) const {
    hits.resize(rays.size());
    hits.fill_with_misses();
    trace(rays, false, [&](std::size_t i, const Traced& traced) {
        if (traced.nearest.found()) {
            hits.set(i, finish(rays.get(i), traced));
        } else if (traced.is_exhausted) {
            hits.status[i] = core::HitStatus::kExhausted;
        }
        hits.steps[i] = traced.steps;
    });
}

void SdfTracer::trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const {
    assert(occluded.size() == rays.size());
    trace(rays, true,
          [&](std::size_t i, const Traced& traced) { occluded[i] = traced.nearest.found() ? 1 : 0; });
}

float SdfTracer::start_offset(std::uint32_t instance) const {
    return placed_[instance].start_offset;
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
