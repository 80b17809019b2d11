#include "sdf/bake_error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/support/parallel.h"

namespace sdf {

namespace {

constexpr std::size_t kSampleCount = 100'000;

/// An error so large that the point may be buried in another solid.
constexpr double kSuspectVoxels = 0.5;

double error_at(const glm::dvec3& point, const Triangle& triangle, bool inflated,
                const WindingNumber& winding, const LeafMap& field) {
    double value = 0.0;
    if (!field.interpolate(point, value)) return kBandVoxels;
    double error = std::abs(value);
    if (inflated) error = std::min(error, std::abs(error - kHalfThicknessVoxels));
    if (error > kSuspectVoxels) {
        const glm::dvec3 step = 0.25 * glm::normalize(triangle.scaled_normal());
        if (winding.is_inside(point + step) && winding.is_inside(point - step)) return -1.0;
    }
    return error;
}

}  // namespace

ErrorFigures measure_error(const std::vector<Triangle>& corners, const std::vector<std::uint8_t>& inflated,
                           const WindingNumber& winding, const LeafMap& field) {
    std::vector<double> cumulative(corners.size());
    double total = 0.0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        total += glm::length(corners[i].scaled_normal());
        cumulative[i] = total;
    }
    std::vector<double> errors(kSampleCount);
    core::parallel_for(kSampleCount, 512, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const double target = (static_cast<double>(i) + 0.5) / kSampleCount * total;
            const auto found = std::upper_bound(cumulative.begin(), cumulative.end() - 1, target);
            const auto number = static_cast<std::size_t>(found - cumulative.begin());
            const Triangle& triangle = corners[number];
            // The additive recurrence of the plastic number, folded into the triangle.
            double u = std::fmod(0.5 + static_cast<double>(i) * 0.7548776662466927, 1.0);
            double v = std::fmod(0.5 + static_cast<double>(i) * 0.5698402909980532, 1.0);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            errors[i] = error_at(triangle.a + u * (triangle.b - triangle.a) + v * (triangle.c - triangle.a),
                                 triangle, inflated[number] != 0, winding, field);
        }
    });
    std::erase_if(errors, [](double error) { return error < 0.0; });
    if (errors.empty()) return {};
    std::sort(errors.begin(), errors.end());
    ErrorFigures figures;
    figures.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size());
    figures.p99 = errors[std::min(errors.size() - 1, errors.size() * 99 / 100)];
    figures.max = errors.back();
    return figures;
}

}  // namespace sdf
