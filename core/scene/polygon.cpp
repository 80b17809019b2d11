#include "core/scene/polygon.h"

#include <fmt/format.h>

#include <cmath>

namespace core {

namespace {

/// Corners that are looked at while ears are searched: what any file may ask for (a fraction of a second),
/// and what each of its bytes adds.
constexpr std::uint64_t kStepAllowance = std::uint64_t{1} << 26;
constexpr std::uint64_t kStepsPerByte = 16;

/// Memory for geometry: the same for small files, and what each byte adds. Real files need at most some
/// twenty times their size.
constexpr std::uint64_t kMemoryAllowance = std::uint64_t{256} << 20;
constexpr std::uint64_t kMemoryPerByte = 64;
/// With all attributes, no shared vertices, and a second copy while meshes are put together.
constexpr std::uint64_t kBytesPerTriangle = 448;

/// The polygon in its plane, counter-clockwise. Empty if it has no area.
std::vector<glm::dvec2> flattened(std::span<const glm::vec3> corners) {
    // Relative to a corner, so that far from the origin no digits are lost.
    const glm::dvec3 origin(corners[0]);
    glm::dvec3 area(0.0);
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        area += glm::cross(glm::dvec3(corners[i]) - origin, glm::dvec3(corners[i + 1]) - origin);
    }
    const glm::dvec3 size = glm::abs(area);
    int axis = size.x > size.y ? 0 : 1;
    if (size.z > size[axis]) axis = 2;
    if (!(size[axis] > 0.0) || !std::isfinite(size[axis])) return {};
    const bool flipped = area[axis] < 0.0;
    std::vector<glm::dvec2> points;
    points.reserve(corners.size());
    for (const glm::vec3& corner : corners) {
        const glm::dvec3 p = glm::dvec3(corner) - origin;
        const glm::dvec2 flat(p[(axis + 1) % 3], p[(axis + 2) % 3]);
        points.push_back(flipped ? glm::dvec2(flat.y, flat.x) : flat);
    }
    return points;
}

/// Twice the signed area of a triangle.
double turn(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool first_corner_sees_all(const std::vector<glm::dvec2>& points) {
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
        if (!(turn(points[0], points[i], points[i + 1]) > 0.0)) return false;
        // All in the half plane left of the first edge, so that the fan goes around less than once.
        if (turn(points[0], points[1], points[i + 1]) < 0.0) return false;
    }
    return true;
}

/// The ring of corners that are left.
class EarClipper {
public:
    EarClipper(const std::vector<glm::dvec2>& points, std::uint64_t& steps_left)
        : points_(points), steps_left_(steps_left), count_(static_cast<std::uint32_t>(points.size())) {
        previous_.resize(count_);
        next_.resize(count_);
        kind_.resize(count_);
        for (std::uint32_t i = 0; i < count_; ++i) {
            previous_[i] = i == 0 ? count_ - 1 : i - 1;
            next_[i] = i + 1 == count_ ? 0 : i + 1;
        }
    }

    bool clip(std::vector<glm::uvec3>& triangles) {
        for (std::uint32_t i = 0; i < count_; ++i) {
            if (!classify(i)) return false;
        }
        std::uint32_t corner = 0;
        for (std::uint32_t left = count_; left > 3; --left) {
            if (!spend(left)) return false;
            const std::uint32_t ear = best_from(corner, left);
            const std::uint32_t before = previous_[ear];
            const std::uint32_t after = next_[ear];
            triangles.emplace_back(before, ear, after);
            next_[before] = after;
            previous_[after] = before;
            if (!classify(before) || !classify(after)) return false;
            // Going on beyond the neighbour spreads the cuts around the ring: fewer slivers than a fan.
            corner = next_[after];
        }
        triangles.emplace_back(previous_[corner], corner, next_[corner]);
        return true;
    }

private:
    /// In the order in which corners are cut: those on a straight edge come after proper ears, since cutting
    /// them leaves a triangle without area; the rest only where a polygon crosses itself.
    enum class Kind : std::uint8_t { kEar, kStraight, kOther };

    bool spend(std::uint64_t steps) {
        if (steps > steps_left_) return false;
        steps_left_ -= steps;
        return true;
    }

    std::uint32_t best_from(std::uint32_t corner, std::uint32_t left) const {
        std::uint32_t best = corner;
        for (std::uint32_t i = 0; i < left; ++i, corner = next_[corner]) {
            if (kind_[corner] == Kind::kEar) return corner;
            if (kind_[corner] < kind_[best]) best = corner;
        }
        return best;
    }

    bool classify(std::uint32_t corner) {
        const glm::dvec2& a = points_[previous_[corner]];
        const glm::dvec2& b = points_[corner];
        const glm::dvec2& c = points_[next_[corner]];
        const double area = turn(a, b, c);
        if (!(area > 0.0)) {
            kind_[corner] = area == 0.0 ? Kind::kStraight : Kind::kOther;
            return true;
        }
        kind_[corner] = Kind::kEar;
        std::uint64_t steps = 0;
        for (std::uint32_t i = next_[next_[corner]]; i != previous_[corner]; i = next_[i]) {
            ++steps;
            const glm::dvec2& p = points_[i];
            // A corner in the same place is the other side of a slit, which leads to a hole.
            if (p == a || p == b || p == c) continue;
            if (turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0) {
                kind_[corner] = Kind::kOther;
                break;
            }
        }
        return spend(steps);
    }

    const std::vector<glm::dvec2>& points_;
    std::uint64_t& steps_left_;
    std::uint32_t count_;
    std::vector<std::uint32_t> previous_, next_;
    std::vector<Kind> kind_;
};

}  // namespace

PolygonSplitter::PolygonSplitter(std::size_t file_byte_count)
    : steps_left_(kStepAllowance + kStepsPerByte * file_byte_count),
      bytes_left_(kMemoryAllowance + kMemoryPerByte * file_byte_count),
      file_byte_count_(file_byte_count) {}

bool PolygonSplitter::charge_triangles(std::uint64_t count) {
    if (count > bytes_left_ / kBytesPerTriangle) return false;
    bytes_left_ -= count * kBytesPerTriangle;
    return true;
}

bool PolygonSplitter::split(std::span<const glm::vec3> corners, std::vector<glm::uvec3>& triangles) {
    triangles.clear();
    if (!charge_triangles(corners.size() - 2)) return false;
    if (corners.size() > 3) {
        const std::vector<glm::dvec2> points = flattened(corners);
        if (!points.empty() && !first_corner_sees_all(points)) {
            return EarClipper(points, steps_left_).clip(triangles);
        }
    }
    for (std::uint32_t i = 1; i + 1 < corners.size(); ++i) triangles.emplace_back(0, i, i + 1);
    return true;
}

std::string PolygonSplitter::limits() const {
    return fmt::format(
        "with it, the polygons take more time or memory to split than a file of {} bytes is given; "
        "triangulate them when exporting",
        file_byte_count_);
}

}  // namespace core
