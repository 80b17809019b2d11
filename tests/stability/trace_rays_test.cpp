// Cases 16 to 19: rays that run in faces and edges of the lattice, through the joints of bricks, and along
// surfaces.
#include <cmath>

#include "sdf/baker.h"
#include "tests/stability/hard_case.h"

namespace tests {
namespace {

/// Rays with one or two components of zero, of either sign, that run in faces and edges of cells. `half`:
/// voxels from the centre, a lattice point, that they reach.
core::RayStream lattice_rays(double h, int half) {
    std::vector<core::Ray> rays;
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-1.0, 1.0}) {
            for (const double slope : {0.0, -0.0, 1.0, -1.0, 0.5}) {
                for (int i = -half; i <= half; ++i) {
                    for (const double j : {-7.0, -1.0, 0.0, 0.5, 3.0, 7.0}) {
                        glm::dvec3 origin(0.0), direction(0.0);
                        origin[axis] = -2.0 * half * h * side;
                        direction[axis] = side;
                        origin[(axis + 1) % 3] = (i - 2.0 * half * slope) * h;
                        direction[(axis + 1) % 3] = slope;
                        origin[(axis + 2) % 3] = j * h;
                        direction[(axis + 2) % 3] = side * 0.0;
                        core::Ray ray = make_ray(origin, direction);
                        // Normalising loses the sign of a zero in no case, but may turn diagonals by an ulp.
                        ray.direction = glm::vec3(glm::normalize(direction));
                        rays.push_back(ray);
                    }
                }
            }
        }
    }
    return stream_of(rays);
}

TEST(Case16, RaysInVoxelFacesAndEdgesAnswerLikeR) {
    // Voxels are powers of two and the centre is a lattice point: these rays lie in faces and edges to the
    // last bit. The box's own faces lie on samples.
    for (const core::Mesh& mesh : {icosphere(4), box(glm::vec3(1.0f)), torus(0.75f, 0.25f, 48, 24)}) {
        const BakedScene baked(scene_of(mesh), 32);
        ASSERT_EQ(baked.voxel(), 1.0 / 16);
        const core::RayStream rays = lattice_rays(baked.voxel(), 16);
        expect_agreement(baked, rays);
        const glm::dvec3 cells = baked.grid().traced_voxels().extent();
        const double cap = 2.0 * (cells.x + cells.y + cells.z) + 256.0;
        for_each_way([&](const Way& way) {
            const core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
            for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_LT(hits.steps[i], cap) << way;
        });
        for (const Reference& reference : references_of(baked, rays)) ASSERT_FALSE(reference.is_exhausted());
    }
}

/// A place on a face, an edge or a corner between blocks, near `point`.
glm::dvec3 block_joint(const glm::dvec3& point, int snapped_axes, TestRandom& random) {
    glm::dvec3 joint = point;
    const auto first = static_cast<int>(random.bits() % 3);
    for (int i = 0; i < snapped_axes; ++i) {
        const int axis = (first + i) % 3;
        joint[axis] = sdf::kBrickCells * std::round(point[axis] / sdf::kBrickCells);
    }
    return joint;
}

/// From inside a shape, through joints of bricks on its surface.
core::RayStream joint_rays(const BakedScene& baked, bool is_torus, std::uint32_t seed, int count) {
    TestRandom random(seed);
    const sdf::BrickGrid& grid = baked.grid();
    std::vector<core::Ray> rays;
    while (static_cast<int>(rays.size()) < count) {
        glm::dvec3 inside, surface;
        if (is_torus) {
            const double angle = random.uniform(0.0, 6.28), small = random.uniform(0.0, 6.28);
            const glm::dvec3 out(std::cos(angle), 0.0, std::sin(angle));
            surface = 1.0 * out + 0.4 * (std::cos(small) * out + std::sin(small) * glm::dvec3(0, 1, 0));
            const double other = angle + random.uniform(-0.5, 0.5);
            inside = glm::dvec3(std::cos(other), 0.0, std::sin(other)) + 0.2 * random.direction();
        } else {
            surface = random.direction();
            inside = 0.8 * std::cbrt(random.uniform()) * random.direction();
        }
        const glm::dvec3 voxel = (surface - grid.origin()) / grid.voxel_size();
        const int snapped_axes = 1 + static_cast<int>(random.bits() % 3);
        const glm::dvec3 target =
            grid.origin() + grid.voxel_size() * block_joint(voxel, snapped_axes, random);
        if (glm::distance(target, surface) > 4.0 * grid.voxel_size()) continue;
        rays.push_back(make_ray(inside, target - inside));
    }
    return stream_of(rays);
}

TEST(Case17, RaysThroughBrickEdgesOfAClosedShapeHit) {
    for (const bool is_torus : {false, true}) {
        const BakedScene baked(scene_of(is_torus ? torus(1.0f, 0.4f, 96, 48) : icosphere(4)), 48);
        const int total = ray_count(40'000, 5'000'000);
        std::size_t misses[3] = {}, scalar_misses = 0, exhausted = 0;
        for_each_part(total, [&](std::uint32_t seed, int count) {
            const core::RayStream rays = joint_rays(baked, is_torus, seed, count);
            for (const Reference& reference : references_of(baked, rays)) scalar_misses += !reference.hit();
            for_each_way([&](const Way& way) {
                const core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
                for (std::size_t i = 0; i < rays.size(); ++i) {
                    misses[static_cast<int>(way.mode)] += hits.status[i] != core::HitStatus::kHit;
                    exhausted += hits.status[i] == core::HitStatus::kExhausted;
                }
            });
        });
        EXPECT_EQ(scalar_misses, 0u);
        EXPECT_EQ(exhausted, 0u);
        // The kernels carry the sign along, so that no mode may miss; 2e-5 were allowed for eps.
        for (const std::size_t missed : misses) EXPECT_EQ(missed, 0u) << "of " << total;
    }
}

TEST(Case18, GrazingRaysAgreeWithR) {
    // Lines that pass the centre of a sphere at r (1 +- delta).
    const BakedScene baked(scene_of(icosphere(5)), 64);
    for (int exponent = 1; exponent <= 6; ++exponent) {
        const double delta = std::pow(10.0, -exponent);
        for_each_part(ray_count(12'000, 1'000'000), [&](std::uint32_t seed, int count) {
            TestRandom random(seed);
            std::vector<core::Ray> rays;
            for (int i = 0; i < count; ++i) {
                const glm::dvec3 normal = random.direction();
                const glm::dvec3 direction = glm::normalize(glm::cross(normal, random.direction()));
                const glm::dvec3 touch = (1.0 + (i % 2 ? delta : -delta)) * normal;
                rays.push_back(make_ray(touch - random.uniform(0.0, 3.0) * direction, direction));
            }
            SCOPED_TRACE(delta);
            expect_agreement(baked, stream_of(rays));
        });
    }
}

/// Along the top of a slab 1,000 voxels long, at `height` voxels over it.
core::RayStream skimming_rays(double h, double height, int count) {
    TestRandom random(5);
    std::vector<core::Ray> rays;
    for (int i = 0; i < count; ++i) {
        const bool reverse = i % 2;
        // Inclined by at most the height over the length, on either side.
        const double rise = i % 4 < 2 ? 0.0 : random.uniform(-2.0, 2.0) * height * h / 1000.0;
        const glm::dvec3 origin((reverse ? 1.0 : -1.0) * 510.0 * h, (8.0 + height) * h,
                                random.uniform(-7.0, 7.0) * h);
        rays.push_back(
            make_ray(origin, {reverse ? -1.0 : 1.0, rise, i % 8 < 4 ? 0.0 : random.uniform(-1e-3, 1e-3)}));
    }
    return stream_of(rays);
}

TEST(Case19, APlaneSkimmedOverAThousandVoxelsHasADefinedStatus) {
    const BakedScene baked(scene_of(box({500.0f, 8.0f, 8.0f})), 1000);
    ASSERT_NEAR(baked.voxel(), 1.0, 1e-12);
    for (const double height : {0.01, -0.01, 1e-4, 0.05, 0.2}) {
        SCOPED_TRACE(height);
        expect_agreement(baked, skimming_rays(baked.voxel(), height, ray_count(400, 20'000)));
    }
    // Turned, so that the plane crosses the lattice.
    const glm::dmat4 turn = rotation(0.3, {1, 2, 3});
    const BakedScene turned(scene_of(moved(box({250.0f, 8.0f, 8.0f}), turn)), 400);
    core::RayStream rays = skimming_rays(turned.voxel(), 0.01, 400);
    std::vector<core::Ray> moved_rays;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Ray ray = rays.get(i);
        const glm::dvec3 direction = glm::dmat3(turn) * glm::dvec3(ray.direction);
        const double start = 260.0 / std::abs(double(ray.direction.x));
        const glm::dvec3 touch(0.0, 8.0 + 0.01 * turned.voxel(), 0.0);
        moved_rays.push_back(make_ray(glm::dmat3(turn) * touch - start * direction, direction));
    }
    expect_agreement(turned, stream_of(moved_rays));
}

}  // namespace
}  // namespace tests
