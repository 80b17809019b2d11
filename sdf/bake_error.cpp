#include "sdf/bake_error.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/support/parallel.h"
#include "sdf/surface_samples.h"

namespace sdf {

namespace {

constexpr std::size_t kMostSamples = 100'000, kFewestSamples = 2'000;

/// As many points as a small surface needs: this many a square voxel.
constexpr double kSamplesPerArea = 2.0;

/// An error so large that the point may be buried in another solid.
constexpr double kSuspectVoxels = 0.5;

double error_at(const SurfaceSample& sample, bool inflated, const WindingNumber& winding,
                const LeafMap& field) {
    double value = 0.0;
    if (!field.interpolate(sample.position, value)) return kBandVoxels;
    double error = std::abs(value);
    if (inflated) error = std::min(error, std::abs(error - kHalfThicknessVoxels));
    if (error > kSuspectVoxels) {
        const glm::dvec3 step = 0.25 * sample.normal;
        if (winding.is_inside(sample.position + step) && winding.is_inside(sample.position - step)) {
            return -1.0;
        }
    }
    return error;
}

std::size_t sample_count(const std::vector<Triangle>& corners) {
    double area = 0.0;
    for (const Triangle& triangle : corners) area += 0.5 * glm::length(triangle.scaled_normal());
    return static_cast<std::size_t>(std::clamp(kSamplesPerArea * area, static_cast<double>(kFewestSamples),
                                               static_cast<double>(kMostSamples)));
}

}  // namespace

ErrorFigures measure_error(const std::vector<Triangle>& corners, const std::vector<Feature>& features,
                           const WindingNumber& winding, const LeafMap& field) {
    const SurfaceSamples samples(corners, sample_count(corners));
    std::vector<double> errors(sample_count(corners));
    core::parallel_for(errors.size(), 512, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const SurfaceSample sample = samples.at(i);
            errors[i] = error_at(sample, features[sample.triangle] != Feature::kSurface, winding, field);
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
