// Direct light of an area lamp against the closed form for a polygon (Lambert, "Photometria", 1760). It
// settles who is right where renderers differ: Blender 3.4 is up to 3 % too dark here when the lamp is two
// triangles.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "core/scene/camera.h"
#include "core/scene/gltf_loader.h"
#include "tests/support/render_scenes.h"
#include "tests/support/shared_data.h"

namespace {

/// Share of a surface element's cosine-weighted sky that a convex polygon in front of it covers.
double form_factor(const glm::dvec3& position, const glm::dvec3& normal,
                   const std::array<glm::dvec3, 4>& polygon) {
    double sum = 0.0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec3 a = glm::normalize(polygon[i] - position);
        const glm::dvec3 b = glm::normalize(polygon[(i + 1) % polygon.size()] - position);
        sum += std::acos(glm::dot(a, b)) * glm::dot(glm::normalize(glm::cross(a, b)), normal);
    }
    return std::abs(sum) / (2.0 * std::numbers::pi);
}

struct Spot {
    glm::dvec3 position;
    glm::dvec3 normal;
    double rho;  ///< Red, as in assets/make_assets.py.
};

TEST(PathTracer, LightsTheCornellBoxByTheFormFactorOfItsLamp) {
    const core::Scene scene = core::load_gltf(tests::assets_folder() / "cornell_box.glb");
    const double lamp_radiance = 12000.0;
    const std::array<glm::dvec3, 4> lamp = {
        {{-0.65, 5.468, -0.525}, {0.65, 5.468, -0.525}, {0.65, 5.468, 0.525}, {-0.65, 5.468, 0.525}}};
    const glm::dvec3 eye(0.0, 4.0, 2.5);
    for (const Spot& spot :
         {Spot{{0.0, 5.2, -2.796}, {0, 0, 1}, 0.73}, Spot{{1.2, 4.0, -2.796}, {0, 0, 1}, 0.73},
          Spot{{-2.0, 5.0, -2.796}, {0, 0, 1}, 0.73}, Spot{{-2.764, 4.5, -0.5}, {1, 0, 0}, 0.62}}) {
        // Half a degree sees some 4 cm, over which the closed form bends by less than 1e-3.
        const core::Camera camera =
            core::look_at(eye, spot.position, {0, 1, 0}, 0.5 * std::numbers::pi / 180.0);
        const core::Frame frame =
            tests::render(scene, camera, {.width = 8, .height = 8, .samples_per_pixel = 256, .bounces = 0});
        double mean = 0.0;
        for (const float red : *frame.image.find("R")) mean += static_cast<double>(red);
        mean /= static_cast<double>(frame.image.pixel_count());
        const double exact = spot.rho * lamp_radiance * form_factor(spot.position, spot.normal, lamp);
        // 16,384 samples whose scatter is under half their mean: 0.4 % at one standard error, less with
        // low-discrepancy points.
        EXPECT_NEAR(mean / exact, 1.0, 0.01) << spot.position.x << ", " << spot.position.y;
    }
}

}  // namespace
