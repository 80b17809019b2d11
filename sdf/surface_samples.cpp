#include "sdf/surface_samples.h"

#include <algorithm>
#include <cmath>

namespace sdf {

SurfaceSamples::SurfaceSamples(const std::vector<Triangle>& triangles, std::size_t count)
    : triangles_(triangles), count_(count), cumulative_(triangles.size()) {
    double total = 0.0;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        total += 0.5 * glm::length(triangles[i].scaled_normal());
        cumulative_[i] = total;
    }
}

SurfaceSample SurfaceSamples::at(std::size_t index) const {
    const double i = static_cast<double>(index);
    const double target = (i + 0.5) / static_cast<double>(count_) * area();
    const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, target);
    const auto number = static_cast<std::size_t>(found - cumulative_.begin());
    const Triangle& triangle = triangles_[number];
    // The additive recurrence of the plastic number, folded into the triangle.
    double u = std::fmod(0.5 + i * 0.7548776662466927, 1.0);
    double v = std::fmod(0.5 + i * 0.5698402909980532, 1.0);
    if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
    }
    return {triangle.a + u * (triangle.b - triangle.a) + v * (triangle.c - triangle.a),
            glm::normalize(triangle.scaled_normal()), number};
}

}  // namespace sdf
