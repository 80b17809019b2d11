// Cases 30, 34 and 35: many rays: in any order, on any instruction set, with either query, out of sealed
// rooms.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "sdf/field_kernel.h"
#include "tests/stability/hard_case.h"

namespace tests {
namespace {

/// Solids, a sheet, a thin wall and a holed ball under transforms of all kinds.
core::Scene crowd() {
    core::Scene scene;
    add_material(scene, lambert(glm::vec3(0.5f)));
    const std::uint32_t ball = add_mesh(scene, icosphere(3)),
                        ring = add_mesh(scene, torus(1.0f, 0.35f, 48, 24)),
                        sheet = add_mesh(scene, moved(quad(2.0f, 2.0f, 3, 3), rotation(0.4, {1, 2, 3}))),
                        wall = add_mesh(scene, moved(box({1.0f, 1.0f, 0.004f}), rotation(0.7, {3, 1, 2})));
    core::Mesh bowl = icosphere(3);
    std::erase_if(bowl.triangles,
                  [&](const glm::uvec3& corner) { return bowl.positions[corner.x].y > 0.7f; });
    const std::uint32_t holed =
        add_mesh(scene, make_mesh("bowl", bowl.positions, bowl.normals, {}, bowl.triangles));
    glm::dmat4 shear(1.0);
    shear[1][0] = 0.7;
    add_instance(scene, ball);
    add_instance(scene, ball, translation({2.5, 0.2, 0.1}) * scaling({-1.0, 0.5, 1.5}));
    add_instance(scene, ring, translation({0.1, -2.0, 0.0}) * rotation(0.4, {1, 0, 0}));
    add_instance(scene, ring, translation({0.3, 0.4, 0.2}) * shear);
    add_instance(scene, sheet, translation({-2.0, 0.5, 0.3}) * scaling({1, 2, 0.7}));
    add_instance(scene, wall, translation({0.3, 2.2, -0.4}) * shear);
    add_instance(scene, holed, translation({0.0, 0.3, 2.5}) * scaling({0.8, 0.8, -0.8}));
    return scene;
}

bool same(const core::Hit& a, const core::Hit& b) {
    if (a.status != b.status || a.steps != b.steps) return false;
    return !a.hit() || (std::memcmp(&a.t, &b.t, sizeof(a.t)) == 0 && a.normal == b.normal &&
                        a.instance == b.instance && a.triangle == b.triangle &&
                        a.barycentrics == b.barycentrics && a.front == b.front && a.offset == b.offset);
}

TEST(Case30, ShuffledLanesGiveTheSameBits) {
    const BakedScene baked(crowd(), 40);
    for_each_part(ray_count(20'000, 300'000), [&](std::uint32_t seed, int count) {
        const core::RayStream rays =
            random_lines(glm::dvec3(0.0), 4.0, static_cast<std::size_t>(count), seed);
        std::vector<std::size_t> order(rays.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        TestRandom random(seed);
        for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
        core::RayStream shuffled = rays;
        for (std::size_t i = 0; i < order.size(); ++i) shuffled.set(i, rays.get(order[i]));
        for_each_way([&](const Way& way) {
            const core::HitStream a = trace_both(baked.tracer(way.mode), rays),
                                  b = trace_both(baked.tracer(way.mode), shuffled);
            std::size_t different = 0, hits = 0;
            for (std::size_t i = 0; i < order.size(); ++i) {
                different += !same(a.get(order[i]), b.get(i));
                hits += b.get(i).hit();
            }
            EXPECT_EQ(different, 0u) << way;
            EXPECT_GT(hits, rays.size() / 10);
        });
    });
}

TEST(Case30, InstructionSetsGiveTheSameBits) {
    const BakedScene baked(crowd(), 40);
    EXPECT_GT(sdf::kernel_targets().size(), 1u) << "nothing to compare";
    for_each_part(ray_count(60'000, 2'000'000), [&](std::uint32_t seed, int count) {
        const core::RayStream rays =
            random_lines(glm::dvec3(0.0), 4.0, static_cast<std::size_t>(count), seed);
        core::HitStream first[3];
        for_each_way([&](const Way& way) {
            core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
            core::HitStream& expected = first[static_cast<int>(way.mode)];
            if (expected.size() == 0) expected = hits;
            std::size_t different = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) different += !same(hits.get(i), expected.get(i));
            EXPECT_EQ(different, 0u) << way;
        });
    });
}

TEST(Case34, AnyHitEqualsClosestHit) {
    // trace_both() compares. Rays that begin and end anywhere.
    const BakedScene baked(crowd(), 40);
    for_each_part(ray_count(60'000, 10'000'000), [&](std::uint32_t seed, int count) {
        TestRandom random(seed);
        std::vector<core::Ray> rays;
        for (int i = 0; i < count; ++i) {
            const glm::dvec3 origin = 4.0 * std::cbrt(random.uniform()) * random.direction();
            core::Ray ray = make_ray(origin, random.direction(), static_cast<float>(random.uniform(0.0, 6.0)),
                                     random.bits());
            if (i % 4 == 0) ray.t_min = static_cast<float>(random.uniform(0.0, 2.0));
            rays.push_back(ray);
        }
        const core::RayStream stream = stream_of(rays);
        for_each_way([&](const Way& way) {
            SCOPED_TRACE(testing::Message() << way);
            trace_both(baked.tracer(way.mode), stream);
        });
    });
}

TEST(Case35, NoRayLeavesASealedRoom) {
    // Rooms of 24 voxels, turned, with walls of `thickness` voxels. The thin ones are held by triangles.
    for (const double thickness : {0.3, 0.6, 1.0, 1.5, 2.0, 3.0}) {
        const double h = 1.0 / 24.0, inner = 0.5 - thickness * h;
        const core::Mesh room =
            merged(box(glm::vec3(0.5f)), reversed(box(glm::vec3(static_cast<float>(inner)))));
        const glm::dmat4 turn = rotation(0.6, {2, 1, 3});
        const core::Mesh turned = moved(room, turn);
        const glm::vec3 extent = turned.bounds.extent();
        const int resolution = static_cast<int>(std::round(std::max({extent.x, extent.y, extent.z}) / h));
        for (const bool is_turned : {false, true}) {
            const BakedScene baked(scene_of(is_turned ? turned : room), is_turned ? resolution : 24);
            for_each_part(ray_count(12'000, 800'000), [&](std::uint32_t seed, int count) {
                TestRandom random(seed);
                std::vector<core::Ray> rays;
                for (int i = 0; i < count; ++i) {
                    // The field's edges are round by a fraction of a voxel: nearer a wall than that a ray may
                    // start within it.
                    const double reach = inner - 0.5 * h;
                    glm::dvec3 origin(random.uniform(-reach, reach), random.uniform(-reach, reach),
                                      random.uniform(-reach, reach));
                    glm::dvec3 direction = random.direction();
                    if (i % 2) {
                        // Into edges and corners of the room.
                        glm::dvec3 target(random.uniform(-inner, inner));
                        for (int axis = 0; axis < 3; ++axis) {
                            target[axis] = (random.bits() % 2 ? 1.0 : -1.0) *
                                           (random.bits() % 3 ? inner : random.uniform(0.0, inner));
                        }
                        direction = target - origin;
                    }
                    if (is_turned) {
                        origin = glm::dvec3(turn * glm::dvec4(origin, 1.0));
                        direction = glm::dmat3(turn) * direction;
                    }
                    rays.push_back(make_ray(origin, direction));
                }
                const core::RayStream stream = stream_of(rays);
                for_each_way([&](const Way& way) {
                    const core::HitStream hits = trace_both(baked.tracer(way.mode), stream);
                    std::size_t escapes = 0, far = 0;
                    double farthest = 0.0;
                    for (std::size_t i = 0; i < rays.size(); ++i) {
                        const core::Hit hit = hits.get(i);
                        escapes += !hit.hit();
                        if (!hit.hit()) continue;
                        const glm::dvec3 world =
                            glm::dvec3(rays[i].origin) + double(hit.t) * glm::dvec3(rays[i].direction);
                        const glm::dvec3 point = is_turned ? glm::transpose(glm::dmat3(turn)) * world : world;
                        const double off =
                            std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)}) - inner;
                        farthest = std::max(farthest, off / h);
                        // Half a wall's way out is through it.
                        far += off > 0.5 * thickness * h;
                    }
                    // A ray that cuts the corner of a wall within one cell has no change of sign over it.
                    const std::size_t allowed = way.is_cubic() ? 0 : rays.size() / 2000;
                    EXPECT_LE(escapes, allowed)
                        << way << ", thickness " << thickness << (is_turned ? ", turned" : "");
                    if (escapes > 0 && std::getenv("FIELDLIGHT_FIGURES")) {
                        std::cerr << way << ", thickness " << thickness << ": " << escapes << " escapes of "
                                  << rays.size() << "\n";
                    }
                    // In a room's edge one secant of eps may end that far off.
                    const std::size_t allowed_far =
                        way.mode == sdf::HitMode::kEps ? rays.size() / 20'000 : allowed;
                    EXPECT_LE(far, allowed_far)
                        << way << ", thickness " << thickness << (is_turned ? ", turned" : "")
                        << ", farthest " << farthest << " voxels";
                });
            });
        }
    }
}

}  // namespace
}  // namespace tests
