// core/math/sampling.h: numbers in the unit square to directions, points and table entries, each with its pdf
// and inverse.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace core {

inline constexpr float kPi = 3.14159265358979323846f;

/// Concentric map from the unit square to the unit disc (Shirley and Chiu, "A Low Distortion Map Between Disk
/// and Square", JGT 1997). Area-preserving.
glm::vec2 disk_from_square(const glm::vec2& u);
glm::vec2 square_from_disk(const glm::vec2& point);

/// Cosine-weighted about +Z; pdf = cos / pi.
glm::vec3 sample_cosine_hemisphere(const glm::vec2& u);
inline float cosine_hemisphere_pdf(float cosine) {
    return cosine > 0.0f ? cosine / kPi : 0.0f;
}
glm::vec2 invert_cosine_hemisphere(const glm::vec3& direction);

/// Uniform over the unit sphere; pdf = 1 / 4 pi.
glm::vec3 sample_uniform_sphere(const glm::vec2& u);
inline constexpr float kUniformSpherePdf = 1.0f / (4.0f * kPi);
glm::vec2 invert_uniform_sphere(const glm::vec3& direction);

/// Uniform in solid angle over the cone about +Z of half-angle acos(1 - one_minus_cos). The argument is
/// 1 - cos, so that a cone as narrow as the sun's keeps its precision.
glm::vec3 sample_uniform_cone(const glm::vec2& u, float one_minus_cos);
inline float uniform_cone_pdf(float one_minus_cos) {
    return 1.0f / (2.0f * kPi * one_minus_cos);
}
glm::vec2 invert_uniform_cone(const glm::vec3& direction, float one_minus_cos);

/// Uniform over a triangle; returns the barycentric weights of the second and third vertex.
glm::vec2 sample_triangle(const glm::vec2& u);
glm::vec2 invert_triangle(const glm::vec2& barycentrics);

/// Piecewise-constant distribution over [0, 1), by inversion of its cumulative sums.
class Distribution1D {
public:
    Distribution1D() = default;

    /// @param weights finite, >= 0. If all are 0 the distribution is uniform.
    explicit Distribution1D(std::span<const float> weights);

    std::size_t size() const { return probabilities_.size(); }

    struct Sample {
        std::size_t index = 0;
        float probability = 0.0f;  ///< Of the entry.
        float remainder = 0.0f;    ///< u rescaled within the entry, in [0, 1): can be used again.
    };
    Sample sample(float u) const;

    float probability(std::size_t index) const { return probabilities_[index]; }

    /// The smallest u that sample() maps to entry `index` and `remainder`.
    float invert(std::size_t index, float remainder) const;

    /// Mean of the weights.
    double mean_weight() const { return mean_weight_; }

private:
    std::vector<float> cumulative_;  ///< size() + 1 entries, from 0 to 1.
    std::vector<float> probabilities_;
    double mean_weight_ = 0.0;
};

/// Piecewise-constant distribution over the unit square: rows, then columns within the row.
class Distribution2D {
public:
    Distribution2D() = default;

    /// @param weights width x height, row-major, finite, >= 0.
    Distribution2D(std::span<const float> weights, int width, int height);

    struct Sample {
        glm::vec2 point{0.0f};
        float pdf = 0.0f;  ///< With respect to area of the unit square.
    };
    Sample sample(const glm::vec2& u) const;
    float pdf(const glm::vec2& point) const;
    glm::vec2 invert(const glm::vec2& point) const;

private:
    int width_ = 0;
    int height_ = 0;
    Distribution1D rows_;
    std::vector<Distribution1D> columns_;
};

}  // namespace core
