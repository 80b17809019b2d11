// core/trace/triangle_tracer.h: exact triangles on Embree, the tracer that the others are judged by.
//
// Wald et al., "Embree: A Kernel Framework for Efficient CPU Ray Tracing", TOG 2014. Streams are cut into
// packets of the widest kind the processor has. Which of two coincident surfaces wins, and the last bits of t
// and the barycentrics, may depend on the instruction set and on a ray's neighbours in its packet; for the
// same stream the answer is always the same, at any thread count.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace core {

/// How to trace, never what: hits differ by rounding at most.
struct TriangleTracerOptions {
    int packet_width = 0;         ///< 1, 4, 8 or 16 rays; 0: what the processor does natively.
    std::string instruction_set;  ///< Embree's names, such as "sse4.2" or "avx2"; empty: the best there is.
    /// Builds meshes that are cheap to repeat into one level in world space, which spares every ray the
    /// change of space.
    bool flatten = true;
};

/// Two levels: one tree a mesh, one tree over instances.
///
/// Instances may be scaled by 1e-12 to 1e12, and by no less than 1e-17 of the world's size: beyond that
/// floats leave their range. Rays that start farther off than 1e17 times the smallest such scale miss. A
/// negative t_min counts as 0. A triangle without area (collinear corners) is never hit.
class TriangleTracer : public Tracer {
public:
    /// Builds the trees, in parallel. Keeps a reference: `scene` must outlive the tracer and not change.
    /// @throws InputError (kOutOfMemory) if Embree runs out of memory, (kBadData, naming it) for an instance
    /// whose scale is out of range, (kUsage) for options that this processor or build cannot meet.
    explicit TriangleTracer(const Scene& scene, const TriangleTracerOptions& options = {});
    ~TriangleTracer() override;

    void trace_closest(const RayStream& rays, HitStream& hits) const override;
    void trace_occluded(const RayStream& rays, std::span<std::uint8_t> occluded) const override;
    float start_offset(std::uint32_t instance) const override;

    /// Memory held by the trees and tables, the scene not counted.
    std::size_t bytes() const;

    /// Rays traced together.
    int packet_width() const;

private:
    struct Impl;
    std::unique_ptr<const Impl> impl_;
};

}  // namespace core
