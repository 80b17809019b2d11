// tests/bench/bench_rays.h: the rays that benchmarks trace, the same for every tracer.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/trace/tracer.h"
#include "tests/bench/bench_meshes.h"

namespace tests {

/// Rays in pieces of kPieceRays, each small enough that it stays in the cache while it is traced.
struct BenchRays {
    std::vector<core::RayStream> pieces;
    bool is_occlusion = false;  ///< Asked whether, not where they hit.
    bool is_coherent = false;   ///< Neighbours in the stream start alike and go alike.

    std::size_t size() const;
};

inline constexpr std::size_t kPieceRays = 4096;

/// Where rays start, for all tracers alike.
struct BenchRayStarts {
    const core::Tracer& triangles;  ///< Finds the surfaces that rays leave.
    const core::Tracer& fields;     ///< Its offset counts too: the larger one is taken.
};

/// `primary`: one through each of side x side pixels, in Morton order, so that 16 neighbours are 4 x 4
/// pixels. `bounce`: from where these hit, cosine-distributed, shuffled. `occlusion`: from there, in the
/// pixels' order, to a random point above the surface within a tenth of the scene's diagonal. Sets have
/// side^2 rays. @pre side is a power of two, at least 4
/// @throws core::InputError (kUsage) for other kinds
BenchRays make_bench_rays(const std::string& kind, const BenchScene& scene, const BenchRayStarts& starts,
                          int side);

}  // namespace tests
