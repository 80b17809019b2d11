// tests/bench/bench_meshes.h: generated scenes for benchmarks, the same on every machine.
//
// All meshes are closed and thick against a voxel at 64, so that fields hold them without shells and what is
// measured is the marching of rays.
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace tests {

/// A scene and where a picture of it is taken from.
struct BenchScene {
    std::string name;
    core::Scene scene;
    glm::dvec3 eye{0.0};
    glm::dvec3 target{0.0};
    double field_of_view = 0.9;  ///< Whole angle, radians.
};

/// An icosphere of 20 x 4^level triangles about the origin, displaced along its normals by bumps of a few
/// sizes. Level 7: 327,680 triangles.
core::Mesh blob_mesh(int level);

/// A hall of 20 x 8 x 12 without a roof: thick walls, two rows of fluted columns, arches between them, boxes
/// and balls on the floor; about 55,000 triangles in one mesh.
core::Mesh hall_mesh();

/// By name: `blob`, `hall`, or `crowd` and a number of overlapping instances, randomly turned and unequally
/// scaled, of one blob of 20,480 triangles.
/// @throws core::InputError (kUsage) for other names
BenchScene make_bench_scene(const std::string& name);

}  // namespace tests
