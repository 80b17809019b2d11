// Cases 26 to 29: instances that are mirrored, stretched, sheared, tiny, huge, broken, coincident, or many.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/support/error.h"
#include "sdf/field_kernel.h"
#include "tests/stability/hard_case.h"

namespace tests {
namespace {

core::RayStream rays_at(const glm::dmat4& matrix, int count, std::uint32_t seed) {
    TestRandom random(seed);
    std::vector<core::Ray> rays;
    for (int i = 0; i < count; ++i) {
        const glm::dvec3 from = random.uniform(1.6, 4.0) * random.direction();
        const glm::dvec3 to = 0.95 * std::cbrt(random.uniform()) * random.direction();
        const glm::dvec3 origin(matrix * glm::dvec4(from, 1.0));
        rays.push_back(make_ray(origin, glm::dmat3(matrix) * (to - from)));
    }
    return stream_of(rays);
}

TEST(Case26, AMirroredInstanceAnswersLikeItsTwin) {
    const core::Mesh mesh =
        merged(torus(0.7f, 0.25f, 48, 24), moved(icosphere(3, 0.3f), translation({0.1, 0.5, 0.2})));
    const glm::dmat4 place = rotation(0.6, {1, 2, 3});
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 signs(1.0);
        signs[axis] = -1.0;
        const BakedScene plain(scene_of(mesh, place), 48),
            mirrored(scene_of(mesh, scaling(signs) * place), 48);
        const core::RayStream rays = rays_at(place, ray_count(8'000, 500'000), 3);
        core::RayStream twins = rays;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            core::Ray ray = rays.get(i);
            ray.origin *= glm::vec3(signs);
            ray.direction *= glm::vec3(signs);
            twins.set(i, ray);
        }
        for_each_way([&](const Way& way) {
            const core::HitStream a = trace_both(plain.tracer(way.mode), rays),
                                  b = trace_both(mirrored.tracer(way.mode), twins);
            std::size_t different = 0, flipped = 0, hits = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const core::Hit one = a.get(i), twin = b.get(i);
                different += one.hit() != twin.hit();
                if (!one.hit() || !twin.hit()) continue;
                ++hits;
                different += std::abs(one.t - twin.t) > 4.0 * ulp(one.t) || one.front != twin.front;
                // Unit vectors of floats.
                flipped += glm::distance(one.normal * glm::vec3(signs), twin.normal) > 1e-5f;
            }
            EXPECT_GT(hits, rays.size() / 4);
            EXPECT_EQ(different, 0u) << way;
            EXPECT_EQ(flipped, 0u) << way;
        });
    }
}

TEST(Case27, StretchedShearedTinyAndHugeInstancesAgreeWithR) {
    glm::dmat4 shear(1.0);
    shear[1][0] = 5.0;
    const struct {
        const char* name;
        glm::dmat4 matrix;
    } places[] = {{"1, 10, 0.1", scaling({1.0, 10.0, 0.1})},
                  {"turned 1, 10, 0.1",
                   rotation(0.7, {1, 2, 3}) * scaling({1.0, 10.0, 0.1}) * rotation(0.4, {3, 1, 2})},
                  {"shear 5", shear},
                  {"turned shear", rotation(0.5, {2, 1, 1}) * shear},
                  {"1e-6", rotation(0.3, {1, 2, 3}) * scaling(glm::dvec3(1e-6))},
                  {"1e-3", translation({1e-3, 2e-3, 0}) * scaling(glm::dvec3(1e-3))},
                  {"1e3", translation({10, 20, 0}) * scaling(glm::dvec3(1e3))},
                  {"1e6", rotation(0.3, {1, 2, 3}) * scaling(glm::dvec3(1e6))}};
    for (const auto& place : places) {
        SCOPED_TRACE(place.name);
        const BakedScene baked(scene_of(icosphere(4), place.matrix), 48);
        const core::RayStream rays = rays_at(place.matrix, ray_count(6'000, 250'000), 5);
        const std::vector<Reference> references = references_of(baked, rays);
        for_each_way([&](const Way& way) {
            const core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
            std::size_t hit_count = 0, beyond = 0;
            double worst = 0.0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const Deviation deviation = references[i].deviation_of(hits.get(i));
                // t is a float: along a stretched axis its last bits may be more than a thousandth of a
                // voxel.
                const double rounding =
                    2.0 * ulp(hits.get(i).hit() ? hits.t[i] : 0.0) * references[i].speed();
                const double off = std::max({deviation.value, deviation.along, deviation.skipped}) - rounding;
                worst = std::max(worst, off);
                beyond += off > way.margin();
                hit_count += hits.get(i).hit();
            }
            if (std::getenv("FIELDLIGHT_FIGURES"))
                std::cerr << place.name << ", " << way << ": " << worst << "\n";
            EXPECT_GT(hit_count, rays.size() / 2) << way;
            EXPECT_EQ(beyond, 0u) << way << ", worst " << worst;
        });
    }
}

TEST(Case28, BrokenMatricesAreRejectedByNameAndTheRestIsUntouched) {
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    core::Scene scene = scene_of(icosphere(3));
    add_instance(scene, 0, translation({2.5, 0, 0}) * scaling({-1.0, 0.5, 1.5}));
    const BakedScene before(scene, 32);
    glm::dmat4 flat(1.0), not_a_number(1.0), infinite(1.0);
    flat[1] = flat[0];
    not_a_number[2][1] = nan;
    infinite[3][0] = inf;
    for (const glm::dmat4& matrix : {glm::dmat4(0.0), scaling({1.0, 0.0, 1.0}), flat, not_a_number, infinite,
                                     scaling({1.0, 1e-300, 1.0}), glm::dmat4(nan)}) {
        try {
            scene.instances.push_back(core::make_instance("the broken one", 0, {0}, matrix));
            ADD_FAILURE() << "was accepted";
        } catch (const core::InputError& error) {
            EXPECT_EQ(error.kind(), core::ErrorKind::kBadData);
            EXPECT_NE(std::string(error.what()).find("'the broken one'"), std::string::npos) << error.what();
        }
    }
    ASSERT_EQ(scene.instances.size(), 2u);
    const BakedScene after(scene, 32);
    const core::RayStream rays = random_lines({1.0, 0, 0}, 3.0, 5000, 3);
    for_each_way([&](const Way& way) {
        const core::HitStream a = trace_both(before.tracer(way.mode), rays),
                              b = trace_both(after.tracer(way.mode), rays);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            ASSERT_EQ(a.status[i], b.status[i]);
            if (!a.get(i).hit()) continue;
            ASSERT_EQ(a.t[i], b.t[i]);
            ASSERT_EQ(a.get(i).normal, b.get(i).normal);
        }
    });
}

TEST(Case29, OfCoincidentInstancesTheLowestIsHitInAnyOrder) {
    // Twins of one mesh among others, under transforms that tell them apart by nothing but the number.
    const glm::dmat4 place = translation({0.2, 0.1, 0}) * rotation(0.5, {1, 2, 3}) * scaling({1.0, 1.5, 0.7});
    core::Scene scene = scene_of(icosphere(3), place);
    const std::uint32_t sheet = add_mesh(scene, quad(2.0f, 2.0f));
    for (int i = 0; i < 9; ++i)
        add_instance(scene, 0, i % 3 == 0 ? place : translation({0.1 * i, -0.4, 0.1 * i}));
    for (int i = 0; i < 4; ++i) add_instance(scene, sheet, translation({0, 0, 1.4}));
    core::Scene turned = scene;
    std::reverse(turned.instances.begin(), turned.instances.end());
    const BakedScene baked(scene, 32), other(turned, 32);
    const core::RayStream rays =
        random_lines(glm::dvec3(0.0), 2.0, static_cast<std::size_t>(ray_count(10'000, 500'000)), 3);
    const auto last = static_cast<std::uint32_t>(scene.instances.size() - 1);
    for_each_way([&](const Way& way) {
        const core::HitStream a = trace_both(baked.tracer(way.mode), rays),
                              b = trace_both(other.tracer(way.mode), rays);
        std::size_t wrong = 0, twins = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const core::Hit hit = a.get(i), reverse = b.get(i);
            wrong += hit.hit() != reverse.hit();
            if (!hit.hit() || !reverse.hit()) continue;
            wrong += hit.t != reverse.t || hit.triangle != reverse.triangle;
            const glm::dmat4& matrix = scene.instances[hit.instance].world_from_local;
            wrong += matrix != scene.instances[last - reverse.instance].world_from_local;
            for (std::uint32_t k = 0; k <= last; ++k) {
                if (scene.instances[k].mesh != scene.instances[hit.instance].mesh) continue;
                if (scene.instances[k].world_from_local != matrix) continue;
                // The first twin in the order of either scene.
                wrong += k < hit.instance || last - k < reverse.instance;
                twins += k != hit.instance;
            }
        }
        EXPECT_EQ(wrong, 0u) << way;
        EXPECT_GT(twins, rays.size() / 10);
    });
}

TEST(Case29, AThousandOverlappingInstancesEqualTheNearestOfEachAlone) {
    core::Scene scene = scene_of(icosphere(2));
    scene.instances.clear();
    TestRandom random(17);
    for (int i = 0; i < ray_count(200, 1000); ++i) {
        add_instance(scene, 0,
                     translation(0.7 * random.direction()) *
                         rotation(random.uniform(0, 3), random.direction()) *
                         scaling(glm::dvec3(random.uniform(0.05, 0.4), random.uniform(0.05, 0.4), 0.2)));
    }
    const BakedScene all(scene, 16);
    const core::RayStream rays =
        random_lines(glm::dvec3(0.0), 1.3, static_cast<std::size_t>(ray_count(150, 5'000)), 2);
    for_each_way([&](const Way& way) {
        // One instruction set a mode: case 30 has them equal.
        if (way.target !=
            sdf::kernel_targets()[static_cast<std::size_t>(way.mode) % sdf::kernel_targets().size()])
            return;
        const core::HitStream hits = trace_both(all.tracer(way.mode), rays);
        std::vector<core::Hit> expected(rays.size());
        core::Scene one = scene;
        for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
            one.instances = {scene.instances[i]};
            const sdf::SdfTracer alone(one, all.grids(), way.mode);
            core::HitStream found;
            alone.trace_closest(rays, found);
            for (std::size_t k = 0; k < rays.size(); ++k) {
                if (!found.get(k).hit() || (expected[k].hit() && !(found.t[k] < expected[k].t))) continue;
                expected[k] = found.get(k);
                expected[k].instance = i;
            }
        }
        std::size_t hit_count = 0;
        for (std::size_t k = 0; k < rays.size(); ++k) {
            ASSERT_EQ(hits.get(k).hit(), expected[k].hit()) << way << ", ray " << k;
            if (!expected[k].hit()) continue;
            ++hit_count;
            EXPECT_EQ(hits.t[k], expected[k].t) << way << ", ray " << k;
            EXPECT_EQ(hits.instance[k], expected[k].instance) << way << ", ray " << k;
        }
        EXPECT_GT(hit_count, rays.size() / 4);
    });
}

}  // namespace
}  // namespace tests
