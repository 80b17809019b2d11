// Cases 20 to 23: rays from far away, worlds far from their origin, rays that are none, and ends of rays.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "core/trace/triangle_tracer.h"
#include "tests/stability/hard_case.h"

namespace tests {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kDenormal = 1e-41f;

/// Compares t with R's, allowing the margin over the slope and `ulps` of t.
void expect_t_of_r(const BakedScene& baked, const core::RayStream& rays, double ulps,
                   std::size_t least_hits) {
    const std::vector<Reference> references = references_of(baked, rays);
    for_each_way([&](const Way& way) {
        const core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
        std::size_t misses = 0, false_hits = 0, beyond = 0, compared = 0;
        double worst = 0.0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const Reference& reference = references[i];
            const core::Hit hit = hits.get(i);
            // Rays that only graze are case 18.
            if (reference.hit() && reference.slope() < 0.2) continue;
            misses += reference.hit() && !hit.hit();
            if (!reference.hit()) {
                false_hits += hit.hit() && reference.deviation_of(hit).value > way.margin();
                continue;
            }
            if (!hit.hit()) continue;
            ++compared;
            const double allowed =
                way.margin() / (reference.slope() * reference.speed()) + ulps * ulp(reference.t());
            const double apart = std::abs(double(hit.t) - reference.t());
            worst = std::max(worst, apart / allowed);
            beyond += apart > allowed;
        }
        if (std::getenv("FIELDLIGHT_FIGURES"))
            std::cerr << way << ": worst " << worst << " of what is allowed\n";
        EXPECT_GE(compared, least_hits) << way;
        EXPECT_EQ(misses, 0u) << way;
        EXPECT_EQ(false_hits, 0u) << way;
        EXPECT_EQ(beyond, 0u) << way << ": worst " << worst << " of what is allowed, of " << compared;
    });
}

TEST(Case20, FarCamerasSeeTheSurfaceWhereRHasIt) {
    const BakedScene baked(scene_of(icosphere(4)), 48);
    for (int exponent = 2; exponent <= 6; ++exponent) {
        const double distance = 2.0 * std::pow(10.0, exponent);
        TestRandom random(static_cast<std::uint32_t>(exponent));
        std::vector<core::Ray> rays;
        for (int i = 0; i < ray_count(4'000, 200'000); ++i) {
            const glm::dvec3 origin = distance * random.direction();
            rays.push_back(make_ray(origin, 0.9 * random.direction() - origin));
        }
        SCOPED_TRACE(distance);
        // A direction of floats turns the ray by up to 6e-8: beyond 1e6 it may pass by, for R as well.
        expect_t_of_r(baked, stream_of(rays), 4.0, rays.size() / 4);
    }
}

TEST(Case21, AWorldFarFromItsOriginIsTracedLikeR) {
    const glm::dvec3 offset(148376, 1234, -223423);
    for (const double size : {1.0, 40.0, 1000.0}) {
        const BakedScene baked(scene_of(icosphere(4), translation(offset) * rotation(0.3, {1, 2, 3}) *
                                                          scaling(glm::dvec3(size))),
                               48);
        TestRandom random(9);
        std::vector<core::Ray> rays;
        for (int i = 0; i < ray_count(20'000, 1'000'000); ++i) {
            const glm::dvec3 from = 3.0 * size * random.direction();
            rays.push_back(make_ray(offset + from, 0.9 * size * random.direction() - from));
        }
        SCOPED_TRACE(size);
        expect_t_of_r(baked, stream_of(rays), 16.0, rays.size() / 2);
    }
}

std::vector<core::Ray> broken_rays(const core::Ray& good) {
    std::vector<core::Ray> broken;
    for (const float bad : {kNaN, kInfinity, -kInfinity}) {
        for (int axis = 0; axis < 3; ++axis) {
            broken.push_back(good);
            broken.back().origin[axis] = bad;
            broken.push_back(good);
            broken.back().direction[axis] = bad;
        }
        broken.push_back(good);
        broken.back().t_min = bad;
    }
    broken.push_back(good);
    broken.back().t_max = kNaN;
    broken.push_back(good);
    broken.back().t_max = -kInfinity;
    for (const glm::vec3& direction : {glm::vec3(0.0f), glm::vec3(-0.0f), glm::vec3(kDenormal, 0.0f, 0.0f),
                                       glm::vec3(1e-20f), glm::vec3(3e38f), glm::vec3(0.0f, 2.0f, 0.0f)}) {
        broken.push_back(good);
        broken.back().direction = direction;
    }
    broken.push_back(good);
    broken.back().t_min = 2.0f;
    broken.back().t_max = 1.0f;
    return broken;
}

core::Scene two_shapes() {
    core::Scene scene = scene_of(icosphere(3));
    add_instance(scene, add_mesh(scene, moved(quad(), rotation(0.4, {1, 2, 3}))), translation({1.5, 0.2, 0}));
    return scene;
}

bool same(const core::Hit& a, const core::Hit& b) {
    return a.status == b.status && a.steps == b.steps &&
           (!a.hit() || (a.t == b.t && a.normal == b.normal && a.triangle == b.triangle));
}

TEST(Case22, RaysThatAreNoneMissAndLeaveTheOthersAlone) {
    const BakedScene baked(two_shapes(), 40);
    const core::TriangleTracer triangles(baked.scene());
    const core::RayStream rays = random_lines(glm::dvec3(0.5, 0, 0), 2.0, 6000, 5);
    const std::vector<core::Ray> broken = broken_rays(rays.get(0));
    core::RayStream mixed = rays;
    for (std::size_t i = 0; i < rays.size(); i += 3) mixed.set(i, broken[i / 3 % broken.size()]);
    const core::HitStream on_triangles = trace_both(triangles, mixed);
    for_each_way([&](const Way& way) {
        const core::HitStream alone = trace_both(baked.tracer(way.mode), rays),
                              beside = trace_both(baked.tracer(way.mode), mixed);
        std::size_t hit = 0, changed = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (i % 3 == 0) {
                hit += beside.status[i] != core::HitStatus::kMiss || on_triangles.get(i).hit();
            } else {
                changed += !same(alone.get(i), beside.get(i));
            }
        }
        EXPECT_EQ(hit, 0u) << way;
        EXPECT_EQ(changed, 0u) << way;
    });
}

TEST(Case22, DenormalPartsAreTracedLikeRAndCostNoMore) {
    const BakedScene baked(scene_of(icosphere(4)), 48);
    TestRandom random(4);
    std::vector<core::Ray> plain, denormal;
    for (int i = 0; i < 30'000; ++i) {
        const int axis = i % 3;
        glm::dvec3 origin(0.0), direction(0.0);
        origin[axis] = i % 2 ? 3.0 : -3.0;
        direction[axis] = -origin[axis];
        origin[(axis + 1) % 3] = random.uniform(-0.9, 0.9);
        core::Ray ray = make_ray(origin, direction);
        plain.push_back(ray);
        ray.origin[(axis + 2) % 3] = i % 5 ? kDenormal : -kDenormal;
        ray.direction[(axis + 1) % 3] = i % 7 ? kDenormal : -1e-38f;
        ray.direction[(axis + 2) % 3] = kDenormal;
        ray.t_min = kDenormal;
        denormal.push_back(ray);
    }
    const core::RayStream plain_rays = stream_of(plain), denormal_rays = stream_of(denormal);
    expect_agreement(baked, denormal_rays);
    for_each_way([&](const Way& way) {
        // Processor time, in turns: the wall's clock tells what else the machine does.
        const auto seconds = [&](const core::RayStream& rays) {
            core::HitStream hits;
            const std::clock_t start = std::clock();
            baked.tracer(way.mode).trace_closest(rays, hits);
            return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        };
        double of_plain = 1e9, of_denormal = 1e9;
        for (int i = 0; i < 7; ++i) {
            of_plain = std::min(of_plain, seconds(plain_rays));
            of_denormal = std::min(of_denormal, seconds(denormal_rays));
        }
        EXPECT_LT(of_denormal, 2.5 * of_plain) << way;
    });
}

TEST(Case23, NoHitLiesBeyondTMax) {
    const BakedScene baked(two_shapes(), 40);
    const core::RayStream rays =
        random_lines(glm::dvec3(0.5, 0, 0), 2.0, static_cast<std::size_t>(ray_count(20'000, 1'000'000)), 6);
    for_each_way([&](const Way& way) {
        const core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
        core::RayStream before = rays, at = rays, after = rays, empty = rays;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (!hits.get(i).hit()) continue;
            const float t = hits.t[i];
            before.t_max[i] = std::nextafter(t, 0.0f);
            at.t_max[i] = t;
            after.t_max[i] = std::nextafter(t, kInfinity);
            empty.t_min[i] = std::nextafter(t, kInfinity);
            empty.t_max[i] = t;
        }
        // trace_both() fails on any hit beyond t_max.
        const core::HitStream just_before = trace_both(baked.tracer(way.mode), before),
                              just_at = trace_both(baked.tracer(way.mode), at),
                              just_after = trace_both(baked.tracer(way.mode), after),
                              none = trace_both(baked.tracer(way.mode), empty);
        std::size_t wrong = 0, found_before = 0, hit_count = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            if (!hits.get(i).hit()) continue;
            ++hit_count;
            wrong += none.get(i).hit();
            // An ulp later it is there again, where it was; at t_max itself rounding decides.
            wrong += !just_after.get(i).hit() || just_after.t[i] != hits.t[i];
            wrong += just_at.get(i).hit() && just_at.t[i] != hits.t[i];
            found_before += just_before.get(i).hit();
        }
        EXPECT_GT(hit_count, rays.size() / 10);
        EXPECT_EQ(wrong, 0u) << way;
        // A hit at t - 1 ulp would be one whose t in double lies before.
        EXPECT_EQ(found_before, 0u) << way;
    });
}

}  // namespace
}  // namespace tests
