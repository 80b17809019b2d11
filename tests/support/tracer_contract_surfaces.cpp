// tests/support/tracer_contract_surfaces.cpp: the half of the contract that needs materials: alpha, rays that
// leave a surface, and what surface_at() makes of a hit.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/trace/surface.h"
#include "core/trace/triangle_tracer.h"
#include "tests/support/analytic_scenes.h"
#include "tests/support/tracer_contract.h"

namespace tests {
namespace {

/// A unit box whose material shows on the half of every face where u > 1/2.
core::Scene half_masked_box() {
    core::Scene scene = scene_of(box());
    const int texture = add_texture(scene, 2, 1, {{255, 255, 255, 0}, {255, 255, 255, 255}});
    scene.materials[0].base_color_texture.texture = texture;
    scene.materials[0].alpha_mode = core::AlphaMode::kMask;
    return scene;
}

core::Scene blended_box(float alpha) {
    core::Scene scene = scene_of(box());
    scene.materials[0].base_color.a = alpha;
    scene.materials[0].alpha_mode = core::AlphaMode::kBlend;
    return scene;
}

/// A ray down the Z axis onto the box's front face, whose u runs along X; the back face's runs along Y.
core::Ray ray_down(double x, double y, std::uint32_t seed) {
    return make_ray({x, y, 3.0}, {0, 0, -1}, std::numeric_limits<float>::infinity(), seed);
}

}  // namespace

bool surface_contract_is_linked() {
    return true;
}

TEST_P(TracerContract, RaysPassTheCutOutsOfMaskMaterials) {
    const core::Scene scene = half_masked_box();
    const auto tracer = make(scene);
    TestRandom random(3);
    std::vector<core::Ray> rays;
    const double margin = factory().edge_margin + 0.01;
    for (int i = 0; i < 900; ++i) {
        const double x = (i % 3 == 0 ? 1.0 : -1.0) * random.uniform(margin, 0.5 - margin);
        const double y = (i % 3 == 1 ? 1.0 : -1.0) * random.uniform(margin, 0.5 - margin);
        rays.push_back(ray_down(x, y, random.bits()));
    }
    const core::HitStream hits = trace(*tracer, stream_of(rays));
    const double slack = allowed(scene.meshes[0], 4.0);
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Hit hit = hits.get(i);
        switch (i % 3) {
            case 0:
                ASSERT_TRUE(hit.hit()) << "ray " << i;
                EXPECT_NEAR(hit.t, 2.5, slack);
                EXPECT_TRUE(hit.front);
                break;
            case 1:
                // Through the hole in front onto the inside of the back face.
                ASSERT_TRUE(hit.hit()) << "ray " << i;
                EXPECT_NEAR(hit.t, 3.5, slack);
                EXPECT_FALSE(hit.front);
                break;
            default:
                EXPECT_FALSE(hit.hit()) << "ray " << i;
        }
    }
}

TEST_P(TracerContract, BlendMaterialsAreHitWithProbabilityAlphaBySeed) {
    const double alpha = 0.3;
    const core::Scene scene = blended_box(float(alpha));
    const auto tracer = make(scene);
    TestRandom random(5);
    std::vector<core::Ray> rays;
    const double inside = 0.49 - factory().edge_margin;
    const int count = 20000;
    for (int i = 0; i < count; ++i) {
        rays.push_back(
            ray_down(random.uniform(-inside, inside), random.uniform(-inside, inside), random.bits()));
    }
    const core::RayStream stream = stream_of(rays);
    const core::HitStream hits = trace(*tracer, stream);
    int front_count = 0, back_count = 0;
    for (int i = 0; i < count; ++i) {
        const core::Hit hit = hits.get(std::size_t(i));
        if (!hit.hit()) continue;
        (hit.front ? front_count : back_count) += 1;
        EXPECT_TRUE(
            core::is_visible(scene, hit.instance, hit.triangle, hit.barycentrics, rays[std::size_t(i)].seed));
    }
    // Five standard deviations of a binomial count.
    const auto expect_rate = [&](int hit_count, double rate) {
        EXPECT_NEAR(hit_count, count * rate, 5.0 * std::sqrt(count * rate * (1.0 - rate)));
    };
    expect_rate(front_count, alpha);
    expect_rate(back_count, (1.0 - alpha) * alpha);
    // The seed decides, not the order or the neighbours.
    const core::HitStream again = trace(*tracer, stream);
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(hits.status[i], again.status[i]);
}

TEST_P(TracerContract, AlphaOfZeroHidesAndOfOneShows) {
    for (const float alpha : {0.0f, 1.0f}) {
        const core::Scene scene = blended_box(alpha);
        const auto tracer = make(scene);
        std::vector<core::Ray> rays;
        for (std::uint32_t seed = 0; seed < 200; ++seed) rays.push_back(ray_down(0.1, 0.2, seed));
        const core::HitStream hits = trace(*tracer, stream_of(rays));
        for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(hits.get(i).hit(), alpha == 1.0f);
    }
}

TEST_P(TracerContract, OneInstanceMayHideWhileAnotherOfTheSameMeshShows) {
    core::Scene scene = blended_box(0.0f);
    const std::uint32_t solid = add_material(scene, lambert(glm::vec3(0.2f)));
    add_instance(scene, 0, translation({0, 0, -2.0}), solid);
    const auto tracer = make(scene);
    const core::HitStream hits = trace(*tracer, stream_of({ray_down(0.1, 0.2, 1)}));
    ASSERT_TRUE(hits.get(0).hit());
    EXPECT_EQ(hits.instance[0], 1u);
    EXPECT_NEAR(hits.t[0], 4.5, allowed(scene.meshes[0], 6.0));
}

TEST_P(TracerContract, EachPartOfAMeshHasItsOwnAlphaAndItsOwnTriangles) {
    // Two boxes one behind the other in one mesh; either part may be the one that is cut away.
    for (const std::uint32_t hidden_part : {0u, 1u}) {
        core::Scene scene = scene_of(merged(box(), moved(box(), translation({0, 0, -2}))));
        core::Material hidden = lambert(glm::vec3(0.5f));
        hidden.alpha_mode = core::AlphaMode::kMask;
        hidden.base_color.a = 0.0f;
        scene.instances[0].materials[hidden_part] = add_material(scene, hidden);
        const auto tracer = make(scene);
        const core::HitStream hits = trace(*tracer, stream_of({ray_down(0.1, 0.2, 1)}));
        ASSERT_TRUE(hits.get(0).hit());
        EXPECT_NEAR(hits.t[0], hidden_part == 0 ? 4.5 : 2.5, allowed(scene.meshes[0], 6.0));
        EXPECT_EQ(scene.meshes[0].part_of_triangle[hits.triangle[0]], 1 - hidden_part);
    }
}

TEST_P(TracerContract, RaysThatLeaveAHitDoNotMeetItsSurfaceAgain) {
    // Convex shapes: nothing but the surface itself is there to be hit.
    for (const core::Mesh& mesh : {icosphere(4), box({0.5f, 0.4f, 0.3f})}) {
        const core::Scene scene =
            scene_of(mesh, translation({3, 2, 1}) * rotation(0.3, {1, 2, 3}) * scaling({1.0, -2.0, 0.5}));
        const auto tracer = make(scene);
        const core::RayStream rays = random_lines({3, 2, 1}, 2.0, 20000, 11);
        const core::HitStream hits = trace(*tracer, rays);
        TestRandom random(13);
        std::vector<core::Ray> bounces;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const core::Hit hit = hits.get(i);
            if (!hit.hit()) continue;
            const core::SurfacePoint point = core::surface_at(scene, rays.get(i), hit);
            bounces.push_back(
                make_ray(point.origin_above(), random.cosine_direction(glm::dvec3(point.geometric_normal))));
        }
        ASSERT_GT(bounces.size(), 1500u);
        const core::HitStream again = trace(*tracer, stream_of(bounces));
        int self_hit_count = 0;
        for (std::size_t i = 0; i < bounces.size(); ++i) self_hit_count += again.get(i).hit() ? 1 : 0;
        EXPECT_EQ(self_hit_count, 0) << "of " << bounces.size();
    }
}

TEST_P(TracerContract, RaysThatLeaveAHitMeetAWallCloseBy) {
    // Two boxes with a gap of four times the tracer's error; rays leave the lower one's top.
    const double gap = std::max(1e-3, 4.0 * factory().position_tolerance);
    core::Scene scene = scene_of(box());
    add_instance(scene, 0, translation({0, 1.0 + gap, 0}));
    const auto tracer = make(scene);
    TestRandom random(17);
    std::vector<core::Ray> rays;
    // Within the gap from the side, so that both boxes are near; down onto the lower one.
    for (int i = 0; i < 2000; ++i) {
        const double inside = 0.35 - factory().edge_margin;
        const glm::dvec3 target(random.uniform(-inside, inside), 0.5, random.uniform(-inside, inside));
        const glm::dvec3 from = target + glm::dvec3(0.0, 0.5 * gap, 0.0);
        rays.push_back(make_ray(from, {random.uniform(-0.5, 0.5), -1.0, random.uniform(-0.5, 0.5)}));
    }
    const core::HitStream hits = trace(*tracer, stream_of(rays));
    std::vector<core::Ray> bounces;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Hit hit = hits.get(i);
        ASSERT_TRUE(hit.hit() && hit.instance == 0u) << "ray " << i;
        const core::SurfacePoint point = core::surface_at(scene, rays[i], hit);
        bounces.push_back(
            make_ray(point.origin_above(), {random.uniform(-1.0, 1.0), 1.0, random.uniform(-1.0, 1.0)}));
    }
    const core::HitStream above = trace(*tracer, stream_of(bounces));
    for (std::size_t i = 0; i < bounces.size(); ++i) {
        ASSERT_TRUE(above.get(i).hit()) << "ray " << i;
        EXPECT_EQ(above.instance[i], 1u) << "ray " << i;
    }
}

TEST_P(TracerContract, StartOffsetClearsExactPointsOfTheSurface) {
    for (const glm::dmat4& matrix : {glm::dmat4(1.0), translation({30, -20, 10}) * rotation(0.3, {1, 2, 3}) *
                                                          scaling({1.0, 3.0, -0.2})}) {
        const core::Scene scene = scene_of(icosphere(4), matrix);
        const auto tracer = make(scene);
        const core::Mesh& mesh = scene.meshes[0];
        const double offset = tracer->start_offset(0);
        ASSERT_GT(offset, 0.0);
        TestRandom random(19);
        std::vector<core::Ray> rays;
        for (int i = 0; i < 5000; ++i) {
            const glm::uvec3& corner = mesh.triangles[random.bits() % mesh.triangles.size()];
            double u = random.uniform(), v = random.uniform();
            if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
            const glm::dvec3 a(mesh.positions[corner.x]), b(mesh.positions[corner.y]),
                c(mesh.positions[corner.z]);
            const glm::dvec3 point(matrix * glm::dvec4(a + u * (b - a) + v * (c - a), 1.0));
            const glm::dvec3 normal =
                glm::normalize(glm::transpose(glm::dmat3(glm::inverse(matrix))) * glm::cross(b - a, c - a));
            rays.push_back(make_ray(point + offset * normal, random.cosine_direction(normal)));
        }
        const core::HitStream hits = trace(*tracer, stream_of(rays));
        int self_hit_count = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) self_hit_count += hits.get(i).hit() ? 1 : 0;
        EXPECT_EQ(self_hit_count, 0) << "of " << rays.size();
    }
}

TEST_P(TracerContract, SurfacesAreThoseOfTheStoredTriangles) {
    // A torus is curved both ways and has uv that grow with it; the texture is a smooth ramp, so that colours
    // measure how far apart the uv are.
    core::Scene scene = scene_of(torus(1.0f, 0.4f, 96, 48), rotation(0.6, {1, 2, 0}));
    std::vector<glm::u8vec4> ramp;
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) ramp.emplace_back(4 * x, 4 * y, 128, 255);
    }
    const int texture = add_texture(scene, 64, 64, ramp);
    scene.textures[0].nearest = false;
    scene.materials[0].metallic_roughness_texture.texture = texture;
    scene.materials[0].metallic = 0.0f;

    const core::TriangleTracer exact(scene);
    const auto tracer = make(scene);
    const core::RayStream rays = random_lines(glm::dvec3(0.0), 1.5, 4000, 43);
    core::HitStream expected;
    exact.trace_closest(rays, expected);
    const core::HitStream hits = trace(*tracer, rays);
    int compared = 0, different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const core::Hit reference = expected.get(i);
        // Grazing rays turn a small distance off the surface into a long way along it.
        if (!reference.hit() || glm::dot(reference.normal, rays.get(i).direction) > -0.4f) continue;
        const core::Hit hit = hits.get(i);
        ++compared;
        if (!hit.hit() || std::abs(hit.t - reference.t) > 3.0 * allowed(scene.meshes[0], 4.0) / 0.4) {
            ++different;
            continue;
        }
        const core::SurfacePoint a = core::surface_at(scene, rays.get(i), reference);
        const core::SurfacePoint b = core::surface_at(scene, rays.get(i), hit);
        EXPECT_EQ(b.instance, a.instance);
        EXPECT_EQ(b.geometric_normal, hit.normal);
        // Moving by s along a surface of radius 0.4 turns the normal by s / 0.4 and uv.y by s / (0.8 pi); the
        // ray moves along the surface by at most the allowed distance times tan(66 degrees).
        const double s = 3.0 * allowed(scene.meshes[0], 4.0) * 2.3 + 1e-4;
        const double degrees =
            glm::degrees(std::acos(std::clamp(double(glm::dot(a.frame.normal, b.frame.normal)), -1.0, 1.0)));
        EXPECT_LE(degrees, glm::degrees(s / 0.4) + 0.1) << "ray " << i;
        // At the seam uv.y jumps from 1 to 0, and the ramp from its last value to its first.
        const double full_turn = 4.0 * 63.0 / 255.0;
        const double apart = std::abs(a.roughness - b.roughness);
        EXPECT_LE(std::min(apart, std::abs(full_turn - apart)), s / 2.5 + 1e-3) << "ray " << i;
        EXPECT_GT(glm::dot(b.frame.normal, -rays.get(i).direction), 0.0f);
    }
    EXPECT_GT(compared, 1000);
    // Where the front and the back of the ring meet in the picture, a ray may meet either.
    EXPECT_LE(different, compared / 100);
}

}  // namespace tests
