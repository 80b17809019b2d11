// core/image/flip_map.h: the per-pixel error of LDR FLIP, the part that flip_ldr and flip_hdr share.
//
// All filters are sums of separable ones, so that they run along rows, then along columns; the published code
// convolves with the full kernels. Borders are replicated.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace core {

/// Weights of a filter along one axis, over offsets -radius to radius.
struct FlipKernel {
    std::vector<float> weights;

    int radius() const { return static_cast<int>(weights.size() / 2); }
};

/// What an observer at some distance cannot resolve, and what catches the eye. Colours are in YCxCz.
struct FlipFilters {
    /// @pre pixels_per_degree >= 1
    explicit FlipFilters(double pixels_per_degree);

    /// Contrast sensitivity: normalised Gaussians for Y, Cx, and two for Cz, which are added with weights.
    FlipKernel achromatic, red_green, blue_yellow[2];
    float blue_yellow_weights[2];
    /// Feature detectors on Y: a Gaussian and its first and second derivative; positive and negative weights
    /// sum to 1 and -1 each.
    FlipKernel smooth, edge, point;
};

/// Compares pictures of one size; keeps its memory between calls.
class FlipMapper {
public:
    /// @pre width > 0, height > 0
    FlipMapper(int width, int height, double pixels_per_degree);

    /// Raises each value of `map` to the LDR FLIP error of its pixel where that is larger. Runs in parallel
    /// over rows. @pre all three have width * height values; colours are linear RGB in [0, 1]
    void raise(std::span<const glm::vec3> test, std::span<const glm::vec3> reference, std::span<float> map);

private:
    /// One picture, filtered along rows: Y, Cx, Cz (two ways) by contrast sensitivity, then Y by the feature
    /// detectors.
    struct Planes {
        std::vector<float> achromatic, red_green, blue_yellow[2], smooth, edge, point;
    };
    struct FilteredRow;

    void filter_rows(std::span<const glm::vec3> picture, Planes& planes) const;
    void filter_columns(const Planes& planes, int y, FilteredRow& row) const;
    void filter_column(const std::vector<float>& plane, const FlipKernel& kernel, int y,
                       std::vector<float>& row) const;

    int width_, height_;
    FlipFilters filters_;
    int padding_;  ///< The largest radius.
    Planes test_, reference_;
};

}  // namespace core
