// core/math/bounds.h: axis-aligned boxes.
#pragma once

#include <glm/glm.hpp>
#include <limits>

namespace core {

/// An axis-aligned box. Default-constructed it is empty: minimum > maximum.
template <typename Vector>
struct BasicBounds {
    using Scalar = typename Vector::value_type;

    Vector minimum{std::numeric_limits<Scalar>::infinity()};
    Vector maximum{-std::numeric_limits<Scalar>::infinity()};

    bool empty() const {
        return !(minimum.x <= maximum.x && minimum.y <= maximum.y && minimum.z <= maximum.z);
    }
    Vector extent() const { return empty() ? Vector(0) : maximum - minimum; }
    Vector center() const { return Scalar(0.5) * (minimum + maximum); }

    /// Grows the box so that it holds `point`. NaN components change nothing.
    void include(const Vector& point) {
        for (int axis = 0; axis < 3; ++axis) {
            if (point[axis] < minimum[axis]) minimum[axis] = point[axis];
            if (point[axis] > maximum[axis]) maximum[axis] = point[axis];
        }
    }
    void include(const BasicBounds& other) {
        if (other.empty()) return;
        include(other.minimum);
        include(other.maximum);
    }
};

using Bounds = BasicBounds<glm::vec3>;
using DoubleBounds = BasicBounds<glm::dvec3>;

/// The box around the image of `box` under an affine map. Empty stays empty.
inline DoubleBounds transformed(const DoubleBounds& box, const glm::dmat4& matrix) {
    DoubleBounds result;
    if (box.empty()) return result;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 point((corner & 1) ? box.maximum.x : box.minimum.x,
                               (corner & 2) ? box.maximum.y : box.minimum.y,
                               (corner & 4) ? box.maximum.z : box.minimum.z);
        result.include(glm::dvec3(matrix * glm::dvec4(point, 1.0)));
    }
    return result;
}

}  // namespace core
