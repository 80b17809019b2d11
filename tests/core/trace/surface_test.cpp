#include "core/trace/surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/trace/triangle_tracer.h"
#include "tests/support/analytic_scenes.h"

namespace tests {
namespace {

/// The surface where one ray meets a scene.
core::SurfacePoint surface_along(const core::Scene& scene, const core::Ray& ray) {
    const core::TriangleTracer tracer(scene);
    core::HitStream hits;
    tracer.trace_closest(stream_of({ray}), hits);
    EXPECT_TRUE(hits.get(0).hit());
    return core::surface_at(scene, ray, hits.get(0));
}

void expect_near(const glm::vec3& a, const glm::vec3& b, float tolerance) {
    EXPECT_LE(glm::distance(a, b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") against ("
                                              << b.x << ", " << b.y << ", " << b.z << ")";
}

/// A quad in z = 0 whose normal map reads `tangent_normal` everywhere.
core::Scene normal_mapped_quad(const glm::vec3& tangent_normal, const glm::dmat4& matrix, float handedness) {
    core::Scene scene = scene_of(quad(2.0f, 2.0f), matrix);
    const auto encode = [](float x) { return glm::u8(std::lround((x * 0.5f + 0.5f) * 255.0f)); };
    scene.materials[0].normal_texture.texture = add_texture(
        scene, 1, 1, {{encode(tangent_normal.x), encode(tangent_normal.y), encode(tangent_normal.z), 255}});
    scene.meshes[0].tangents.assign(scene.meshes[0].positions.size(), glm::vec4(1, 0, 0, handedness));
    return scene;
}

constexpr double kDegree = 3.14159265358979323846 / 180.0;
/// Steps of an 8-bit normal map are 1/127; two components and the scale to unit length.
constexpr float kNormalMapStep = 0.015f;

TEST(ShadingFrame, IsOrthonormalAndRightHandedForEveryNormal) {
    TestRandom random(1);
    std::vector<glm::vec3> normals = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}, {0.0f, 0.0f, -0.0f}};
    normals.back() = glm::normalize(glm::vec3(1e-4f, -1e-4f, -1.0f));
    for (int i = 0; i < 1000; ++i) normals.emplace_back(random.direction());
    for (const glm::vec3& n : normals) {
        const core::ShadingFrame frame = core::ShadingFrame::from_normal(n);
        // Rounding of a few products of numbers up to 1.
        EXPECT_NEAR(glm::dot(frame.tangent, frame.bitangent), 0.0f, 1e-6f);
        EXPECT_NEAR(glm::dot(frame.tangent, n), 0.0f, 1e-6f);
        EXPECT_NEAR(glm::length(frame.tangent), 1.0f, 1e-6f);
        expect_near(glm::cross(frame.tangent, frame.bitangent), n, 1e-6f);
        const glm::vec3 v(random.direction());
        expect_near(frame.to_world(frame.to_local(v)), v, 1e-6f);
        EXPECT_EQ(frame.normal, n);
    }
}

TEST(Surface, ShadingNormalsAreInterpolatedThroughTheInverseTranspose) {
    const glm::dmat4 matrix = translation({1, 2, 3}) * scaling({1.0, 3.0, -0.5});
    const core::Scene scene = scene_of(icosphere(4), matrix);
    TestRandom random(2);
    for (int i = 0; i < 50; ++i) {
        const glm::dvec3 unit = random.direction();
        const glm::dvec3 target(matrix * glm::dvec4(unit, 1.0));
        const glm::dvec3 normal = glm::normalize(glm::transpose(glm::dmat3(glm::inverse(matrix))) * unit);
        const glm::dvec3 origin = target + 2.0 * normal;
        const core::SurfacePoint point = surface_along(scene, make_ray(origin, -normal));
        // The chord of a facet of icosphere(4) is 4 degrees; linear interpolation of unit normals across it
        // and the facet's sag are off by under a tenth of a degree, stretched by up to 6.
        EXPECT_GT(glm::dot(glm::dvec3(point.frame.normal), normal), std::cos(0.6 * kDegree));
        EXPECT_LE(glm::distance(glm::dvec3(point.position), target), 0.01);
    }
}

TEST(Surface, BackFacesTurnTheShadingNormalRound) {
    const core::Scene scene = scene_of(icosphere(4));
    const core::SurfacePoint point = surface_along(scene, make_ray({0.1, 0.2, 0.0}, {0, 0, 1}));
    EXPECT_LT(point.frame.normal.z, -0.9f);
    EXPECT_LT(point.geometric_normal.z, -0.9f);
    // Leaving into the upper side means leaving inwards.
    EXPECT_LE(point.origin_above(0.01f).z, point.position.z - 0.0089f);
}

TEST(Surface, NormalsThatContradictTheWindingAreTurnedRound) {
    core::Scene scene = scene_of(quad());
    for (glm::vec3& normal : scene.meshes[0].normals) normal = -normal;
    const core::SurfacePoint point = surface_along(scene, make_ray({0.1, 0.2, 1.0}, {0, 0, -1}));
    expect_near(point.frame.normal, {0, 0, 1}, 1e-6f);
}

TEST(Surface, ShadingNormalsAlwaysFaceViewerAndGeometry) {
    // A coarse sphere seen at its rim, and normals bent by up to 70 degrees, are where they would not.
    core::Scene scene = scene_of(icosphere(1));
    TestRandom random(3);
    for (glm::vec3& normal : scene.meshes[0].normals) {
        normal = glm::normalize(normal + 2.5f * glm::vec3(random.direction()));
    }
    const core::TriangleTracer tracer(scene);
    const core::RayStream rays = random_lines(glm::dvec3(0.0), 1.0, 20000, 4);
    core::HitStream hits;
    tracer.trace_closest(rays, hits);
    int bent_count = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!hits.get(i).hit()) continue;
        const core::Ray ray = rays.get(i);
        const core::SurfacePoint point = core::surface_at(scene, ray, hits.get(i));
        const float to_viewer = glm::dot(point.frame.normal, -ray.direction);
        EXPECT_GT(to_viewer, 0.0f);
        EXPECT_GT(point.frame.to_local(-ray.direction).z, 0.0f);
        EXPECT_GT(glm::dot(point.frame.normal, point.geometric_normal), 0.0f);
        EXPECT_NEAR(glm::length(point.frame.normal), 1.0f, 1e-5f);
        bent_count += to_viewer < 1e-3f ? 1 : 0;
    }
    EXPECT_GT(bent_count, 100) << "the scene no longer exercises bending";
}

TEST(Surface, NormalMapsTiltAlongTheTangents) {
    const glm::vec3 tilted = glm::normalize(glm::vec3(0.5f, 0.3f, 1.0f));
    const core::Ray ray = make_ray({0.1, 0.2, 1.0}, {0, 0, -1});
    const core::SurfacePoint right = surface_along(normal_mapped_quad(tilted, glm::dmat4(1.0), 1.0f), ray);
    expect_near(right.frame.normal, tilted, kNormalMapStep);
    // Handedness -1: the bitangent points down.
    const core::SurfacePoint left = surface_along(normal_mapped_quad(tilted, glm::dmat4(1.0), -1.0f), ray);
    expect_near(left.frame.normal, {tilted.x, -tilted.y, tilted.z}, kNormalMapStep);
    // The geometric normal is not the map's business.
    expect_near(right.geometric_normal, {0, 0, 1}, 1e-6f);
}

TEST(Surface, NormalMapsFollowRotationsAndMirrors) {
    const glm::vec3 tilted = glm::normalize(glm::vec3(0.5f, 0.3f, 1.0f));
    for (const glm::dmat4& matrix :
         {rotation(0.7, {1, 2, 3}), scaling({-1, 1, 1}), scaling({1, -1, 1}),
          rotation(0.4, {2, 1, 0}) * scaling({1, 1, -1}), scaling(glm::dvec3(3.0))}) {
        const core::Scene scene = normal_mapped_quad(tilted, matrix, 1.0f);
        const glm::dvec3 target(matrix * glm::dvec4(0.1, 0.2, 0.0, 1.0));
        // An isometry (times a uniform scale) carries the tilted normal along as it carries any vector.
        const glm::dvec3 expected = glm::normalize(glm::dmat3(matrix) * glm::dvec3(tilted));
        const glm::dvec3 front = glm::normalize(glm::dmat3(matrix) * glm::dvec3(0, 0, 1));
        const core::SurfacePoint point = surface_along(scene, make_ray(target + front, -front));
        expect_near(point.frame.normal, glm::vec3(expected), kNormalMapStep);
        // From behind the whole normal is reversed.
        const core::SurfacePoint behind = surface_along(scene, make_ray(target - front, front));
        expect_near(behind.frame.normal, glm::vec3(-expected), kNormalMapStep);
    }
}

TEST(Surface, MaterialsAreSampledAtTheInterpolatedUvAndColour) {
    core::Scene scene = scene_of(quad(2.0f, 2.0f));
    const int texture = add_texture(
        scene, 2, 2, {{255, 0, 0, 255}, {0, 255, 0, 255}, {0, 0, 255, 255}, {255, 255, 255, 255}});
    scene.materials[0].base_color = glm::vec4(0.5f, 0.5f, 0.5f, 1.0f);
    scene.materials[0].base_color_texture.texture = texture;
    scene.materials[0].emission = glm::vec3(2.0f, 3.0f, 4.0f);
    scene.meshes[0].colors.assign(4, glm::vec4(0.4f, 0.6f, 0.8f, 1.0f));
    const auto color_at = [&](double x, double y) {
        return surface_along(scene, make_ray({x, y, 1.0}, {0, 0, -1})).base_color;
    };
    // v grows with y, and row 0 of the image is v = 0.
    expect_near(color_at(-0.5, -0.5), {0.2f, 0.0f, 0.0f}, 1e-6f);
    expect_near(color_at(0.5, -0.5), {0.0f, 0.3f, 0.0f}, 1e-6f);
    expect_near(color_at(-0.5, 0.5), {0.0f, 0.0f, 0.4f}, 1e-6f);
    expect_near(color_at(0.5, 0.5), {0.2f, 0.3f, 0.4f}, 1e-6f);
    const core::SurfacePoint point = surface_along(scene, make_ray({0.5, 0.5, 1.0}, {0, 0, -1}));
    EXPECT_EQ(point.emission, glm::vec3(2.0f, 3.0f, 4.0f));
    EXPECT_EQ(point.brdf.diffuse, core::make_brdf(core::sample_material(scene, scene.materials[0],
                                                                        {{glm::vec2(0.75f), glm::vec2(0.0f)},
                                                                         glm::vec4(0.4f, 0.6f, 0.8f, 1.0f)}))
                                      .diffuse);
}

TEST(Visibility, MaskComparesAlphaWithTheCutoff) {
    core::Scene scene = scene_of(quad());
    scene.materials[0].alpha_mode = core::AlphaMode::kMask;
    scene.materials[0].base_color.a = 0.6f;
    for (const float cutoff : {0.0f, 0.59f, 0.6f}) {
        scene.materials[0].alpha_cutoff = cutoff;
        EXPECT_TRUE(core::is_visible(scene, 0, 0, {0.2f, 0.3f}, 1));
        EXPECT_FALSE(core::has_alpha(scene));
    }
    for (const float cutoff : {0.61f, 1.1f}) {
        scene.materials[0].alpha_cutoff = cutoff;
        EXPECT_FALSE(core::is_visible(scene, 0, 0, {0.2f, 0.3f}, 1));
        EXPECT_TRUE(core::has_alpha(scene));
    }
}

TEST(Visibility, BlendShowsAShareAlphaOfSeedsInstancesAndTriangles) {
    core::Scene scene = scene_of(quad(1.0f, 1.0f, 40, 40));
    for (int i = 0; i < 9; ++i) add_instance(scene, 0);
    scene.materials[0].alpha_mode = core::AlphaMode::kBlend;
    for (const float alpha : {0.0f, 0.25f, 0.8f, 1.0f}) {
        scene.materials[0].base_color.a = alpha;
        EXPECT_EQ(core::has_alpha(scene), alpha < 1.0f);
        const auto expect_share = [&](int visible, int count) {
            // Five standard deviations of a binomial count.
            EXPECT_NEAR(visible, count * alpha, 5.0 * std::sqrt(count * alpha * (1.0 - alpha)));
        };
        int by_seed = 0, by_triangle = 0, by_instance = 0;
        for (std::uint32_t i = 0; i < 3000; ++i) {
            by_seed += core::is_visible(scene, 0, 0, {0.2f, 0.3f}, i);
            by_triangle += core::is_visible(scene, 0, i, {0.2f, 0.3f}, 9);
            by_instance += core::is_visible(scene, i % 10, i / 10, {0.2f, 0.3f}, 9);
        }
        expect_share(by_seed, 3000);
        expect_share(by_triangle, 3000);
        expect_share(by_instance, 3000);
    }
}

TEST(Visibility, OpaqueMaterialsShowWhateverTheirAlpha) {
    core::Scene scene = scene_of(quad());
    scene.materials[0].base_color.a = 0.0f;
    EXPECT_TRUE(core::is_visible(scene, 0, 0, {0.2f, 0.3f}, 1));
    EXPECT_FALSE(core::has_alpha(scene));
}

}  // namespace
}  // namespace tests
