// sdf/winding_number.h: how often a triangle soup winds round a point: the robust inside test.
//
// Jacobson, Kavan, Sorkine-Hornung, "Robust Inside-Outside Segmentation using Generalized Winding Numbers",
// SIGGRAPH 2013, evaluated in a tree after Barill, Dickson, Schmidt, Levin, Jacobson, "Fast Winding Numbers
// for Soups and Clouds", SIGGRAPH 2018: clusters far from the point are replaced by their Taylor expansion of
// the second order.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "sdf/triangle_bvh.h"

namespace sdf {

/// Signed solid angle of a triangle seen from `point`, over 4 pi (Van Oosterom and Strackee, "The Solid Angle
/// of a Plane Triangle", 1983). Positive behind a triangle, so that a closed mesh has 1 inside.
double triangle_winding_number(const Triangle& triangle, const glm::dvec3& point);

/// Sum over triangles, without approximation: the oracle.
double exact_winding_number(std::span<const Triangle> triangles, const glm::dvec3& point);

/// The fast version over the triangles of a tree.
class WindingNumber {
public:
    /// @param tree must outlive this.
    explicit WindingNumber(const TriangleBvh& tree);

    /// A cluster is expanded where the point is farther from it than `beta` times its radius. With 2 the
    /// error on closed meshes is under 1e-2; with infinity the sum is exact.
    double at(const glm::dvec3& point, double beta = 2.0) const;

    /// Whether |w| >= 0.5. Points whose fast value is close to the threshold are evaluated again with a much
    /// larger beta.
    bool is_inside(const glm::dvec3& point) const;

private:
    /// Moments of one cluster about its centre, of area-weighted normals n and positions u:
    /// int n, int n u^T, and half int n u u^T contracted to what the expansion needs.
    struct Moments {
        glm::dvec3 center{0.0};
        double radius = 0.0;
        glm::dvec3 dipole{0.0};
        double trace = 0.0;
        std::array<double, 6> quadrupole{};  ///< Symmetric part: xx, yy, zz, xy, xz, yz.
        glm::dvec3 octupole_vector{0.0};
        std::array<double, 10> octupole{};  ///< Symmetric: xxx yyy zzz xxy xxz xyy yyz xzz yzz xyz.
    };

    static Moments moments_of(std::span<const Triangle> triangles);
    static double expand(const Moments& moments, const glm::dvec3& point);

    const TriangleBvh& tree_;
    std::vector<Moments> moments_;
};

}  // namespace sdf
