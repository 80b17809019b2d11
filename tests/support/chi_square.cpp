#include "tests/support/chi_square.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/trace/surface.h"
#include "tests/support/analytic_scenes.h"

namespace tests {

double sidak_alpha(double family_alpha, int test_count) {
    return 1.0 - std::pow(1.0 - family_alpha, 1.0 / test_count);
}

double chi_square_p_value(const std::vector<double>& observed, const std::vector<double>& expected) {
    double statistic = 0.0;
    double pooled_observed = 0.0, pooled_expected = 0.0;
    int cells = 0;
    for (std::size_t i = 0; i < observed.size(); ++i) {
        if (expected[i] < 5.0) {
            pooled_observed += observed[i];
            pooled_expected += expected[i];
            continue;
        }
        const double difference = observed[i] - expected[i];
        statistic += difference * difference / expected[i];
        ++cells;
    }
    if (pooled_expected > 0.0 || pooled_observed > 0.0) {
        const double difference = pooled_observed - pooled_expected;
        statistic += difference * difference / std::max(pooled_expected, 1.0);
        ++cells;
    }
    if (cells < 2) return 0.0;
    return boost::math::gamma_q(0.5 * (cells - 1), 0.5 * statistic);
}

double chi_square_p_value(const DirectionSampler& sampler, const DirectionPdf& pdf,
                          const ChiSquareSettings& settings) {
    const int rows = settings.polar_cells;
    const int columns = settings.azimuth_cells;
    const core::ShadingFrame frame = core::ShadingFrame::from_normal(settings.axis);
    const std::size_t cell_count = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
    std::vector<double> observed(cell_count + 1, 0.0), expected(cell_count + 1, 0.0);

    TestRandom random(1234);
    for (std::size_t i = 0; i < settings.sample_count; ++i) {
        const glm::vec2 u(static_cast<float>(random.uniform() * 0.99999994),
                          static_cast<float>(random.uniform() * 0.99999994));
        const std::optional<glm::vec3> direction =
            sampler(u, static_cast<float>(random.uniform() * 0.99999994));
        if (!direction) {
            observed[cell_count] += 1.0;
            continue;
        }
        const glm::vec3 local = frame.to_local(*direction);
        const double height = std::clamp(0.5 * (1.0 - static_cast<double>(local.z)), 0.0, 1.0);
        double turn =
            std::atan2(static_cast<double>(local.y), static_cast<double>(local.x)) / (2.0 * std::numbers::pi);
        if (turn < 0.0) turn += 1.0;
        const int row = std::min(static_cast<int>(height * rows), rows - 1);
        const int column = std::min(static_cast<int>(turn * columns), columns - 1);
        observed[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(column)] += 1.0;
    }

    double total = 0.0;
    const int points = settings.integration_points;
    const double point_area =
        4.0 * std::numbers::pi / (static_cast<double>(rows) * columns * points * points);
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            double sum = 0.0;
            for (int i = 0; i < points; ++i) {
                for (int j = 0; j < points; ++j) {
                    const double z = 1.0 - 2.0 * (row + (i + 0.5) / points) / rows;
                    const double angle = 2.0 * std::numbers::pi * (column + (j + 0.5) / points) / columns;
                    const double radius = std::sqrt(std::max(0.0, 1.0 - z * z));
                    sum += pdf(glm::normalize(
                        frame.to_world(glm::vec3(radius * std::cos(angle), radius * std::sin(angle), z))));
                }
            }
            const double probability = sum * point_area;
            total += probability;
            expected[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                     static_cast<std::size_t>(column)] =
                probability * static_cast<double>(settings.sample_count);
        }
    }
    expected[cell_count] = std::max(0.0, 1.0 - total) * static_cast<double>(settings.sample_count);
    return chi_square_p_value(observed, expected);
}

}  // namespace tests
