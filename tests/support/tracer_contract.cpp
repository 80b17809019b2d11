#include "tests/support/tracer_contract.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "tests/support/analytic_scenes.h"

namespace tests {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Interval {
    double first = 0.0;
    double second = 0.0;
};

std::optional<Interval> sphere_crossing(const LocalRay& ray, double radius) {
    const double a = glm::dot(ray.direction, ray.direction), b = glm::dot(ray.origin, ray.direction);
    const glm::dvec3 closest = ray.origin - (b / a) * ray.direction;
    const double squared = radius * radius - glm::dot(closest, closest);
    if (squared < 0.0) return std::nullopt;
    const double half = std::sqrt(squared / a);
    return Interval{-b / a - half, -b / a + half};
}

/// Rays from outside a sphere about an instance's origin to points well inside its image.
core::RayStream rays_at_ball(const core::Instance& instance, int count, double aim_radius,
                             std::uint32_t seed) {
    TestRandom random(seed);
    std::vector<core::Ray> rays;
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 from = random.uniform(1.5, 6.0) * random.direction();
        const glm::dvec3 to = aim_radius * std::cbrt(random.uniform()) * random.direction();
        const auto world = [&](const glm::dvec3& p) {
            return glm::dvec3(instance.world_from_local * glm::dvec4(p, 1.0));
        };
        rays.push_back(make_ray(world(from), world(to) - world(from)));
    }
    return stream_of(rays);
}

/// Several shapes under several transforms, mirrored, stretched and sheared ones among them.
core::Scene crowded_scene() {
    core::Scene scene;
    scene.name = "crowd";
    add_material(scene, lambert(glm::vec3(0.5f)));
    const std::uint32_t ball = add_mesh(scene, icosphere(3));
    const std::uint32_t block = add_mesh(scene, box({0.5f, 0.4f, 0.6f}));
    const std::uint32_t ring = add_mesh(scene, torus(1.0f, 0.35f, 48, 24));
    glm::dmat4 shear(1.0);
    shear[1][0] = 0.7;
    add_instance(scene, ball);
    add_instance(scene, ball, translation({2.5, 0.2, 0.1}) * scaling({-1.0, 0.5, 1.5}));
    add_instance(scene, block,
                 translation({-2.0, 0.5, 0.3}) * rotation(0.7, {1, 2, 3}) * scaling({1, 2, 0.7}));
    add_instance(scene, block, translation({0.3, 2.2, -0.4}) * shear);
    add_instance(scene, ring, translation({0.1, -2.0, 0.0}) * rotation(0.4, {1, 0, 0}));
    add_instance(scene, ring, translation({0.0, 0.3, 2.5}) * scaling({0.8, 0.8, -0.8}));
    return scene;
}

void expect_same(const core::Hit& a, const core::Hit& b, bool bitwise, std::size_t ray) {
    ASSERT_EQ(a.status, b.status) << "ray " << ray;
    if (!a.hit()) return;
    if (bitwise) {
        EXPECT_EQ(a.t, b.t) << "ray " << ray;
        EXPECT_EQ(a.instance, b.instance) << "ray " << ray;
        EXPECT_EQ(a.triangle, b.triangle) << "ray " << ray;
        EXPECT_EQ(a.normal, b.normal) << "ray " << ray;
        EXPECT_EQ(a.barycentrics, b.barycentrics) << "ray " << ray;
    } else {
        // Kernels for other packet shapes add up in another order: some ulp of coordinates up to 6.
        EXPECT_NEAR(a.t, b.t, 2e-5) << "ray " << ray;
    }
}

}  // namespace

// In the other half of the suite; naming it makes the linker keep that half.
bool surface_contract_is_linked();

::testing::internal::ParamGenerator<TracerFactory> contract_of(std::vector<TracerFactory> factories) {
    static_cast<void>(surface_contract_is_linked());
    return ::testing::ValuesIn(factories);
}

std::string factory_name(const ::testing::TestParamInfo<TracerFactory>& info) {
    return info.param.name;
}

LocalRay to_local(const core::Instance& instance, const core::Ray& ray) {
    return {glm::dvec3(instance.local_from_world * glm::dvec4(glm::dvec3(ray.origin), 1.0)),
            glm::dmat3(instance.local_from_world) * glm::dvec3(ray.direction)};
}

double TracerContract::allowed(const core::Mesh& mesh, double magnitude) const {
    const glm::vec3 extent = mesh.bounds.extent();
    const double longest = std::max({extent.x, extent.y, extent.z});
    return factory().position_tolerance * longest + 8.0 * 0x1p-23 * std::max(magnitude, longest);
}

core::HitStream TracerContract::trace(const core::Tracer& tracer, const core::RayStream& rays) const {
    core::HitStream hits;
    tracer.trace_closest(rays, hits);
    EXPECT_EQ(hits.size(), rays.size());
    std::vector<std::uint8_t> occluded(rays.size(), 2);
    tracer.trace_occluded(rays, occluded);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        EXPECT_EQ(int(occluded[i]), hits.get(i).hit() ? 1 : 0) << "the two queries disagree on ray " << i;
    }
    return hits;
}

void TracerContract::expect_hit(const core::Scene& scene, const core::Ray& ray, const core::Hit& hit,
                                std::uint32_t instance, double t_low, double t_high,
                                const glm::dvec3& local_normal, double curvature_degrees) const {
    ASSERT_TRUE(hit.hit());
    const core::Instance& placed = scene.instances[instance];
    EXPECT_EQ(hit.instance, instance);
    const LocalRay local = to_local(placed, ray);
    const double slope = std::abs(glm::dot(local_normal, local.direction));
    const double reach = glm::length(local.origin) + double(hit.t) * glm::length(local.direction) +
                         glm::length(glm::dvec3(placed.local_from_world[3]));
    const double slack = allowed(scene.meshes[placed.mesh], reach) / slope;
    EXPECT_GE(hit.t, t_low - slack);
    EXPECT_LE(hit.t, t_high + slack);
    EXPECT_GE(hit.t, ray.t_min);
    EXPECT_LE(hit.t, ray.t_max);

    glm::dvec3 normal = glm::normalize(glm::transpose(glm::dmat3(placed.local_from_world)) * local_normal);
    const bool front = glm::dot(normal, glm::dvec3(ray.direction)) < 0.0;
    EXPECT_EQ(hit.front, front);
    if (!front) normal = -normal;
    EXPECT_NEAR(glm::length(hit.normal), 1.0f, 1e-5f);
    // A normal computed by rounding at grazing angles may lie an ulp on the other side.
    EXPECT_LE(glm::dot(hit.normal, ray.direction), 1e-6f);
    const double degrees =
        glm::degrees(std::acos(std::clamp(glm::dot(normal, glm::dvec3(hit.normal)), -1.0, 1.0)));
    EXPECT_LE(degrees, factory().normal_tolerance_degrees + curvature_degrees);
    EXPECT_TRUE(std::isfinite(hit.offset) && hit.offset > 0.0f);
}

TEST_P(TracerContract, HitsASphereAtTheAnalyticDistanceFromOutsideAndInside) {
    // The stretched normal of an ellipsoid differs by more than the facet's own angle; twice the ratio of its
    // axes bounds it.
    const double inner = icosphere_inner_radius(5);
    const double facet_degrees = glm::degrees(std::acos(inner));
    const std::vector<std::pair<glm::dmat4, double>> cases = {
        {glm::dmat4(1.0), 1.0},
        {translation({3, -2, 1}) * rotation(1.0, {1, 1, 0}) * scaling({1.0, 2.0, 0.5}), 8.0},
        {translation({3, -2, 1}) * scaling({-1.0, 1.0, 1.0}), 1.0},
        {translation({-30, 2, 1}) * scaling({10.0, 10.0, -10.0}), 1.0},
    };
    for (const auto& [matrix, stretch] : cases) {
        const core::Scene scene = scene_of(icosphere(5), matrix);
        const auto tracer = make(scene);
        for (const double aim : {0.9, 0.0}) {
            core::RayStream rays = rays_at_ball(scene.instances[0], 500, aim, 7);
            const core::HitStream from_outside = trace(*tracer, rays);
            core::RayStream inside = rays;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const core::Ray ray = rays.get(i);
                const LocalRay local = to_local(scene.instances[0], ray);
                const auto outer_crossing = sphere_crossing(local, 1.0);
                const auto inner_crossing = sphere_crossing(local, inner);
                ASSERT_TRUE(outer_crossing && inner_crossing);
                const glm::dvec3 normal =
                    glm::normalize(local.origin + outer_crossing->first * local.direction);
                expect_hit(scene, ray, from_outside.get(i), 0, outer_crossing->first, inner_crossing->first,
                           normal, facet_degrees * stretch * 2.0);
                core::Ray from_within = ray;
                const double middle = 0.5 * (outer_crossing->first + outer_crossing->second);
                from_within.origin = glm::vec3(glm::dvec3(ray.origin) + middle * glm::dvec3(ray.direction));
                inside.set(i, from_within);
            }
            const core::HitStream from_inside = trace(*tracer, inside);
            for (std::size_t i = 0; i < inside.size(); ++i) {
                const core::Ray ray = inside.get(i);
                const LocalRay local = to_local(scene.instances[0], ray);
                const double far = sphere_crossing(local, 1.0)->second;
                const double near = sphere_crossing(local, inner)->second;
                expect_hit(scene, ray, from_inside.get(i), 0, near, far,
                           glm::normalize(local.origin + far * local.direction),
                           facet_degrees * stretch * 2.0);
                // Single-sided materials are seen from behind all the same.
                EXPECT_FALSE(from_inside.get(i).front);
            }
            if (HasFailure()) return;
        }
    }
}

TEST_P(TracerContract, HitsABoxAtTheAnalyticDistanceWithTheFaceNormal) {
    const glm::dvec3 half(0.5, 0.4, 0.3);
    const double margin = factory().edge_margin * 1.0 + 1e-3;
    for (const glm::dmat4& matrix :
         {glm::dmat4(1.0), translation({5, 1, -2}) * rotation(0.5, {3, 1, 2}) * scaling({-2.0, 1.0, 0.4})}) {
        const core::Scene scene = scene_of(box(glm::vec3(half)), matrix);
        const auto tracer = make(scene);
        TestRandom random(11);
        std::vector<core::Ray> rays;
        std::vector<glm::dvec3> normals, targets;
        for (int i = 0; i < 1500; ++i) {
            const int axis = i % 3;
            const double side = i % 2 ? 1.0 : -1.0;
            glm::dvec3 target, normal(0.0);
            for (int k = 0; k < 3; ++k) target[k] = random.uniform(margin - half[k], half[k] - margin);
            target[axis] = side * half[axis];
            normal[axis] = side;
            glm::dvec3 direction = random.direction();
            if (glm::dot(direction, normal) < 0.0) direction = -direction;
            if (glm::dot(direction, normal) < 0.1) direction += normal;
            const glm::dvec3 from = target + random.uniform(0.5, 4.0) * direction;
            const glm::dvec3 world_from(matrix * glm::dvec4(from, 1.0));
            rays.push_back(make_ray(world_from, glm::dvec3(matrix * glm::dvec4(target, 1.0)) - world_from));
            normals.push_back(normal);
            targets.push_back(target);
        }
        const core::RayStream stream = stream_of(rays);
        const core::HitStream hits = trace(*tracer, stream);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const LocalRay local = to_local(scene.instances[0], rays[i]);
            const double t =
                glm::dot(targets[i] - local.origin, normals[i]) / glm::dot(local.direction, normals[i]);
            expect_hit(scene, rays[i], hits.get(i), 0, t, t, normals[i]);
            if (HasFailure()) FAIL() << "ray " << i;
        }
    }
}

TEST_P(TracerContract, BarycentricsOfTheHitTriangleReproduceThePosition) {
    const core::Scene scene = crowded_scene();
    const auto tracer = make(scene);
    const core::RayStream rays = random_lines(glm::dvec3(0.0), 4.0, 4000, 3);
    const core::HitStream hits = trace(*tracer, rays);
    int hit_count = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Hit hit = hits.get(i);
        if (!hit.hit()) continue;
        ++hit_count;
        ASSERT_LT(hit.instance, scene.instances.size());
        const core::Instance& placed = scene.instances[hit.instance];
        const core::Mesh& mesh = scene.meshes[placed.mesh];
        ASSERT_LT(hit.triangle, mesh.triangles.size());
        const glm::vec2 b = hit.barycentrics;
        ASSERT_TRUE(b.x >= -1e-5f && b.y >= -1e-5f && b.x + b.y <= 1.0f + 1e-5f) << b.x << " " << b.y;
        const glm::uvec3& corner = mesh.triangles[hit.triangle];
        const glm::dvec3 stored = double(1.0f - b.x - b.y) * glm::dvec3(mesh.positions[corner.x]) +
                                  double(b.x) * glm::dvec3(mesh.positions[corner.y]) +
                                  double(b.y) * glm::dvec3(mesh.positions[corner.z]);
        const LocalRay local = to_local(placed, rays.get(i));
        const glm::dvec3 traced = local.origin + double(hit.t) * local.direction;
        // At edges a field rounds off by up to twice its error on flat parts. Rounding scales with 1 / n.d
        // along the ray, which 20 times the bound covers on all but grazing rays.
        EXPECT_LE(glm::distance(stored, traced), 20.0 * allowed(mesh, 16.0)) << "ray " << i;
    }
    EXPECT_GT(hit_count, 500);
}

TEST_P(TracerContract, HitsLieBetweenTMinAndTMax) {
    const core::Scene scene = scene_of(icosphere(4));
    const auto tracer = make(scene);
    const core::RayStream rays = rays_at_ball(scene.instances[0], 400, 0.8, 5);
    const core::HitStream hits = trace(*tracer, rays);
    // More than the tracer's error along the ray: |n.d| >= 0.6 for aims within 0.8.
    const float margin = static_cast<float>(4.0 * allowed(scene.meshes[0], 16.0));
    core::RayStream shortened = rays, exact = rays, lengthened = rays, late = rays;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(hits.get(i).hit());
        const float t = hits.t[i];
        shortened.t_max[i] = t - margin;
        exact.t_max[i] = t;
        lengthened.t_max[i] = t + margin;
        late.t_min[i] = t + margin;
    }
    const core::HitStream none = trace(*tracer, shortened), some = trace(*tracer, exact),
                          all = trace(*tracer, lengthened), far = trace(*tracer, late);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        EXPECT_FALSE(none.get(i).hit()) << "ray " << i;
        if (some.get(i).hit()) {
            EXPECT_LE(some.t[i], exact.t_max[i]) << "ray " << i;
        }
        ASSERT_TRUE(all.get(i).hit()) << "ray " << i;
        EXPECT_LE(all.t[i], lengthened.t_max[i]) << "ray " << i;
        // Past the near side only the far side is left, seen from inside.
        ASSERT_TRUE(far.get(i).hit()) << "ray " << i;
        EXPECT_GE(far.t[i], late.t_min[i]) << "ray " << i;
        EXPECT_FALSE(far.get(i).front) << "ray " << i;
    }
}

TEST_P(TracerContract, InvalidRaysMissAndLeaveTheOthersAlone) {
    const core::Scene scene = crowded_scene();
    const auto tracer = make(scene);
    const core::RayStream rays = random_lines(glm::dvec3(0.0), 3.0, 960, 17);
    const core::HitStream expected = trace(*tracer, rays);
    std::vector<core::Ray> broken;
    for (const float bad : {kNaN, kInfinity, -kInfinity}) {
        for (int axis = 0; axis < 3; ++axis) {
            core::Ray ray = rays.get(0);
            ray.origin[axis] = bad;
            broken.push_back(ray);
            ray = rays.get(0);
            ray.direction[axis] = bad;
            broken.push_back(ray);
        }
        core::Ray ray = rays.get(0);
        ray.t_min = bad;
        broken.push_back(ray);
    }
    core::Ray ray = rays.get(0);
    ray.t_max = kNaN;
    broken.push_back(ray);
    ray = rays.get(0);
    ray.direction = glm::vec3(0.0f);
    broken.push_back(ray);
    ray.direction = glm::vec3(1e-40f, 0.0f, 0.0f);
    broken.push_back(ray);
    ray = rays.get(0);
    ray.t_min = 2.0f;
    ray.t_max = 1.0f;
    broken.push_back(ray);

    core::RayStream mixed = rays;
    for (std::size_t i = 0; i < rays.size(); i += 3) mixed.set(i, broken[(i / 3) % broken.size()]);
    const core::HitStream hits = trace(*tracer, mixed);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (i % 3 == 0) {
            EXPECT_EQ(hits.status[i], core::HitStatus::kMiss) << "broken ray " << (i / 3) % broken.size();
        } else {
            expect_same(hits.get(i), expected.get(i), factory().independent_of_neighbours, i);
        }
    }
}

TEST_P(TracerContract, BothQueriesAgreeWhateverTMax) {
    const core::Scene scene = crowded_scene();
    const auto tracer = make(scene);
    core::RayStream rays = random_lines(glm::dvec3(0.0), 4.0, 20000, 23);
    TestRandom random(29);
    for (std::size_t i = 0; i < rays.size(); ++i) rays.t_max[i] = float(random.uniform(0.0, 8.0));
    trace(*tracer, rays);
}

TEST_P(TracerContract, StreamsOfAnyLengthGiveTheSameAnswers) {
    const core::Scene scene = crowded_scene();
    const auto tracer = make(scene);
    const core::RayStream all = random_lines(glm::dvec3(0.0), 3.0, 1000, 31);
    const core::HitStream expected = trace(*tracer, all);
    for (const std::size_t size : {0, 1, 7, 16, 17, 999}) {
        core::RayStream rays;
        rays.resize(size);
        for (std::size_t i = 0; i < size; ++i) rays.set(i, all.get(i));
        const core::HitStream hits = trace(*tracer, rays);
        ASSERT_EQ(hits.size(), size);
        for (std::size_t i = 0; i < size; ++i) {
            expect_same(hits.get(i), expected.get(i), factory().independent_of_neighbours, i);
        }
    }
}

TEST_P(TracerContract, TheSameStreamGivesTheSameBitsAgain) {
    const core::Scene scene = crowded_scene();
    const auto first = make(scene), second = make(scene);
    const core::RayStream rays = random_lines(glm::dvec3(0.0), 3.0, 3000, 37);
    const core::HitStream a = trace(*first, rays), b = trace(*first, rays), c = trace(*second, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        expect_same(a.get(i), b.get(i), true, i);
        expect_same(a.get(i), c.get(i), true, i);
    }
}

TEST_P(TracerContract, OfCoincidentInstancesOneIsHitTheLowestWhereClaimed) {
    core::Scene scene = scene_of(icosphere(3));
    for (int i = 0; i < 4; ++i) add_instance(scene, 0);
    const auto tracer = make(scene);
    const core::RayStream rays = rays_at_ball(scene.instances[0], 300, 0.9, 41);
    const core::HitStream hits = trace(*tracer, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(hits.get(i).hit());
        EXPECT_LE(hits.instance[i], factory().lowest_instance_wins ? 0u : 4u);
    }
}

}  // namespace tests
