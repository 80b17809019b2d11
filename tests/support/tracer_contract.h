// tests/support/tracer_contract.h: what every core::Tracer must do, as one suite that each tracer is run
// through.
//
//     INSTANTIATE_TEST_SUITE_P(Triangles, TracerContract, contract_of({{"embree", make, ...}}),
//     factory_name);
//
// Expected answers are formulas evaluated in double in the mesh's own space, where the parameter t of a ray
// is the same as in the world.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace tests {

/// A tracer under contract, and how exact it claims to be.
struct TracerFactory {
    std::string name;  ///< Letters and digits.
    std::function<std::unique_ptr<core::Tracer>(const core::Scene&)> make;
    /// How far a hit on a flat or gently curved part may lie off the surface, as a part of the longest side
    /// of the mesh's local box; 0: rounding alone.
    double position_tolerance = 0.0;
    /// How far the normal there may be off, in degrees.
    double normal_tolerance_degrees = 0.1;
    /// How far from edges, as a part of the longest side, those two hold.
    double edge_margin = 0.0;
    /// Whether a ray's answer is bitwise the same whatever rays are beside it.
    bool independent_of_neighbours = true;
    /// Whether the lowest of several coincident instances is hit.
    bool lowest_instance_wins = true;

    friend std::ostream& operator<<(std::ostream& stream, const TracerFactory& factory) {
        return stream << factory.name;
    }
};

class TracerContract : public ::testing::TestWithParam<TracerFactory> {
protected:
    const TracerFactory& factory() const { return GetParam(); }
    std::unique_ptr<core::Tracer> make(const core::Scene& scene) const { return factory().make(scene); }

    /// Distance off the surface allowed in local space: the tracer's claim plus the rounding of floats
    /// (8 ulp) at coordinates as large as `magnitude`.
    double allowed(const core::Mesh& mesh, double magnitude) const;

    /// Traces both queries and fails if they disagree on any ray.
    core::HitStream trace(const core::Tracer& tracer, const core::RayStream& rays) const;

    /// Checks one hit against the local ray parameter and the local outward unit normal it should have:
    /// status, distance along the normal, direction and unit length of the world normal, side.
    void expect_hit(const core::Scene& scene, const core::Ray& ray, const core::Hit& hit,
                    std::uint32_t instance, double t_low, double t_high, const glm::dvec3& local_normal,
                    double curvature_degrees = 0.0) const;
};

/// The argument of INSTANTIATE_TEST_SUITE_P.
::testing::internal::ParamGenerator<TracerFactory> contract_of(std::vector<TracerFactory> factories);

/// Names the instantiated tests.
std::string factory_name(const ::testing::TestParamInfo<TracerFactory>& info);

/// A ray in an instance's local space; the direction is not unit, so that t is shared with the world.
struct LocalRay {
    glm::dvec3 origin{0.0};
    glm::dvec3 direction{0.0};
};
LocalRay to_local(const core::Instance& instance, const core::Ray& ray);

}  // namespace tests
