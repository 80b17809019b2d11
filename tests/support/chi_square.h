// tests/support/chi_square.h: does a sampler follow the density it claims?
//
// Pearson's test over a grid of cells. Expected counts come from integrating the claimed density over each
// cell, so that the sampler and the density are checked against each other and against being normalised.
#pragma once

#include <cstddef>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

namespace tests {

/// Significance of one test in a family of `test_count` that together raise a false alarm with probability
/// `family_alpha` (Sidak's correction).
double sidak_alpha(double family_alpha, int test_count);

/// A sampler of directions: u in [0, 1)^2 and a third number in [0, 1) to a direction, or nothing.
using DirectionSampler = std::function<std::optional<glm::vec3>(const glm::vec2& u, float u_extra)>;
using DirectionPdf = std::function<double(const glm::vec3& direction)>;

struct ChiSquareSettings {
    std::size_t sample_count = 1'000'000;
    int polar_cells = 40;
    int azimuth_cells = 80;
    int integration_points = 8;        ///< A side of each cell, midpoint rule; sharp densities need more.
    glm::vec3 axis{0.0f, 0.0f, 1.0f};  ///< Pole of the grid of cells.
};

/// Probability that a sampler which does follow `pdf` gives counts at least as far off. Samples that return
/// nothing are a cell of their own, whose expected count is what the density lacks to 1.
double chi_square_p_value(const DirectionSampler& sampler, const DirectionPdf& pdf,
                          const ChiSquareSettings& settings = {});

/// The same for counts at hand. Cells that expect fewer than 5 are pooled.
double chi_square_p_value(const std::vector<double>& observed, const std::vector<double>& expected);

}  // namespace tests
