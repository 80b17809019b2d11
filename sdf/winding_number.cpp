#include "sdf/winding_number.h"

#include <cmath>
#include <numbers>

#include "core/support/parallel.h"

namespace sdf {

namespace {

constexpr double kInverseFourPi = 0.25 / std::numbers::pi;

}  // namespace

double triangle_winding_number(const Triangle& triangle, const glm::dvec3& point) {
    const glm::dvec3 a = triangle.a - point, b = triangle.b - point, c = triangle.c - point;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    const double numerator = glm::dot(a, glm::cross(b, c));
    const double denominator = la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb;
    // atan2(0, 0) at a vertex is 0: such a point sees nothing of the triangle.
    return 2.0 * kInverseFourPi * std::atan2(numerator, denominator);
}

double exact_winding_number(std::span<const Triangle> triangles, const glm::dvec3& point) {
    double sum = 0.0;
    for (const Triangle& triangle : triangles) sum += triangle_winding_number(triangle, point);
    return sum;
}

WindingNumber::WindingNumber(const TriangleBvh& tree) : tree_(tree), moments_(tree.nodes().size()) {
    core::parallel_for(moments_.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const TriangleBvh::Node& node = tree_.nodes()[i];
            moments_[i] = moments_of({tree_.triangles().data() + node.first, node.count});
        }
    });
}

WindingNumber::Moments WindingNumber::moments_of(std::span<const Triangle> triangles) {
    Moments m;
    double total_area = 0.0;
    for (const Triangle& triangle : triangles) {
        const double area = 0.5 * glm::length(triangle.scaled_normal());
        m.center += area * (triangle.a + triangle.b + triangle.c) / 3.0;
        total_area += area;
    }
    m.center /= total_area;

    for (const Triangle& triangle : triangles) {
        const glm::dvec3 u[3] = {triangle.a - m.center, triangle.b - m.center, triangle.c - m.center};
        const glm::dvec3 n = 0.5 * triangle.scaled_normal();
        const glm::dvec3 sum = u[0] + u[1] + u[2];
        for (const glm::dvec3& corner : u) m.radius = std::max(m.radius, glm::length(corner));
        m.dipole += n;

        const glm::dvec3 mean = sum / 3.0;
        m.trace += glm::dot(n, mean);
        m.quadrupole[0] += n.x * mean.x;
        m.quadrupole[1] += n.y * mean.y;
        m.quadrupole[2] += n.z * mean.z;
        m.quadrupole[3] += n.x * mean.y + n.y * mean.x;
        m.quadrupole[4] += n.x * mean.z + n.z * mean.x;
        m.quadrupole[5] += n.y * mean.z + n.z * mean.y;

        // Half the mean of u u^T over the triangle: (sum over corners u u^T + s s^T) / 24.
        double s[3][3];
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) {
                s[j][k] =
                    (u[0][j] * u[0][k] + u[1][j] * u[1][k] + u[2][j] * u[2][k] + sum[j] * sum[k]) / 24.0;
            }
        }
        const double second_trace = s[0][0] + s[1][1] + s[2][2];
        for (int k = 0; k < 3; ++k) {
            m.octupole_vector[k] +=
                2.0 * (n[0] * s[0][k] + n[1] * s[1][k] + n[2] * s[2][k]) + n[k] * second_trace;
        }
        m.octupole[0] += n.x * s[0][0];
        m.octupole[1] += n.y * s[1][1];
        m.octupole[2] += n.z * s[2][2];
        m.octupole[3] += n.y * s[0][0] + 2.0 * n.x * s[0][1];
        m.octupole[4] += n.z * s[0][0] + 2.0 * n.x * s[0][2];
        m.octupole[5] += n.x * s[1][1] + 2.0 * n.y * s[0][1];
        m.octupole[6] += n.z * s[1][1] + 2.0 * n.y * s[1][2];
        m.octupole[7] += n.x * s[2][2] + 2.0 * n.z * s[0][2];
        m.octupole[8] += n.y * s[2][2] + 2.0 * n.z * s[1][2];
        m.octupole[9] += 2.0 * (n.x * s[1][2] + n.y * s[0][2] + n.z * s[0][1]);
    }
    return m;
}

double WindingNumber::expand(const Moments& m, const glm::dvec3& point) {
    // With r = centre - point and G(r) = r / |r|^3: sum of moments times the derivatives of G.
    const glm::dvec3 r = m.center - point;
    const double inverse2 = 1.0 / glm::dot(r, r);
    const double inverse3 = inverse2 * std::sqrt(inverse2);
    const double x = r.x, y = r.y, z = r.z;
    const auto& q = m.quadrupole;
    const auto& o = m.octupole;
    const double quadratic =
        q[0] * x * x + q[1] * y * y + q[2] * z * z + q[3] * x * y + q[4] * x * z + q[5] * y * z;
    const double cubic = o[0] * x * x * x + o[1] * y * y * y + o[2] * z * z * z + o[3] * x * x * y +
                         o[4] * x * x * z + o[5] * x * y * y + o[6] * y * y * z + o[7] * x * z * z +
                         o[8] * y * z * z + o[9] * x * y * z;
    const double first = glm::dot(m.dipole, r);
    const double second = m.trace - 3.0 * quadratic * inverse2;
    const double third =
        -3.0 * glm::dot(m.octupole_vector, r) * inverse2 + 15.0 * cubic * inverse2 * inverse2;
    return kInverseFourPi * inverse3 * (first + second + third);
}

double WindingNumber::at(const glm::dvec3& point, double beta) const {
    if (moments_.empty()) return 0.0;
    double sum = 0.0;
    std::uint32_t stack[64];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const std::uint32_t index = stack[--depth];
        const Moments& m = moments_[index];
        const glm::dvec3 r = point - m.center;
        const double reach = beta * m.radius;
        if (glm::dot(r, r) > reach * reach) {
            sum += expand(m, point);
            continue;
        }
        const TriangleBvh::Node& node = tree_.nodes()[index];
        if (node.is_leaf()) {
            sum += exact_winding_number({tree_.triangles().data() + node.first, node.count}, point);
        } else {
            stack[depth++] = node.second;
            stack[depth++] = index + 1;
        }
    }
    return sum;
}

bool WindingNumber::is_inside(const glm::dvec3& point) const {
    constexpr double kDoubtful = 0.05, kCarefulBeta = 8.0;
    double w = std::abs(at(point));
    if (std::abs(w - 0.5) < kDoubtful) w = std::abs(at(point, kCarefulBeta));
    return w >= 0.5;
}

}  // namespace sdf
