#include "tests/bench/bench_scalar.h"

#include <utility>

#include "sdf/cell_triangles.h"
#include "sdf/distance.h"
#include "sdf/sphere_trace.h"

namespace tests {

struct ScalarFieldTracer::Nearest {
    double t = 0.0;
    std::uint32_t instance = core::kNoIndex;
    std::uint32_t steps = 0;
    sdf::Crossing crossing;
};

ScalarFieldTracer::ScalarFieldTracer(const core::Scene& scene,
                                     std::vector<std::shared_ptr<const sdf::BrickGrid>> grids)
    : scene_(scene), grids_(std::move(grids)) {
    std::vector<core::DoubleBounds> boxes;
    for (const core::Instance& instance : scene.instances) {
        const sdf::BrickGrid& grid = *grids_[instance.mesh];
        const double h = grid.voxel_size();
        placed_.push_back({&grid, glm::dmat3(instance.local_from_world) / h,
                           (glm::dvec3(instance.local_from_world[3]) - grid.origin()) / h});
        core::DoubleBounds box = core::transformed(grid.local_bounds(), instance.world_from_local);
        const glm::dvec3 slack = 1e-6 * box.extent();
        box.minimum -= slack;
        box.maximum += slack;
        boxes.push_back(box);
    }
    tree_ = sdf::InstanceTree(boxes);
}

ScalarFieldTracer::Nearest ScalarFieldTracer::first_crossing(const core::Ray& ray, bool any) const {
    Nearest nearest;
    nearest.t = ray.t_max;
    sdf::InstanceTree::Walk walk;
    walk.start(tree_, ray, nearest.t);
    std::uint32_t instance = 0;
    while (walk.next(nearest.t, instance)) {
        const Placed& placed = placed_[instance];
        const glm::dvec3 origin = placed.voxel_from_world * glm::dvec3(ray.origin) + placed.voxel_origin;
        const glm::dvec3 direction = placed.voxel_from_world * glm::dvec3(ray.direction);
        double t_min = ray.t_min, t_max = nearest.t;
        if (!sdf::clip_to_box(placed.grid->traced_voxels(), origin, sdf::finite_inverse(direction), t_min,
                              t_max)) {
            continue;
        }
        sdf::RayMarch march(*placed.grid, origin, direction, t_min, t_max);
        sdf::Crossing crossing;
        const bool found = march.next(crossing);
        nearest.steps += march.steps();
        if (!found) continue;
        nearest.t = crossing.t;
        nearest.instance = instance;
        nearest.crossing = crossing;
        if (any) break;
    }
    return nearest;
}

core::Hit ScalarFieldTracer::finish(const core::Ray& ray, const Nearest& nearest) const {
    core::Hit hit;
    hit.steps = nearest.steps;
    if (nearest.instance == core::kNoIndex) return hit;
    const Placed& placed = placed_[nearest.instance];
    const sdf::BrickGrid& grid = *placed.grid;
    const sdf::Crossing& crossing = nearest.crossing;
    const glm::ivec3 cell = crossing.cell - crossing.cell / sdf::kBrickCells * sdf::kBrickCells;
    const core::Mesh& mesh = scene_.meshes[scene_.instances[nearest.instance].mesh];
    const sdf::CellTriangles triangles(mesh, grid, grid.brick_at(crossing.brick), cell);
    const sdf::TriangleHit triangle =
        triangles.closest(grid.origin() + grid.voxel_size() * (glm::dvec3(crossing.cell) + crossing.point));
    const glm::dvec3 normal = glm::normalize(glm::transpose(placed.voxel_from_world) *
                                             sdf::smooth_gradient(grid, crossing.cell, crossing.point));
    hit.status = core::HitStatus::kHit;
    hit.t = static_cast<float>(nearest.t);
    hit.normal = glm::vec3(glm::dot(normal, glm::dvec3(ray.direction)) > 0.0 ? -normal : normal);
    hit.instance = nearest.instance;
    hit.triangle = triangle.index;
    hit.barycentrics = glm::vec2(triangle.point.barycentrics);
    hit.front = crossing.enters_negative;
    return hit;
}

void ScalarFieldTracer::trace_closest(const core::RayStream& rays, core::HitStream& hits) const {
    hits.resize(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Ray ray = rays.get(i);
        hits.set(i, finish(ray, first_crossing(ray, false)));
    }
}

void ScalarFieldTracer::trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        occluded[i] = first_crossing(rays.get(i), true).instance != core::kNoIndex ? 1 : 0;
    }
}

}  // namespace tests
