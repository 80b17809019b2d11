#include "sdf/transform_scale.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace sdf {

double largest_singular_value(const glm::dmat3& matrix) {
    // The largest eigenvalue of M^T M in closed form (Smith, "Eigenvalues of a Symmetric 3x3 Matrix",
    // Communications of the ACM 1961), scaled first so that squares neither overflow nor vanish.
    double largest = 0.0;
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(matrix[column][row]));
    }
    if (largest == 0.0) return 0.0;
    const glm::dmat3 scaled = matrix / largest;
    const glm::dmat3 a = glm::transpose(scaled) * scaled;
    const double mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
    const double off = a[1][0] * a[1][0] + a[2][0] * a[2][0] + a[2][1] * a[2][1];
    const glm::dvec3 diagonal(a[0][0] - mean, a[1][1] - mean, a[2][2] - mean);
    const double p = std::sqrt((glm::dot(diagonal, diagonal) + 2.0 * off) / 6.0);
    if (p <= 1e-16 * mean) return largest * std::sqrt(mean);
    const glm::dmat3 b = (a - mean * glm::dmat3(1.0)) / p;
    const double r = std::clamp(0.5 * glm::determinant(b), -1.0, 1.0);
    const double eigenvalue = mean + 2.0 * p * std::cos(std::acos(r) / 3.0);
    return largest * std::sqrt(eigenvalue);
}

}  // namespace sdf
