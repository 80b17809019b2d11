// sdf/surface_samples.h: points spread evenly over the area of triangles, the same ones every time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "sdf/triangle_bvh.h"

namespace sdf {

struct SurfaceSample {
    glm::dvec3 position{0.0};
    glm::dvec3 normal{0.0};  ///< Unit, of the triangle.
    std::size_t triangle = 0;
};

/// `count` points: stratified over the total area, by a low-discrepancy sequence within triangles.
class SurfaceSamples {
public:
    /// @param triangles must outlive this; each with an area.
    SurfaceSamples(const std::vector<Triangle>& triangles, std::size_t count);

    /// Point `index` of `count`.
    SurfaceSample at(std::size_t index) const;

    double area() const { return cumulative_.back(); }

private:
    const std::vector<Triangle>& triangles_;
    std::size_t count_;
    std::vector<double> cumulative_;  ///< Area up to and with each triangle.
};

}  // namespace sdf
