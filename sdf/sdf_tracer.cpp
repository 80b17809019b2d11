#include "sdf/sdf_tracer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <set>

#include "core/support/parallel.h"
#include "core/trace/surface.h"
#include "sdf/instance_bounds.h"
#include "sdf/sdf_tracer_work.h"
#include "sdf/transform_scale.h"

namespace sdf {

namespace {

/// All triangles of a mesh that a ray can meet.
TriangleRayTree triangle_tree(const core::Mesh& mesh) {
    std::vector<std::uint32_t> usable;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const glm::uvec3& corners = mesh.triangles[i];
        const Triangle triangle{glm::dvec3(mesh.positions[corners.x]), glm::dvec3(mesh.positions[corners.y]),
                                glm::dvec3(mesh.positions[corners.z])};
        const double area = glm::length(triangle.scaled_normal());
        if (area > 0.0 && std::isfinite(area)) usable.push_back(i);
    }
    return TriangleRayTree(mesh.positions, mesh.triangles, usable);
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
    placement.top_octant = placed.place.octant_stride;
    placement.top_stride_x = placed.place.stride_x;
    placement.top_stride_y = placed.place.stride_y;
    return placement;
}

HitPlacement hit_placement_of(const SdfTracer::PlacedGrid& placed) {
    HitPlacement placement;
    for (int axis = 0; axis < 3; ++axis) {
        for (int row = 0; row < 3; ++row) {
            placement.world_from_gradient[3 * axis + row] = placed.world_from_voxel_gradient[axis][row];
        }
    }
    placement.clearance = static_cast<float>(kSurfaceClearanceVoxels * placed.world_from_voxel_scale);
    return placement;
}

}  // namespace

SdfTracer::SdfTracer(const core::Scene& scene, std::vector<std::shared_ptr<const BrickGrid>> grids,
                     HitMode hit_mode)
    : scene_(scene),
      grids_(std::move(grids)),
      atlas_(grids_, scene.meshes),
      hit_mode_(hit_mode),
      has_alpha_(core::has_alpha(scene)) {
    assert(grids_.size() == scene.meshes.size());
    triangles_.resize(grids_.size());
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
    hit_placements_.resize(scene.instances.size());
    std::vector<std::vector<core::DoubleBounds>> surfaces(grids_.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const core::Instance& instance = scene.instances[i];
        const BrickGrid* grid = grids_[instance.mesh].get();
        if (!grid || grid->traced_voxels().empty()) continue;
        const double h = grid->voxel_size();
        PlacedGrid& placed = placed_[i];
        placed.grid = grid;
        placed.place = atlas_.place(instance.mesh);
        placed.triangles = triangles_[instance.mesh].empty() ? nullptr : &triangles_[instance.mesh];
        placed.is_sheet = placed.triangles && grid->info().mesh_class == MeshClass::kSheet;
        placed.is_opaque = !placed.triangles && !has_alpha_;
        placed.is_opaque_solid = grid->info().clean_level_set && !has_alpha_;
        placed.voxel_from_world_direction = glm::dmat3(instance.local_from_world) / h;
        placed.world_from_voxel_gradient =
            glm::mat3(glm::transpose(placed.voxel_from_world_direction) * grid->voxel_size());
        placed.voxel_origin = (glm::dvec3(instance.local_from_world[3]) - grid->origin()) / h;
        placed.world_from_voxel_scale = largest_singular_value(glm::dmat3(instance.world_from_local)) * h;
        placements_[i] = placement_of(placed);
        hit_placements_[i] = hit_placement_of(placed);
        std::vector<core::DoubleBounds>& surface = surfaces[instance.mesh];
        if (surface.empty()) surface = surface_boxes(*grid);
        boxes[i] = world_bounds(surface, instance.world_from_local);
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

void SdfTracer::enter_next_instances(Work& work) const {
    work.active.clear();
    Entries& entries = work.entries;
    while (!work.leaving.empty()) {
        for (std::size_t i = 0; i < work.leaving.size(); ++i) {
            work.limits[i] = work.traced[work.leaving[i]].nearest.t;
        }
        if (only_instance_ == core::kNoIndex) {
            InstanceTree::find_next(work.walks, work.leaving, work.limits.data(), work.next_instances.data());
        }
        // Those without another instance drop out.
        std::size_t count = 0;
        for (std::size_t i = 0; i < work.leaving.size(); ++i) {
            const std::uint32_t slot = work.leaving[i];
            const std::uint32_t instance =
                only_instance_ != core::kNoIndex ? only_instance_ : work.next_instances[i];
            if (instance == core::kNoIndex) continue;
            entries.ray[count] = static_cast<std::int32_t>(work.first_ray + slot);
            entries.instance[count] = static_cast<std::int32_t>(instance);
            entries.limit[count] = work.limits[i];
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

void SdfTracer::march_active(bool any, Work& work) const {
    const std::size_t count = work.active.size();
    march_rays(atlas_.table(), hit_mode_, std::span(work.march_rays).first(count),
               std::span(work.march_hits).first(count));

    work.met.clear();
    work.going_on.clear();
    for (std::size_t i = 0; i < count; ++i) {
        Traced& traced = work.traced[work.active[i]];
        const MarchHit& march_hit = work.march_hits[i];
        const PlacedGrid& placed = placed_[traced.passage.instance];
        traced.steps += march_hit.steps;
        if (march_hit.status == MarchStatus::kExhausted) traced.is_exhausted = true;
        const double t = traced.passage.t_at(march_hit);
        if (march_hit.status != MarchStatus::kHit || !(t <= traced.passage.t_max)) {
            // A ray that comes from outside the field's box is in no shell.
            if (placed.triangles) {
                LocalRay local = local_ray(work.ray(work.active[i]), work.active[i], traced, any);
                if (traced.passage.t_min <= local.world.t_min) ask_at_end(local, work);
            }
        } else if (any && placed.is_opaque_solid) {
            traced.nearest.t = t;
            traced.nearest.instance = traced.passage.instance;
        } else if (placed.is_sheet) {
            LocalRay local = local_ray(work.ray(work.active[i]), work.active[i], traced, any);
            take_sheet(local, crossing_of(march_hit, traced.passage.t_min, traced.passage), work);
        } else {
            work.met.push_back(static_cast<std::uint32_t>(i));
        }
    }
    find_surfaces(work);
    for (std::size_t i = 0; i < work.met.size(); ++i) finish_crossing(i, any, work);
    go_on(work);
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
            work.walks[slot].start(tree_, rays.get(i), traced.nearest.t);
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
        for (std::size_t slot = 0; slot < end - begin; ++slot) {
            steps += work.traced[slot].steps;
            exhausted += work.traced[slot].is_exhausted;
        }
        finished(begin, end, work);
    }
    ray_count_.fetch_add(rays.size(), std::memory_order_relaxed);
    step_count_.fetch_add(steps, std::memory_order_relaxed);
    exhausted_count_.fetch_add(exhausted, std::memory_order_relaxed);
}

void SdfTracer::trace_closest(const core::RayStream& rays, core::HitStream& hits) const {
    hits.resize(rays.size());
    trace(rays, false, [&](std::size_t begin, std::size_t end, const Work& work) {
        finish_hits(rays, begin, end - begin, &work.traced[0].nearest, sizeof(Traced), hit_placements_.data(),
                    hits);
        for (std::size_t i = begin; i < end; ++i) {
            const Traced& traced = work.traced[i - begin];
            if (!traced.nearest.found()) {
                if (traced.is_exhausted) hits.status[i] = core::HitStatus::kExhausted;
            } else if (!traced.nearest.has_field_normal()) {
                hits.set(i, finish(rays.get(i), traced.nearest));
            }
            hits.steps[i] = traced.steps;
        }
    });
}

void SdfTracer::trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const {
    assert(occluded.size() == rays.size());
    trace(rays, true, [&](std::size_t begin, std::size_t end, const Work& work) {
        for (std::size_t i = begin; i < end; ++i) {
            occluded[i] = work.traced[i - begin].nearest.found() ? 1 : 0;
        }
    });
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
    for (const TriangleRayTree& triangles : triangles_) total += triangles.bytes();
    return total;
}

}  // namespace sdf
