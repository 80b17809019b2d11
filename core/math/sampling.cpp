#include "core/math/sampling.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/math/random.h"

namespace core {

glm::vec2 disk_from_square(const glm::vec2& u) {
    const float x = 2.0f * u.x - 1.0f;
    const float y = 2.0f * u.y - 1.0f;
    if (x == 0.0f && y == 0.0f) return glm::vec2(0.0f);
    float radius, angle;
    if (std::abs(x) > std::abs(y)) {
        radius = x;
        angle = (kPi / 4.0f) * (y / x);
    } else {
        radius = y;
        angle = (kPi / 2.0f) - (kPi / 4.0f) * (x / y);
    }
    return {radius * std::cos(angle), radius * std::sin(angle)};
}

glm::vec2 square_from_disk(const glm::vec2& point) {
    const float radius = glm::length(point);
    float x, y;
    if (std::abs(point.x) > std::abs(point.y)) {
        x = std::copysign(radius, point.x);
        y = x * (4.0f / kPi) * std::atan(point.y / point.x);
    } else if (point.y != 0.0f) {
        y = std::copysign(radius, point.y);
        x = y * (4.0f / kPi) * std::atan(point.x / point.y);
    } else {
        x = y = 0.0f;
    }
    return {0.5f * (x + 1.0f), 0.5f * (y + 1.0f)};
}

glm::vec3 sample_cosine_hemisphere(const glm::vec2& u) {
    const glm::vec2 disk = disk_from_square(u);
    return {disk.x, disk.y, std::sqrt(std::max(0.0f, 1.0f - glm::dot(disk, disk)))};
}

glm::vec2 invert_cosine_hemisphere(const glm::vec3& direction) {
    return square_from_disk({direction.x, direction.y});
}

glm::vec3 sample_uniform_sphere(const glm::vec2& u) {
    const float z = 1.0f - 2.0f * u.x;
    const float radius = 2.0f * std::sqrt(std::max(0.0f, u.x * (1.0f - u.x)));
    const float angle = 2.0f * kPi * u.y;
    return {radius * std::cos(angle), radius * std::sin(angle), z};
}

namespace {

float fraction_of_turn(float x, float y) {
    const float turn = std::atan2(y, x) / (2.0f * kPi);
    return std::min(turn < 0.0f ? turn + 1.0f : turn, kOneMinusEpsilon);
}

}  // namespace

glm::vec2 invert_uniform_sphere(const glm::vec3& direction) {
    return {0.5f * (1.0f - direction.z), fraction_of_turn(direction.x, direction.y)};
}

glm::vec3 sample_uniform_cone(const glm::vec2& u, float one_minus_cos) {
    const float height = u.x * one_minus_cos;  // 1 - z
    const float radius = std::sqrt(std::max(0.0f, height * (2.0f - height)));
    const float angle = 2.0f * kPi * u.y;
    return {radius * std::cos(angle), radius * std::sin(angle), 1.0f - height};
}

glm::vec2 invert_uniform_cone(const glm::vec3& direction, float one_minus_cos) {
    // 1 - z from the radius: z itself has lost the digits of a narrow cone.
    const float radius_squared = direction.x * direction.x + direction.y * direction.y;
    const float root = std::sqrt(std::max(0.0f, 1.0f - radius_squared));
    const float height = direction.z >= 0.0f ? radius_squared / (1.0f + root) : 1.0f + root;
    return {height / one_minus_cos, fraction_of_turn(direction.x, direction.y)};
}

glm::vec2 sample_triangle(const glm::vec2& u) {
    const float root = std::sqrt(u.x);
    return {root * (1.0f - u.y), root * u.y};
}

glm::vec2 invert_triangle(const glm::vec2& barycentrics) {
    const float root = barycentrics.x + barycentrics.y;
    return {root * root, root > 0.0f ? barycentrics.y / root : 0.0f};
}

Distribution1D::Distribution1D(std::span<const float> weights) {
    const std::size_t count = weights.size();
    cumulative_.resize(count + 1, 0.0f);
    probabilities_.resize(count, 0.0f);
    double total = 0.0;
    for (const float weight : weights) {
        assert(std::isfinite(weight) && weight >= 0.0f);
        total += weight;
    }
    mean_weight_ = count > 0 ? total / static_cast<double>(count) : 0.0;
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        sum += total > 0.0 ? static_cast<double>(weights[i]) / total : 1.0 / static_cast<double>(count);
        cumulative_[i + 1] = i + 1 == count ? 1.0f : static_cast<float>(std::min(sum, 1.0));
        // From the rounded sums, so that it is the very probability with which sample() returns i.
        probabilities_[i] = cumulative_[i + 1] - cumulative_[i];
    }
}

Distribution1D::Sample Distribution1D::sample(float u) const {
    assert(size() > 0);
    const auto upper = std::upper_bound(cumulative_.begin() + 1, cumulative_.end() - 1, u);
    auto index = static_cast<std::size_t>(upper - cumulative_.begin()) - 1;
    // u may fall onto the rounded end of trailing empty entries.
    while (index > 0 && !(probabilities_[index] > 0.0f)) --index;
    const float remainder = (u - cumulative_[index]) / probabilities_[index];
    return {index, probabilities_[index], std::clamp(remainder, 0.0f, kOneMinusEpsilon)};
}

float Distribution1D::invert(std::size_t index, float remainder) const {
    return std::min(cumulative_[index] + remainder * probabilities_[index], kOneMinusEpsilon);
}

Distribution2D::Distribution2D(std::span<const float> weights, int width, int height)
    : width_(width), height_(height) {
    assert(weights.size() == static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    columns_.reserve(static_cast<std::size_t>(height));
    std::vector<float> row_weights;
    for (int row = 0; row < height; ++row) {
        columns_.emplace_back(weights.subspan(static_cast<std::size_t>(row) * static_cast<std::size_t>(width),
                                              static_cast<std::size_t>(width)));
        row_weights.push_back(static_cast<float>(columns_.back().mean_weight()));
    }
    rows_ = Distribution1D(row_weights);
}

Distribution2D::Sample Distribution2D::sample(const glm::vec2& u) const {
    const Distribution1D::Sample row = rows_.sample(u.y);
    const Distribution1D::Sample column = columns_[row.index].sample(u.x);
    return {{(static_cast<float>(column.index) + column.remainder) / static_cast<float>(width_),
             (static_cast<float>(row.index) + row.remainder) / static_cast<float>(height_)},
            row.probability * column.probability * static_cast<float>(width_) * static_cast<float>(height_)};
}

float Distribution2D::pdf(const glm::vec2& point) const {
    const auto column = static_cast<std::size_t>(
        std::clamp(static_cast<int>(point.x * static_cast<float>(width_)), 0, width_ - 1));
    const auto row = static_cast<std::size_t>(
        std::clamp(static_cast<int>(point.y * static_cast<float>(height_)), 0, height_ - 1));
    return rows_.probability(row) * columns_[row].probability(column) * static_cast<float>(width_) *
           static_cast<float>(height_);
}

glm::vec2 Distribution2D::invert(const glm::vec2& point) const {
    const float x =
        std::clamp(point.x * static_cast<float>(width_), 0.0f, static_cast<float>(width_) * kOneMinusEpsilon);
    const float y = std::clamp(point.y * static_cast<float>(height_), 0.0f,
                               static_cast<float>(height_) * kOneMinusEpsilon);
    const auto column = static_cast<std::size_t>(x);
    const auto row = static_cast<std::size_t>(y);
    return {columns_[row].invert(column, x - static_cast<float>(column)),
            rows_.invert(row, y - static_cast<float>(row))};
}

}  // namespace core
