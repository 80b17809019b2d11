// tests/sdf/field_kernel_test.cpp: the kernels against their scalar twins, on every instruction set.
#include "sdf/field_kernel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "sdf/cell_triangles.h"
#include "sdf/distance.h"
#include "sdf/entry_kernel.h"
#include "sdf/field_table.h"
#include "sdf/instance_tree.h"
#include "sdf/sphere_trace.h"
#include "sdf/surface_kernel.h"
#include "tests/sdf/baked_shapes.h"

namespace tests {
namespace {

/// Kernels run with the named instruction set while this lives.
class TargetInUse {
public:
    explicit TargetInUse(const std::string& name) { EXPECT_TRUE(sdf::select_kernel_target(name)) << name; }
    ~TargetInUse() { sdf::select_kernel_target(""); }
    TargetInUse(const TargetInUse&) = delete;
    TargetInUse& operator=(const TargetInUse&) = delete;
};

/// A torus and a box in one mesh: curved and flat, with creases and a gap.
core::Mesh subject() {
    return merged(torus(1.0f, 0.3f, 48, 24), moved(box(), translation({0.4, 0.6, 0.9})));
}

/// On samples of either size.
class FieldKernel : public testing::TestWithParam<sdf::SampleBits> {
protected:
    const core::Scene scene_ = scene_of(subject());
    const std::shared_ptr<const sdf::BrickGrid> grid_ = grid_of(scene_.meshes[0], 64, GetParam());
    const std::vector<std::shared_ptr<const sdf::BrickGrid>> grids_{grid_};
    const sdf::FieldAtlas atlas_{grids_, scene_.meshes};

    sdf::FieldPlacement placement() const {
        sdf::FieldPlacement place{};
        for (int axis = 0; axis < 3; ++axis) {
            place.voxel_from_world[4 * axis] = 1.0 / grid_->voxel_size();
            place.voxel_origin[axis] = -grid_->origin()[axis] / grid_->voxel_size();
            place.box[axis] = grid_->traced_voxels().maximum[axis];
        }
        place.top_base = atlas_.place(0).top_base;
        place.top_octant = atlas_.place(0).octant_stride;
        place.top_stride_x = atlas_.place(0).stride_x;
        place.top_stride_y = atlas_.place(0).stride_y;
        return place;
    }

    /// Rays through the box, some along axes and some from within, brought to the field.
    std::vector<sdf::MarchRay> rays(std::size_t count) const {
        core::RayStream stream = random_lines({0.2, 0.2, 0.3}, 1.8, count, 5);
        TestRandom random(6);
        for (std::size_t i = 0; i < count; i += 5) {
            core::Ray ray = stream.get(i);
            if (i % 2 == 0)
                ray.direction = glm::vec3(i % 4 == 0 ? 1.0f : 0.0f, 0.0f, i % 4 == 0 ? 0.0f : -1.0f);
            if (i % 3 == 0) ray.origin = glm::vec3(0.9 * random.uniform(), 0.5, 0.5 * random.uniform());
            stream.set(i, ray);
        }
        sdf::Entries entries(count);
        for (std::size_t i = 0; i < count; ++i) {
            entries.ray[i] = static_cast<std::int32_t>(i);
            entries.instance[i] = 0;
            entries.limit[i] = i % 7 == 0 ? 1.5 : 1e30;
        }
        std::vector<sdf::MarchRay> passing(count);
        const sdf::FieldPlacement place = placement();
        sdf::enter_fields(stream, &place, entries, count, passing.data());
        std::size_t met = 0;
        for (std::size_t i = 0; i < count; ++i) met += entries.t_min[i] <= entries.t_max[i];
        passing.resize(met);
        return passing;
    }
};

INSTANTIATE_TEST_SUITE_P(Samples, FieldKernel, testing::Values(sdf::SampleBits::k8, sdf::SampleBits::k16),
                         [](const auto& tested) {
                             return std::to_string(static_cast<int>(tested.param)) + "Bits";
                         });

constexpr sdf::HitMode kModes[] = {sdf::HitMode::kEps, sdf::HitMode::kSecant, sdf::HitMode::kCubic};

TEST_P(FieldKernel, EveryInstructionSetGivesTheSameBits) {
    const std::vector<sdf::MarchRay> rays = this->rays(20'000);
    ASSERT_GT(rays.size(), 10'000u);
    const std::vector<std::string> targets = sdf::kernel_targets();
    ASSERT_FALSE(targets.empty());
    for (const sdf::HitMode mode : kModes) {
        std::vector<sdf::MarchHit> first;
        for (const std::string& target : targets) {
            const TargetInUse in_use(target);
            std::vector<sdf::MarchHit> hits(rays.size());
            std::memset(static_cast<void*>(hits.data()), 0, hits.size() * sizeof(hits[0]));
            sdf::march_rays(atlas_.table(), mode, rays, hits);
            if (first.empty()) first = hits;
            EXPECT_EQ(std::memcmp(first.data(), hits.data(), hits.size() * sizeof(hits[0])), 0) << target;
        }
    }
}

TEST_P(FieldKernel, AnswersDependOnTheirOwnRayAlone) {
    std::vector<sdf::MarchRay> rays = this->rays(3'000);
    std::vector<sdf::MarchHit> together(rays.size());
    sdf::march_rays(atlas_.table(), sdf::HitMode::kCubic, rays, together);
    for (std::size_t i = 0; i < rays.size(); i += 17) {
        sdf::MarchHit alone;
        sdf::march_rays(atlas_.table(), sdf::HitMode::kCubic, std::span(&rays[i], 1), std::span(&alone, 1));
        EXPECT_EQ(alone.status, together[i].status);
        EXPECT_EQ(alone.steps, together[i].steps);
        if (alone.status == sdf::MarchStatus::kHit) {
            EXPECT_EQ(alone.distance, together[i].distance);
        }
    }
}

TEST_P(FieldKernel, CubicFindsWhatTheDoubleWalkFinds) {
    const std::vector<sdf::MarchRay> rays = this->rays(20'000);
    std::vector<sdf::MarchHit> hits(rays.size());
    sdf::march_rays(atlas_.table(), sdf::HitMode::kCubic, rays, hits);
    std::size_t compared = 0, differing = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const auto vector = [](const float(&v)[3]) { return glm::dvec3(v[0], v[1], v[2]); };
        sdf::RayMarch march(*grid_, vector(rays[i].origin), vector(rays[i].direction), 0.0, rays[i].length);
        sdf::Crossing crossing;
        const bool is_hit = march.next(crossing);
        ASSERT_NE(hits[i].status, sdf::MarchStatus::kExhausted) << "ray " << i;
        if (is_hit != (hits[i].status == sdf::MarchStatus::kHit)) {
            ++differing;
            continue;
        }
        if (!is_hit) continue;
        ++compared;
        EXPECT_EQ(hits[i].enters_negative, crossing.enters_negative) << "ray " << i;
        // Where the ray runs along the surface, a small change of height is a long way.
        if (std::abs(hits[i].distance - crossing.t) > 1e-3) ++differing;
    }
    EXPECT_GT(compared, 5'000u);
    EXPECT_LE(differing, compared / 2000);
}

TEST_P(FieldKernel, CellsOfMixedSignAreOccupied) {
    for (std::size_t i = 0; i < grid_->brick_count(); ++i) {
        const sdf::Brick& brick = grid_->brick_at(static_cast<std::int32_t>(i));
        for (int cell = 0; cell < 343; ++cell) {
            const glm::ivec3 at(cell / 49, cell / 7 % 7, cell % 7);
            int negative = 0, zero = 0;
            for (const double value : sdf::CellCorners::load(brick, at).value) {
                negative += value < 0.0;
                zero += value == 0.0;
            }
            const bool is_occupied = brick.is_occupied(at.x, at.y, at.z);
            if (negative > 0 && negative < 8) {
                ASSERT_TRUE(is_occupied) << "brick " << i;
            } else if (zero == 0) {
                ASSERT_FALSE(is_occupied) << "brick " << i;
            }
        }
    }
}

TEST_P(FieldKernel, SurfacePointsAreTheClosestTrianglesAndTheMeanGradient) {
    const std::vector<sdf::MarchRay> rays = this->rays(5'000);
    std::vector<sdf::MarchHit> hits(rays.size());
    sdf::march_rays(atlas_.table(), sdf::HitMode::kCubic, rays, hits);
    std::vector<std::size_t> met;
    for (std::size_t i = 0; i < hits.size(); ++i) {
        if (hits[i].status == sdf::MarchStatus::kHit) met.push_back(i);
    }
    ASSERT_GT(met.size(), 1'000u);
    const double h = grid_->voxel_size();
    for (const std::string& target : sdf::kernel_targets()) {
        const TargetInUse in_use(target);
        sdf::SurfacePoints points;
        points.resize(met.size());
        for (std::size_t k = 0; k < met.size(); ++k) points.set(k, rays[met[k]], hits[met[k]]);
        sdf::find_surface(atlas_.surface_table(), points);
        for (std::size_t k = 0; k < met.size(); ++k) {
            const sdf::MarchHit& hit = hits[met[k]];
            const glm::ivec3 cell(hit.cell[0], hit.cell[1], hit.cell[2]);
            const glm::dvec3 voxel(points.x[k], points.y[k], points.z[k]);
            const sdf::CellTriangles triangles(scene_.meshes[0], *grid_, grid_->brick_at(hit.brick),
                                               cell % sdf::kBrickCells);
            const sdf::TriangleHit closest = triangles.closest(grid_->origin() + h * voxel);
            ASSERT_GE(points.triangle[k], 0);
            // Two triangles may be equally close but for rounding.
            EXPECT_NEAR(std::sqrt(points.distance_squared[k]), closest.distance / h, 1e-4) << target;
            if (static_cast<std::uint32_t>(points.triangle[k]) == closest.index) {
                EXPECT_NEAR(points.u[k], closest.point.barycentrics.x, 2e-4);
                EXPECT_NEAR(points.v[k], closest.point.barycentrics.y, 2e-4);
            }
            const double facing =
                glm::dot(closest.corners.scaled_normal(),
                         glm::dvec3(points.direction_x[k], points.direction_y[k], points.direction_z[k]));
            if (static_cast<std::uint32_t>(points.triangle[k]) == closest.index && std::abs(facing) > 1e-6) {
                EXPECT_EQ(points.side[k] < 0.0f, facing < 0.0);
            }
            const glm::dvec3 u = glm::clamp(voxel - glm::dvec3(cell), 0.0, 1.0);
            const glm::dvec3 gradient = sdf::smooth_gradient(*grid_, cell, u);
            const glm::dvec3 stored(points.gradient_x[k], points.gradient_y[k], points.gradient_z[k]);
            EXPECT_LT(glm::length(stored - gradient), 1.01 * std::sqrt(3.0) * 0.5 * sdf::kGradientStep);
        }
    }
}

}  // namespace
}  // namespace tests
