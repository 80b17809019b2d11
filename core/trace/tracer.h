// core/trace/tracer.h: the one question every lighting pass asks: what does this ray hit?
//
// Distance fields and triangles answer through the same interface, so that every pass runs on either and the
// two can be compared ray by ray. A pass must not ask which tracer it was given.
#pragma once

#include <cstdint>
#include <span>

#include "core/trace/ray_stream.h"

namespace core {

/// A scene that rays can be traced through. Thread-safe: queries may run concurrently.
///
/// Visible: MASK materials are hit only where alpha reaches the cutoff; BLEND materials are hit with
/// probability alpha, decided by a hash of the ray's seed, the instance and the triangle, so that closest and
/// any-hit queries agree. Single-sided back faces are visible. Invalid rays (is_valid_ray) miss.
class Tracer {
public:
    virtual ~Tracer() = default;

    /// Finds the nearest visible surface along every ray. Resizes `hits` to rays.size().
    virtual void trace_closest(const RayStream& rays, HitStream& hits) const = 0;

    /// Sets occluded[i] to 1 if anything visible lies on rays[i] before its t_max, else to 0.
    /// @pre occluded.size() == rays.size()
    virtual void trace_occluded(const RayStream& rays, std::span<std::uint8_t> occluded) const = 0;

    /// How far off an exact surface point of `instance` a ray must start, in world units, for this
    /// tracer not to hit that surface again. For triangles: rounding error only.
    virtual float start_offset(std::uint32_t instance) const = 0;
};

}  // namespace core
