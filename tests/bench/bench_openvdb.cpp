#include "tests/bench/bench_openvdb.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/RayIntersector.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <cassert>
#include <limits>

#include "sdf/brick_grid.h"

namespace tests {
namespace {

/// The field in voxels, lattice point (i, j, k) at (i, j, k): what OpenVDB calls world is our voxel space.
openvdb::FloatGrid::Ptr float_grid(const sdf::SampledField& field) {
    openvdb::initialize();
    auto grid = openvdb::FloatGrid::create(sdf::kBandVoxels);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    for (const sdf::FieldLeaf& from : field.leaves) {
        auto* const leaf = grid->tree().touchLeaf({from.origin.x, from.origin.y, from.origin.z});
        for (int i = 0; i < sdf::kLeafSize; ++i) {
            const auto at = static_cast<std::size_t>(i);
            // The samples as our bricks store them: the same surface to the last bit.
            const auto voxels = static_cast<float>(from.distance[at] / field.info.voxel_size);
            const float stored = static_cast<float>(sdf::stored_sample(voxels)) * sdf::kSampleStepVoxels;
            const auto offset = static_cast<openvdb::Index>(i);
            if (from.is_active(i)) {
                leaf->setValueOn(offset, stored);
            } else {
                leaf->setValueOff(offset, voxels < 0.0f ? -sdf::kBandVoxels : sdf::kBandVoxels);
            }
        }
    }
    openvdb::tools::signedFloodFill(grid->tree());
    return grid;
}

class OpenVdbTracer : public core::Tracer {
public:
    OpenVdbTracer(const core::Scene& scene, const sdf::SampledField& field)
        : grid_(float_grid(field)), intersector_(*grid_) {
        assert(scene.instances.size() == 1);
        const core::Instance& instance = scene.instances[0];
        const double h = field.info.voxel_size;
        voxel_from_world_ = glm::dmat3(instance.local_from_world) / h;
        voxel_origin_ = (glm::dvec3(instance.local_from_world[3]) - field.info.origin) / h;
    }

    void trace_closest(const core::RayStream& rays, core::HitStream& hits) const override {
        hits.resize(rays.size());
        // It keeps what it is doing in itself: one a thread.
        const Intersector intersector(intersector_);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const core::Ray ray = rays.get(i);
            double speed = 1.0;
            const Intersector::RayType voxel_ray = to_voxels(ray, speed);
            // The overloads that return the time alone read it before the test runs.
            openvdb::Vec3d position, normal;
            double time = 0.0;
            core::Hit hit;
            if (intersector.intersectsWS(voxel_ray, position, normal, time)) {
                const glm::dvec3 world = glm::normalize(glm::transpose(voxel_from_world_) *
                                                        glm::dvec3(normal.x(), normal.y(), normal.z()));
                hit.status = core::HitStatus::kHit;
                hit.t = static_cast<float>(time / speed);
                hit.normal = glm::vec3(glm::dot(world, glm::dvec3(ray.direction)) > 0.0 ? -world : world);
                hit.instance = 0;
            }
            hits.set(i, hit);
        }
    }

    void trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const override {
        const Intersector intersector(intersector_);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            double speed = 1.0;
            occluded[i] = intersector.intersectsWS(to_voxels(rays.get(i), speed)) ? 1 : 0;
        }
    }

    float start_offset(std::uint32_t) const override { return 0.0f; }

private:
    using Search = openvdb::tools::LinearSearchImpl<openvdb::FloatGrid, 4>;
    using Intersector = openvdb::tools::LevelSetRayIntersector<openvdb::FloatGrid, Search>;

    Intersector::RayType to_voxels(const core::Ray& ray, double& speed) const {
        const glm::dvec3 origin = voxel_from_world_ * glm::dvec3(ray.origin) + voxel_origin_;
        glm::dvec3 direction = voxel_from_world_ * glm::dvec3(ray.direction);
        speed = glm::length(direction);
        direction /= speed;
        constexpr float kUnbounded = std::numeric_limits<float>::infinity();
        return {{origin.x, origin.y, origin.z},
                {direction.x, direction.y, direction.z},
                ray.t_min * speed,
                ray.t_max == kUnbounded ? std::numeric_limits<double>::max() : ray.t_max * speed};
    }

    openvdb::FloatGrid::Ptr grid_;
    Intersector intersector_;
    glm::dmat3 voxel_from_world_{1.0};
    glm::dvec3 voxel_origin_{0.0};
};

}  // namespace

std::unique_ptr<core::Tracer> make_openvdb_tracer(const core::Scene& scene, const sdf::SampledField& field) {
    return std::make_unique<OpenVdbTracer>(scene, field);
}

}  // namespace tests
