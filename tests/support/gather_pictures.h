// tests/support/gather_pictures.h: a short way to gather a scene's picture, and to compare two bit by bit.
//
// Inline, so that the tests of lower layers do not link the gather.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "core/scene/scene_loader.h"
#include "core/trace/triangle_tracer.h"
#include "gather/final_gather.h"
#include "tests/support/shared_data.h"

namespace tests {

/// A bundled scene. @param name without `.glb`
inline core::Scene asset(const std::string& name) {
    return core::load_scene_file(assets_folder() / (name + ".glb"), {});
}

/// The first camera of the scene, or one that frames it.
inline core::Camera camera_of(const core::Scene& scene) {
    return scene.cameras.empty() ? core::framing(core::world_bounds(scene), 4.0 / 3.0)
                                 : scene.cameras.front();
}

/// What a pass of the gather reads, of a picture of `size` x `size` pixels. Keeps references.
inline core::RenderInputs pass_inputs(const core::Scene& scene, const core::Tracer& tracer,
                                      const core::Camera& camera, int size = 1) {
    return {.scene = scene,
            .camera = camera,
            .tracer = tracer,
            .primary = tracer,
            .width = size,
            .height = size,
            .crop = {},
            .seed = 1,
            .aovs = {},
            .progress = {},
            .stop_requested = {}};
}

struct GatherRequest {
    int width = 64;
    int height = 48;
    std::uint64_t seed = 3;
    std::set<std::string> aovs = {};
    const core::Tracer* tracer = nullptr;  ///< Also of what is seen; null: triangles.
};

struct GatherPicture {
    gather::Plan plan;
    core::Frame frame;
};

/// @param effects as of `--effects`
inline GatherPicture gather_picture(const core::Scene& scene, const core::Camera& camera,
                                    const gather::Settings& settings, const std::string& effects,
                                    const GatherRequest& request = {}) {
    std::optional<core::TriangleTracer> triangles;
    const core::Tracer& tracer = request.tracer ? *request.tracer : triangles.emplace(scene);
    GatherPicture picture;
    picture.plan = gather::make_plan(scene, request.width, request.height, settings,
                                     gather::parse_effects(effects), request.aovs);
    picture.frame = gather::FinalGather(settings, picture.plan)
                        .render({.scene = scene,
                                 .camera = camera,
                                 .tracer = tracer,
                                 .primary = tracer,
                                 .width = request.width,
                                 .height = request.height,
                                 .crop = {},
                                 .seed = request.seed,
                                 .aovs = request.aovs,
                                 .progress = {},
                                 .stop_requested = {}});
    return picture;
}

/// Every channel of both, bit by bit.
inline void expect_same_bits(const core::Image& a, const core::Image& b) {
    ASSERT_EQ(a.channels().size(), b.channels().size());
    for (std::size_t i = 0; i < a.channels().size(); ++i) {
        EXPECT_EQ(a.channels()[i].name, b.channels()[i].name);
        EXPECT_EQ(a.channels()[i].values, b.channels()[i].values) << a.channels()[i].name;
    }
}

}  // namespace tests
