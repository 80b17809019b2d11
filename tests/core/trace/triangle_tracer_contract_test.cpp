#include "core/trace/triangle_tracer.h"
#include "tests/support/tracer_contract.h"

namespace tests {
namespace {

TracerFactory triangles(const std::string& name, const core::TriangleTracerOptions& options) {
    TracerFactory factory;
    factory.name = name;
    factory.make = [options](const core::Scene& scene) -> std::unique_ptr<core::Tracer> {
        return std::make_unique<core::TriangleTracer>(scene, options);
    };
    // Packet kernels leave the last bits, and ties, to the rays beside a ray.
    factory.independent_of_neighbours = false;
    factory.lowest_instance_wins = false;
    return factory;
}

INSTANTIATE_TEST_SUITE_P(
    Triangles, TracerContract,
    contract_of({triangles("Default", {}),
                 triangles("TwoLevels", {.packet_width = 0, .instruction_set = {}, .flatten = false}),
                 triangles("OneByOne", {.packet_width = 1, .instruction_set = {}, .flatten = false}),
                 triangles("PacketsOfFourOnSse",
                           {.packet_width = 4, .instruction_set = "sse4.2", .flatten = true}),
                 triangles("PacketsOfEight", {.packet_width = 8, .instruction_set = {}, .flatten = true})}),
    factory_name);

}  // namespace
}  // namespace tests
