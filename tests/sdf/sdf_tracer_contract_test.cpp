#include <utility>

#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"
#include "tests/support/tracer_contract.h"

namespace tests {
namespace {

constexpr int kResolution = 96;

TracerFactory distance_fields() {
    TracerFactory factory;
    factory.name = "DistanceFields";
    factory.make = [](const core::Scene& scene) -> std::unique_ptr<core::Tracer> {
        sdf::BakeSettings settings;
        settings.resolution = kResolution;
        return std::make_unique<sdf::SdfTracer>(
            scene, sdf::grids_by_mesh(scene, sdf::bake_scene(scene, settings, {})));
    };
    // A trilinear cell lies off a surface of radius r voxels by up to 1 / 8r voxels along each of two axes;
    // the most curved surface of the suite has a radius of 10 voxels, and its facets' creases add as much
    // again.
    factory.position_tolerance = 0.05 / kResolution;
    // Central differences turn the normal of a facet's crease into an arc two voxels wide.
    factory.normal_tolerance_degrees = 2.0;
    // Differences reach two cells.
    factory.edge_margin = 2.5 / kResolution;
    return factory;
}

INSTANTIATE_TEST_SUITE_P(DistanceFields, TracerContract, contract_of({distance_fields()}), factory_name);

}  // namespace
}  // namespace tests
