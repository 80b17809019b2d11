// tests/support/sheet_rays.h: rays aimed at the inside of open sheets, which none may pass.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <memory>
#include <vector>

#include "core/scene/scene.h"
#include "core/trace/ray_stream.h"
#include "core/trace/tracer.h"
#include "sdf/brick_grid.h"
#include "sdf/triangle_bvh.h"

namespace tests {

class TestRandom;

/// Rays and what each is aimed at.
struct AimedRays {
    core::RayStream rays;
    std::vector<float> target;  ///< Where each ray meets the triangle it is aimed at, by double precision.
    std::vector<float> voxel;   ///< A voxel of that mesh along the ray, as a length of the ray.
};

/// The sheets of a scene as its fields know them, away from their borders.
class SheetTargets {
public:
    /// @param grids by mesh index; both must outlive this
    SheetTargets(const core::Scene& scene, const std::vector<std::shared_ptr<const sdf::BrickGrid>>& grids);

    bool empty() const { return instances_.empty(); }

    /// Rays to random points of sheets at least a voxel from every border, from random directions and so from
    /// both sides, starting between one and a half voxels and the size of the scene away. Half of the points
    /// are spread by area, half fall on every connected part of a mesh alike; points serve several times
    /// where most of the area lies at borders. Rays that rounding makes miss their triangle are left out, so
    /// that each is one that must not pass. Empty where no point is off the borders.
    AimedRays aim(std::size_t count, std::uint32_t seed) const;

private:
    struct Target {
        std::uint32_t instance = 0;
        std::uint32_t triangle = 0;  ///< Of its SheetMesh.
        glm::dvec3 point{0.0};       ///< Local.
    };
    std::vector<Target> targets(std::size_t count, TestRandom& random) const;

    /// One mesh's sheets, local units.
    struct SheetMesh {
        std::vector<sdf::Triangle> triangles;
        std::vector<double> cumulative;    ///< Chance of a point in each triangle up to and with it.
        sdf::TriangleBvh borders{{}, {}};  ///< Edges as triangles without area.
        double voxel = 0.0;
    };
    SheetMesh sheets_of(const core::Mesh& mesh, const sdf::BrickGrid& grid) const;

    const core::Scene& scene_;
    double size_ = 0.0;
    std::vector<SheetMesh> meshes_;         ///< By mesh index.
    std::vector<std::uint32_t> instances_;  ///< Those that have sheets.
};

/// What came of aimed rays.
struct SheetPassages {
    std::size_t rays = 0;
    std::size_t unconfirmed = 0;  ///< The judge, in floats, meets nothing up to a voxel past the point.
    std::size_t passed = 0;       ///< Of the others: met nothing up to a voxel past the point.
    std::size_t unoccluded = 0;   ///< Likewise by the other query.
    std::size_t early = 0;        ///< Met something more than a voxel before the judge does.
    std::vector<std::size_t> first_passed;  ///< A few of those that passed.

    friend std::ostream& operator<<(std::ostream& stream, const SheetPassages& passages);
};

/// Traces the rays through `tracer`, and through `judge` on the same triangles.
SheetPassages count_passages(const AimedRays& aimed, const core::Tracer& tracer, const core::Tracer& judge);

/// The scene with every material opaque: what is asked for is its shape alone.
core::Scene without_alpha(core::Scene scene);

}  // namespace tests
