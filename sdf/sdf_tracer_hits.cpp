// sdf/sdf_tracer_hits.cpp: from crossings of the field to hits of the scene.
#include <algorithm>
#include <cmath>

#include "sdf/distance.h"
#include "sdf/sdf_tracer.h"
#include "sdf/sdf_tracer_work.h"
#include "sdf/sphere_trace.h"

namespace sdf {

namespace {

glm::dvec3 triangle_normal(const core::Mesh& mesh, std::uint32_t index) {
    const glm::uvec3& corners = mesh.triangles[index];
    const glm::dvec3 a(mesh.positions[corners.x]);
    return glm::normalize(
        glm::cross(glm::dvec3(mesh.positions[corners.y]) - a, glm::dvec3(mesh.positions[corners.z]) - a));
}

}  // namespace

SdfTracer::Surface SdfTracer::surface_found(const Work& work, std::size_t at,
                                            std::int32_t triangle_base) const {
    const SurfacePoints& surface = work.surface;
    Surface here;
    if (surface.triangle[at] < 0) return here;
    here.triangle = static_cast<std::uint32_t>(surface.triangle[at] - triangle_base);
    here.distance = std::sqrt(surface.distance_squared[at]);
    here.barycentrics = {surface.u[at], surface.v[at]};
    here.is_front = surface.side[at] < 0.0f;
    here.gradient = {surface.gradient_x[at], surface.gradient_y[at], surface.gradient_z[at]};
    return here;
}

void SdfTracer::keep_nearer(const NearestHit& found, Traced& traced) const {
    // At equal distance the lowest instance wins, whatever the order of the walk.
    NearestHit& nearest = traced.nearest;
    if (found.found() && (found.t < nearest.t || !nearest.found() || found.instance < nearest.instance)) {
        nearest = found;
        nearest.rounded_t = static_cast<float>(found.t);
    }
}

void SdfTracer::finish_crossing(std::size_t at, bool any, Work& work) const {
    const std::uint32_t entry = work.met[at], slot = work.active[entry];
    const MarchHit& march_hit = work.march_hits[entry];
    Traced& traced = work.traced[slot];
    const Passage& passage = traced.passage;
    const PlacedGrid& placed = placed_[passage.instance];
    const Surface here = surface_found(work, at, placed.place.triangle_base);
    const Crossing crossing = crossing_of(march_hit, passage.t_min, passage);
    if (placed.is_opaque && here.triangle != kNoTriangle && here.distance <= kFarthestTriangleVoxels) {
        // What accept() would say, without a ray in double.
        keep_nearer(here.hit(crossing.t, passage.instance, crossing.enters_negative), traced);
    } else {
        LocalRay local = local_ray(work.ray(slot), slot, traced, any);
        const bool starts_in_box = passage.t_min <= local.world.t_min;
        local.is_inside = placed.triangles && starts_in_box && may_be_inside(local, passage.t_min);
        take_crossing(local, crossing, here, work);
    }
}

void SdfTracer::find_surfaces(Work& work) const {
    if (work.met.empty()) return;
    work.surface.resize(work.met.size());
    for (std::size_t i = 0; i < work.met.size(); ++i) {
        work.surface.set(i, work.march_rays[work.met[i]], work.march_hits[work.met[i]]);
    }
    find_surface(atlas_.surface_table(), work.surface);
}

glm::vec3 SdfTracer::triangle_side(const core::Ray& ray, const NearestHit& nearest) const {
    const core::Instance& instance = scene_.instances[nearest.instance];
    const glm::dvec3 normal = glm::normalize(glm::transpose(glm::dmat3(instance.local_from_world)) *
                                             triangle_normal(scene_.meshes[instance.mesh], nearest.triangle));
    return glm::vec3(glm::dot(normal, glm::dvec3(ray.direction)) > 0.0 ? -normal : normal);
}

glm::vec3 SdfTracer::field_side(const core::Ray& ray, const NearestHit& nearest) const {
    const PlacedGrid& placed = placed_[nearest.instance];
    glm::vec3 gradient = nearest.gradient;
    if (!nearest.has_field_normal()) {
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
    if (cosine > -kFacing) normal = glm::normalize(normal - (cosine + 2.0f * kFacing) * ray.direction);
    return normal;
}

bool SdfTracer::is_within_shell(const NearestHit& nearest, const glm::vec3& position) const {
    constexpr double kWithinShellVoxels = 0.3;
    const PlacedGrid& placed = placed_[nearest.instance];
    const glm::dvec3 voxel = placed.voxel_from_world_direction * glm::dvec3(position) + placed.voxel_origin;
    return distance_at(*placed.grid, voxel).value_or(-1.0) < -kWithinShellVoxels;
}

core::Hit SdfTracer::finish(const core::Ray& ray, const NearestHit& nearest) const {
    core::Hit hit;
    hit.status = core::HitStatus::kHit;
    hit.t = std::clamp(static_cast<float>(nearest.t), ray.t_min, ray.t_max);
    hit.normal = nearest.is_triangle ? triangle_side(ray, nearest) : field_side(ray, nearest);
    hit.instance = nearest.instance;
    hit.triangle = nearest.triangle;
    hit.barycentrics = nearest.barycentrics;
    hit.front = nearest.is_front;
    const glm::vec3 position = ray.origin + hit.t * ray.direction;
    const float magnitude = std::max({glm::length(position), glm::length(ray.origin), hit.t});
    const double clearance_voxels =
        nearest.is_triangle && is_within_shell(nearest, position) ? 0.0 : kSurfaceClearanceVoxels;
    hit.offset = static_cast<float>(
        std::max(clearance_voxels * placed_[nearest.instance].world_from_voxel_scale, four_ulp(magnitude)));
    return hit;
}

}  // namespace sdf
