// cli/ladder.h: every method at 1, 2, 4, ... samples a pixel (frames of the gather): what it cost and how far
// off it was.
#pragma once

#include <cstdint>
#include <vector>

#include "cli/comparison_methods.h"

namespace cli {

/// How the ladder is climbed.
struct LadderSettings {
    int max_samples = 64;              ///< Rungs are the powers of two up to it.
    std::uint64_t seed = 0;            ///< Of the first rung; each rung adds one.
    double time_budget_seconds = 0.0;  ///< See CompareSceneOptions.
};

/// Renders all rungs and fills points, stages and last picture of each method. One render a method is thrown
/// away first, to warm up; then the methods take turns, another one first on every rung.
/// @param reference R, G, B and Variance
/// @throws core::InputError, core::Interrupted; std::runtime_error if a value is not finite
void climb_ladder(const Program& program, const LadderSettings& settings, const core::Scene& scene,
                  const core::Camera& camera, const core::Image& reference, std::vector<Method>& methods);

}  // namespace cli
