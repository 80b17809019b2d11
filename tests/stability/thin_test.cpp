// Cases 5 and 6: surfaces without thickness and walls thinner than the voxels.
#include <algorithm>
#include <cmath>

#include "sdf/field_kernel.h"
#include "tests/sdf/baked_shapes.h"
#include "tests/stability/hard_case.h"

namespace tests {
namespace {

/// The point that a hit names on its stored triangle.
glm::dvec3 stored_point(const core::Mesh& mesh, const core::Hit& hit) {
    const glm::uvec3& corner = mesh.triangles[hit.triangle];
    const glm::dvec3 a(mesh.positions[corner.x]), b(mesh.positions[corner.y]), c(mesh.positions[corner.z]);
    return a + double(hit.barycentrics.x) * (b - a) + double(hit.barycentrics.y) * (c - a);
}

glm::dvec3 point_along(const core::Ray& ray, double t) {
    return glm::dvec3(ray.origin) + t * glm::dvec3(ray.direction);
}

TEST(Case05, AQuadIsHitFromBothSidesAnywhereInsideItsBorder) {
    TestRandom turns(11);
    const int turn_count = ray_count(3, 8);
    for (int turn = 0; turn < turn_count; ++turn) {
        const glm::dmat4 matrix =
            turn == 0 ? glm::dmat4(1.0) : rotation(turns.uniform(0.0, 3.0), turns.direction());
        const BakedScene baked(scene_of(moved(quad(1.0f, 1.0f), matrix)), 32);
        const double h = baked.voxel();
        const glm::dvec3 normal(matrix[2]);
        for_each_part(ray_count(20'000, 125'000), [&](std::uint32_t seed, int count) {
            TestRandom random(seed);
            std::vector<core::Ray> rays;
            for (int i = 0; i < count; ++i) {
                const double inside = 0.5 - h;
                const glm::dvec3 target(matrix * glm::dvec4(random.uniform(-inside, inside),
                                                            random.uniform(-inside, inside), 0.0, 1.0));
                const glm::dvec3 origin = target + random.uniform(0.001, 2.0) * random.direction();
                rays.push_back(make_ray(origin, target - origin));
            }
            const core::RayStream stream = stream_of(rays);
            for_each_way([&](const Way& way) {
                const core::HitStream hits = trace_both(baked.tracer(way.mode), stream);
                std::size_t misses = 0, wrong_side = 0;
                double worst = 0.0;
                for (std::size_t i = 0; i < rays.size(); ++i) {
                    const core::Hit hit = hits.get(i);
                    misses += !hit.hit();
                    if (!hit.hit()) continue;
                    wrong_side += hit.front != (glm::dot(normal, glm::dvec3(rays[i].direction)) < 0.0);
                    worst = std::max(worst,
                                     std::abs(glm::dot(normal, stored_point(baked.scene().meshes[0], hit))));
                    worst = std::max(worst, std::abs(glm::dot(normal, point_along(rays[i], hit.t))));
                }
                EXPECT_EQ(misses, 0u) << way << ", turn " << turn;
                EXPECT_EQ(wrong_side, 0u) << way << ", turn " << turn;
                EXPECT_LE(worst, 0.1 * h) << way << ", turn " << turn;
            });
        });
    }
}

TEST(Case06, SlabsOfAnyThicknessStopEveryRay) {
    // 20 thicknesses from 0.02 to 3 voxels; a slab of 24 x 24 voxels.
    constexpr int kSide = 24;
    const double h = 1.0 / kSide;
    TestRandom turns(12);
    const int turn_count = ray_count(3, 50);
    std::size_t passed[3] = {}, count = 0;
    double worst_raw = 0.0, worst_shading = 0.0, worst_thick = 0.0;
    for (int step = 0; step < 20; ++step) {
        const double thickness = 0.02 * std::pow(150.0, step / 19.0);
        for (int turn = 0; turn < turn_count; ++turn) {
            const glm::dmat4 matrix =
                turn == 0 ? glm::dmat4(1.0) : rotation(turns.uniform(0.0, 3.0), turns.direction());
            const float half = static_cast<float>(0.5 * thickness * h);
            const core::Mesh mesh = moved(box({0.5f, 0.5f, half}), matrix);
            const glm::vec3 extent = mesh.bounds.extent();
            const double longest = std::max({extent.x, extent.y, extent.z});
            const BakedScene baked(scene_of(mesh), static_cast<int>(std::round(longest / h)));
            TestRandom random(static_cast<std::uint32_t>(100 * step + turn));
            std::vector<core::Ray> rays;
            for (int i = 0; i < ray_count(400, 2'000); ++i) {
                // Through the large faces, well away from the rim.
                glm::dvec3 direction = random.direction();
                if (std::abs(direction.z) < 0.3) direction.z = std::copysign(0.3, direction.z);
                const glm::dvec3 target(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 0.0);
                rays.push_back(make_ray(glm::dmat3(matrix) * (target - 2.0 * direction),
                                        glm::dmat3(matrix) * direction));
            }
            const core::RayStream stream = stream_of(rays);
            count += rays.size();
            for_each_way([&](const Way& way) {
                const core::HitStream hits = trace_both(baked.tracer(way.mode), stream);
                for (std::size_t i = 0; i < rays.size(); ++i) {
                    const core::Hit hit = hits.get(i);
                    passed[static_cast<int>(way.mode)] += !hit.hit();
                    if (!hit.hit() && std::getenv("FIELDLIGHT_FIGURES")) {
                        std::cerr << way << " passes " << thickness << " voxels\n";
                    }
                    if (!hit.hit() || !way.is_cubic()) continue;
                    const glm::dvec3 raw = glm::transpose(glm::dmat3(matrix)) * point_along(rays[i], hit.t);
                    const glm::dvec3 shading = glm::transpose(glm::dmat3(matrix)) * stored_point(mesh, hit);
                    worst_raw = std::max(worst_raw, std::abs(std::abs(raw.z) - double(half)) / h);
                    const double off = std::abs(std::abs(shading.z) - double(half)) / h;
                    // Seen from the ray: the near face and no other.
                    const double near_side =
                        raw.z * (glm::transpose(glm::dmat3(matrix)) * glm::dvec3(rays[i].origin)).z;
                    EXPECT_GT(near_side, 0.0) << way << ", thickness " << thickness;
                    (thickness > 2.0 ? worst_thick : worst_shading) =
                        std::max(thickness > 2.0 ? worst_thick : worst_shading, off);
                }
            });
        }
    }
    // Walls of about a voxel, too thick for a shell: a ray that enters and leaves one within a cell has no
    // change of sign over it, which is all that secant and eps look for.
    const std::size_t traced = count * sdf::kernel_targets().size();
    EXPECT_EQ(passed[static_cast<int>(sdf::HitMode::kCubic)], 0u) << "of " << traced;
    EXPECT_LE(passed[static_cast<int>(sdf::HitMode::kSecant)], traced / 1000) << "of " << traced;
    EXPECT_LE(passed[static_cast<int>(sdf::HitMode::kEps)], traced / 5000) << "of " << traced;
    EXPECT_LE(worst_raw, sdf::kHalfThicknessVoxels + 0.25);
    EXPECT_LE(worst_shading, 0.1);
    EXPECT_LE(worst_thick, 0.15);
    if (std::getenv("FIELDLIGHT_FIGURES")) {
        std::cerr << "raw " << worst_raw << ", shading " << worst_shading << ", thick " << worst_thick
                  << "\n";
    }
}

}  // namespace
}  // namespace tests
