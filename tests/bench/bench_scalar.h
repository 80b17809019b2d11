// tests/bench/bench_scalar.h: fields one ray at a time in double: the yardstick of the vectorised tracer.
#pragma once

#include <memory>
#include <vector>

#include "core/scene/scene.h"
#include "core/trace/tracer.h"
#include "sdf/brick_grid.h"
#include "sdf/instance_tree.h"

namespace tests {

/// Walks every instance with sdf::RayMarch and takes the first crossing, for solids alone: nothing asks
/// whether a crossing stands for a visible surface.
class ScalarFieldTracer : public core::Tracer {
public:
    /// @param scene must outlive the tracer. @param grids by mesh, none null
    ScalarFieldTracer(const core::Scene& scene, std::vector<std::shared_ptr<const sdf::BrickGrid>> grids);

    void trace_closest(const core::RayStream& rays, core::HitStream& hits) const override;
    void trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const override;
    float start_offset(std::uint32_t) const override { return 0.0f; }

private:
    struct Nearest;
    Nearest first_crossing(const core::Ray& ray, bool any) const;
    core::Hit finish(const core::Ray& ray, const Nearest& nearest) const;

    struct Placed {
        const sdf::BrickGrid* grid = nullptr;
        glm::dmat3 voxel_from_world{1.0};
        glm::dvec3 voxel_origin{0.0};
    };
    const core::Scene& scene_;
    std::vector<std::shared_ptr<const sdf::BrickGrid>> grids_;
    std::vector<Placed> placed_;
    sdf::InstanceTree tree_;
};

}  // namespace tests
