// Cases 24, 25 and 31: what happens at a surface: rays that leave it, rays from behind it, its normals.
#include <algorithm>
#include <cmath>

#include "core/trace/surface.h"
#include "tests/stability/hard_case.h"

namespace tests {
namespace {

/// A cosine-distributed ray from every hit, from where the hit says that rays leave.
std::vector<core::Ray> bounces_of(const core::Scene& scene, const core::RayStream& rays,
                                  const core::HitStream& hits, double least_cosine, TestRandom& random) {
    std::vector<core::Ray> bounces;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Hit hit = hits.get(i);
        if (!hit.hit()) continue;
        const core::SurfacePoint point = core::surface_at(scene, rays.get(i), hit);
        const glm::dvec3 normal(point.geometric_normal);
        glm::dvec3 direction = random.cosine_direction(normal);
        while (glm::dot(direction, normal) < least_cosine) direction = random.cosine_direction(normal);
        bounces.push_back(make_ray(point.origin_above(), direction));
    }
    return bounces;
}

TEST(Case24, BouncesFromConvexSurfacesMeetNothing) {
    const glm::dmat4 turn = rotation(0.6, {1, 2, 3});
    const struct {
        const char* name;
        core::Mesh mesh;
        double reach;
        glm::dvec3 half;  ///< Of a box, before it is turned; else 0.
        glm::dmat3 frame;
    } shapes[] = {
        {"sphere", icosphere(5), 1.1, glm::dvec3(0.0), glm::dmat3(1.0)},
        {"plane", box({0.5f, 0.05f, 0.5f}), 0.75, {0.5, 0.05, 0.5}, glm::dmat3(1.0)},
        {"turned plane", moved(box({0.5f, 0.08f, 0.5f}), turn), 0.75, {0.5, 0.08, 0.5}, glm::dmat3(turn)},
        {"sheet", moved(quad(1.0f, 1.0f), rotation(0.4, {1, 2, 3})), 0.7, glm::dvec3(0.0), glm::dmat3(1.0)}};
    for (const auto& shape : shapes) {
        const BakedScene baked(scene_of(shape.mesh), 64);
        const bool is_box = shape.half.x > 0.0;
        for_each_part(ray_count(15'000, 400'000), [&](std::uint32_t seed, int count) {
            const auto ray_number = static_cast<std::size_t>(count);
            const core::RayStream rays = random_lines(glm::dvec3(0.0), shape.reach, ray_number, seed);
            for_each_way([&](const Way& way) {
                TestRandom random(seed + 7);
                const core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
                const std::vector<core::Ray> bounces = bounces_of(baked.scene(), rays, hits, 0.0, random);
                ASSERT_GT(bounces.size(), rays.size() / 10);
                const core::HitStream again = trace_both(baked.tracer(way.mode), stream_of(bounces));
                std::size_t self_hits = 0, at_edges = 0;
                for (std::size_t i = 0; i < bounces.size(); ++i) {
                    if (!again.get(i).hit()) continue;
                    // How far inside a box's slabs the ray starts and ends: near two of them it leaves or
                    // meets an edge, which a field rounds off.
                    const auto is_near_edge = [&](double t) {
                        const glm::dvec3 point =
                            glm::dvec3(bounces[i].origin) + t * glm::dvec3(bounces[i].direction);
                        glm::dvec3 depth = shape.half - glm::abs(glm::transpose(shape.frame) * point);
                        std::sort(&depth.x, &depth.x + 3);
                        return depth.y < 3.0 * baked.voxel();
                    };
                    const bool is_edge = is_box && (is_near_edge(0.0) || is_near_edge(double(again.t[i])));
                    (is_edge ? at_edges : self_hits) += 1;
                }
                EXPECT_EQ(self_hits, 0u) << shape.name << ", " << way << ", of " << bounces.size();
                const std::size_t one_in = way.mode == sdf::HitMode::kEps ? 200 : 500;
                EXPECT_LE(at_edges, bounces.size() / one_in) << shape.name << ", " << way;
                if (std::getenv("FIELDLIGHT_FIGURES")) {
                    std::cerr << shape.name << ", " << way << ": " << at_edges << " at edges of "
                              << bounces.size() << "\n";
                }
            });
        });
    }
}

TEST(Case24, AWallTwoVoxelsAwayIsAlwaysHit) {
    constexpr int kResolution = 64;
    const double gap = 2.0 / kResolution;
    const core::Mesh slab = box({0.5f, 0.1f, 0.5f}), sheet = moved(quad(), rotation(-1.5707963, {1, 0, 0}));
    const core::Mesh upper = moved(slab, translation({0.0, 0.2 + gap, 0.0}));
    const glm::dmat4 turn = rotation(0.35, {3, 1, 2});
    struct Gap {
        const char* name;
        core::Scene scene;
        double top;
    };
    std::vector<Gap> gaps;
    gaps.push_back({"two instances", scene_of(slab), 0.1});
    add_instance(gaps.back().scene, 0, translation({0.0, 0.2 + gap, 0.0}));
    gaps.push_back({"one mesh", scene_of(merged(slab, upper)), 0.1});
    gaps.push_back({"sheet under a slab", scene_of(sheet), 0.0});
    add_instance(gaps.back().scene, add_mesh(gaps.back().scene, slab), translation({0.0, 0.1 + gap, 0.0}));
    gaps.push_back({"two sheets", scene_of(sheet), 0.0});
    add_instance(gaps.back().scene, 0, translation({0.0, gap, 0.0}));
    gaps.push_back({"one mesh, turned", scene_of(moved(merged(slab, upper), turn)), 0.1});
    for (const Gap& one : gaps) {
        const glm::dmat3 frame =
            std::string(one.name) == "one mesh, turned" ? glm::dmat3(turn) : glm::dmat3(1.0);
        // The voxel stays 1 / kResolution.
        const glm::vec3 extent = one.scene.meshes[0].bounds.extent();
        const float longest = std::max({extent.x, extent.y, extent.z});
        const BakedScene baked(one.scene, static_cast<int>(std::ceil(kResolution * longest)));
        TestRandom random(4);
        std::vector<core::Ray> rays;
        for (int i = 0; i < ray_count(5'000, 100'000); ++i) {
            const glm::dvec3 target(random.uniform(-0.25, 0.25), one.top, random.uniform(-0.25, 0.25));
            const glm::dvec3 direction(random.uniform(-0.5, 0.5), -1.0, random.uniform(-0.5, 0.5));
            // From within the gap.
            const glm::dvec3 origin = target - 0.5 * gap * direction;
            rays.push_back(make_ray(frame * origin, frame * direction));
        }
        for_each_way([&](const Way& way) {
            const core::RayStream stream = stream_of(rays);
            const core::HitStream hits = trace_both(baked.tracer(way.mode), stream);
            const std::vector<core::Ray> bounces = bounces_of(baked.scene(), stream, hits, 0.25, random);
            EXPECT_EQ(bounces.size(), rays.size()) << one.name << ", " << way;
            const core::HitStream above = trace_both(baked.tracer(way.mode), stream_of(bounces));
            std::size_t passed = 0, too_near = 0;
            for (std::size_t i = 0; i < bounces.size(); ++i) {
                const core::Hit hit = above.get(i);
                passed += !hit.hit();
                if (!hit.hit()) continue;
                const glm::dvec3 point =
                    glm::dvec3(bounces[i].origin) + double(hit.t) * glm::dvec3(bounces[i].direction);
                too_near += (glm::transpose(frame) * point).y < one.top + 0.5 * gap;
            }
            EXPECT_EQ(passed, 0u) << one.name << ", " << way;
            EXPECT_EQ(too_near, 0u) << one.name << ", " << way;
        });
    }
}

TEST(Case25, RaysFromInsideFindTheExitAndItsBack) {
    const glm::dmat4 matrix = translation({2, -1, 3}) * rotation(0.5, {1, 2, 3}) * scaling({1.0, 0.6, 1.4});
    const BakedScene baked(scene_of(icosphere(4), matrix), 48);
    for_each_part(ray_count(20'000, 1'000'000), [&](std::uint32_t seed, int count) {
        TestRandom random(seed);
        std::vector<core::Ray> rays;
        for (int i = 0; i < count; ++i) {
            const double reach = i % 2 ? random.uniform(0.9, 0.99) : 0.9 * std::cbrt(random.uniform());
            rays.push_back(make_ray(glm::dvec3(matrix * glm::dvec4(reach * random.direction(), 1.0)),
                                    random.direction()));
        }
        const core::RayStream stream = stream_of(rays);
        expect_agreement(baked, stream);
        for_each_way([&](const Way& way) {
            const core::HitStream hits = trace_both(baked.tracer(way.mode), stream);
            std::size_t misses = 0, front = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                misses += !hits.get(i).hit();
                front += hits.get(i).front;
            }
            EXPECT_EQ(misses, 0u) << way;
            EXPECT_EQ(front, 0u) << way;
        });
    });
}

TEST(Case31, NormalsAtCreasesAreUnitAndFaceTheRay) {
    // trace_both() checks every hit. Half of the rays aim at edges.
    core::Mesh spike = box({0.5f, 0.5f, 0.5f});
    for (glm::vec3& position : spike.positions) {
        if (position.y > 0.0f) position = glm::vec3(0.02f * position.x, 3.0f, 0.02f * position.z);
    }
    spike = make_mesh("spike", spike.positions, spike.normals, {}, spike.triangles);
    for (const core::Mesh& mesh :
         {box({0.5f, 0.4f, 0.3f}), moved(box(), rotation(0.7, {1, 2, 3})), cylinder(0.5f, 1.0f, 12), spike}) {
        const BakedScene baked(scene_of(mesh), 40);
        TestRandom random(3);
        std::vector<core::Ray> rays;
        for (int i = 0; i < ray_count(20'000, 1'000'000); ++i) {
            const glm::uvec3& corner = mesh.triangles[random.bits() % mesh.triangles.size()];
            const glm::dvec3 a(mesh.positions[corner[i % 3]]), b(mesh.positions[corner[(i + 1) % 3]]);
            glm::dvec3 target = a + random.uniform() * (b - a);
            if (i % 2) target += baked.voxel() * random.uniform(0.0, 3.0) * random.direction();
            const glm::dvec3 origin = target + random.uniform(0.01, 3.0) * random.direction();
            rays.push_back(make_ray(origin, target - origin));
        }
        const core::RayStream stream = stream_of(rays);
        for_each_way([&](const Way& way) {
            const core::HitStream hits = trace_both(baked.tracer(way.mode), stream);
            std::size_t found = 0, turned_away = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                if (!hits.get(i).hit()) continue;
                ++found;
                // Unit vectors of floats: the product of two that are normal to each other rounds by an ulp.
                const double cosine = glm::dot(glm::dvec3(hits.get(i).normal), glm::dvec3(rays[i].direction));
                turned_away += cosine > 1e-7;
            }
            EXPECT_GT(found, rays.size() / 4) << way;
            EXPECT_EQ(turned_away, 0u) << way;
        });
    }
}

/// The largest angle in degrees between normals of a sphere's field and the sphere's own.
double worst_normal(const BakedScene& baked, sdf::HitMode mode, const std::vector<core::Ray>& rays) {
    const core::HitStream hits = trace_both(baked.tracer(mode), stream_of(rays));
    double worst = 0.0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Hit hit = hits.get(i);
        EXPECT_TRUE(hit.hit());
        const glm::dvec3 point = glm::dvec3(rays[i].origin) + double(hit.t) * glm::dvec3(rays[i].direction);
        const double cosine = glm::dot(glm::normalize(point), glm::dvec3(hit.normal));
        worst = std::max(worst, glm::degrees(std::acos(std::min(1.0, cosine))));
    }
    return worst;
}

TEST(Case31, NormalsOfSpheresOfEightVoxelsAreWithinADegree) {
    const core::Mesh mesh = icosphere(6);
    TestRandom random(8);
    std::vector<core::Ray> rays;
    for (int i = 0; i < ray_count(20'000, 1'000'000); ++i) {
        const glm::dvec3 origin = 3.0 * random.direction();
        rays.push_back(make_ray(origin, 0.95 * random.direction() - origin));
    }
    for (const int resolution : {16, 24, 40}) {
        for (const sdf::SampleBits bits : {sdf::SampleBits::k16, sdf::SampleBits::k8}) {
            const BakedScene baked(scene_of(mesh), resolution, bits);
            for_each_way([&](const Way& way) {
                const double worst = worst_normal(baked, way.mode, rays);
                EXPECT_LE(worst, bits == sdf::SampleBits::k8 ? 3.0 : 1.0)
                    << way << ", radius " << resolution / 2 << ", " << static_cast<int>(bits) << " bits";
                if (std::getenv("FIELDLIGHT_FIGURES")) {
                    std::cerr << "radius " << resolution / 2 << ", " << static_cast<int>(bits) << " bits, "
                              << way << ": " << worst << " degrees\n";
                }
            });
        }
    }
}

}  // namespace
}  // namespace tests
