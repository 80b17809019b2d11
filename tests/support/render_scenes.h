// tests/support/render_scenes.h: scenes whose picture is known by formula, and a short way to render them.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "core/render/path_tracer.h"
#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace tests {

/// A closed Lambert sphere about the origin that emits 1 - rho: seen from inside its radiance is 1
/// everywhere.
core::Scene furnace(float rho);

/// A closed Lambert sphere of Kd 0.5 and radius 1 with a point light of pi cd in its centre: radiance 1.
core::Scene lamp_in_sphere();

/// A room of coloured Lambert walls with two boxes, an area light, a point light and a constant sky through
/// an open side: every kind of light at once. @param intensity scales all of them.
core::Scene mixed_room(float intensity = 1.0f);

/// The same room with the area light alone.
core::Scene area_lit_room();

/// A sky of radiance 1 with a spot of half a steradian that is thirty times as bright.
core::Sky peaked_sky();

/// A camera inside a closed sphere, off centre.
core::Camera inside_camera();
core::Camera room_camera();

struct RenderRequest {
    int width = 16;
    int height = 16;
    int samples_per_pixel = 64;
    int bounces = -1;
    std::uint64_t seed = 1;
    bool light_sampling = true;
    std::set<std::string> aovs = {};
    double time_budget_seconds = 0.0;
    const core::Tracer* tracer = nullptr;  ///< Also of what is seen; null: triangles.
};

/// Path-traces.
core::Frame render(const core::Scene& scene, const core::Camera& camera, const RenderRequest& request = {});

/// Mean of the beauty over pixels and channels.
double mean_radiance(const core::Image& image);

/// Mean over pixels and channels of (a - b)^2.
double mean_squared_error(const core::Image& a, const core::Image& b);

}  // namespace tests
