#include "core/scene/sky.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/image/exr.h"
#include "core/image/hdr.h"
#include "core/math/random.h"
#include "core/math/sampling.h"
#include "core/support/error.h"

namespace core {

namespace {

/// The sun's disc has 1.6e9 cd/m^2. Beyond this, sums over texels and paths leave the range of floats.
constexpr float kBrightestTexel = 1e20f;

}  // namespace

struct Sky::Map {
    int width = 0;
    int height = 0;
    std::vector<glm::vec3> texels;
    Distribution2D distribution;  ///< Over texels, by tent-filtered luminance x solid angle.
    std::vector<float>
        row_cosine;  ///< Cosine of the polar angle at the upper edge of each row, and at the end.
    float cos_rotation = 1.0f;
    float sin_rotation = 0.0f;

    const glm::vec3& texel(int x, int y) const {
        return texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(x)];
    }

    glm::vec2 point_from_direction(const glm::vec3& direction) const {
        const float x = cos_rotation * direction.x - sin_rotation * direction.z;
        const float z = sin_rotation * direction.x + cos_rotation * direction.z;
        const float u = 0.5f + std::atan2(x, -z) / (2.0f * kPi);
        // atan2 rather than acos: near the poles acos has lost half its digits.
        const float v = std::atan2(std::sqrt(x * x + z * z), direction.y) / kPi;
        return {u, v};
    }

    std::size_t row_of(const glm::vec2& point) const {
        return static_cast<std::size_t>(
            std::clamp(static_cast<int>(point.y * static_cast<float>(height)), 0, height - 1));
    }

    /// Solid angle of a texel of this row times the number of texels.
    float scaled_solid_angle(std::size_t row) const {
        return 2.0f * kPi * (row_cosine[row] - row_cosine[row + 1]) * static_cast<float>(height);
    }

    /// A point of the distribution to a direction: uniform in solid angle within each texel, so that the
    /// density is constant there, at the poles too.
    glm::vec3 direction_from_sample(const glm::vec2& point) const {
        const std::size_t row = row_of(point);
        const float within = point.y * static_cast<float>(height) - static_cast<float>(row);
        const float cosine = glm::mix(row_cosine[row], row_cosine[row + 1], within);
        const float sine = std::sqrt(std::max(0.0f, (1.0f - cosine) * (1.0f + cosine)));
        const float angle = (point.x - 0.5f) * 2.0f * kPi;
        const float x = sine * std::sin(angle);
        const float z = -sine * std::cos(angle);
        return glm::normalize(
            glm::vec3(cos_rotation * x + sin_rotation * z, cosine, -sin_rotation * x + cos_rotation * z));
    }

    /// Bilinear, around the seam in u, clamped at the poles.
    glm::vec3 interpolate(const glm::vec2& point) const {
        const float x = point.x * static_cast<float>(width) - 0.5f;
        const float y =
            std::clamp(point.y * static_cast<float>(height) - 0.5f, 0.0f, static_cast<float>(height - 1));
        const float floor_x = std::floor(x);
        const float floor_y = std::floor(y);
        const auto wrap = [&](int column) { return (column % width + width) % width; };
        const int x0 = wrap(static_cast<int>(floor_x));
        const int x1 = wrap(x0 + 1);
        const int y0 = static_cast<int>(floor_y);
        const int y1 = std::min(y0 + 1, height - 1);
        const float fx = x - floor_x;
        const float fy = y - floor_y;
        return glm::mix(glm::mix(texel(x0, y0), texel(x1, y0), fx),
                        glm::mix(texel(x0, y1), texel(x1, y1), fx), fy);
    }
};

Sky Sky::constant(const glm::vec3& radiance) {
    Sky sky;
    sky.constant_ = radiance;
    sky.black_ = !(radiance.x > 0.0f || radiance.y > 0.0f || radiance.z > 0.0f);
    sky.mean_luminance_ = luminance(radiance);
    return sky;
}

Sky Sky::latitude_longitude(const Image& image, float rotation, const std::string& name) {
    std::optional<std::vector<glm::vec3>> colors = image.color();
    if (!colors || colors->empty()) {
        throw InputError(ErrorKind::kBadData,
                         fmt::format("'{}': has no channels R, G and B; a sky needs them", name));
    }
    auto map = std::make_shared<Map>();
    map->width = image.width();
    map->height = image.height();
    map->texels = std::move(*colors);
    map->cos_rotation = std::cos(rotation);
    map->sin_rotation = std::sin(rotation);
    for (std::size_t i = 0; i < map->texels.size(); ++i) {
        const glm::vec3& texel = map->texels[i];
        for (int channel = 0; channel < 3; ++channel) {
            // Written so that NaN is refused.
            if (!(texel[channel] >= 0.0f && texel[channel] <= kBrightestTexel)) {
                throw InputError(
                    ErrorKind::kBadData,
                    fmt::format("'{}': pixel ({}, {}) is {}; a sky's radiance must be from 0 to {:g}", name,
                                i % static_cast<std::size_t>(map->width),
                                i / static_cast<std::size_t>(map->width), texel[channel], kBrightestTexel));
            }
        }
    }
    return from_map(std::move(map));
}

Sky Sky::from_map(std::shared_ptr<Map> map) {
    // Bilinear reading spreads a texel over its neighbours, so the weight of a texel is the tent-filtered
    // luminance around it: positive wherever the interpolated radiance is.
    std::vector<float> weights(map->texels.size());
    for (int y = 0; y <= map->height; ++y) {
        map->row_cosine.push_back(
            static_cast<float>(std::cos(static_cast<double>(kPi) * y / static_cast<double>(map->height))));
    }
    double mean = 0.0;
    for (int y = 0; y < map->height; ++y) {
        const auto row_index = static_cast<std::size_t>(y);
        const float height_share = 0.5f * (map->row_cosine[row_index] - map->row_cosine[row_index + 1]);
        for (int x = 0; x < map->width; ++x) {
            float sum = 0.0f;
            for (int dy = -1; dy <= 1; ++dy) {
                const int row = std::clamp(y + dy, 0, map->height - 1);
                for (int dx = -1; dx <= 1; ++dx) {
                    const int column = (x + dx + map->width) % map->width;
                    sum += luminance(map->texel(column, row)) *
                           static_cast<float>((2 - std::abs(dx)) * (2 - std::abs(dy)));
                }
            }
            weights[static_cast<std::size_t>(y) * static_cast<std::size_t>(map->width) +
                    static_cast<std::size_t>(x)] = sum / 16.0f * height_share;
            mean += static_cast<double>(luminance(map->texel(x, y))) * static_cast<double>(height_share) /
                    map->width;
        }
    }
    map->distribution = Distribution2D(weights, map->width, map->height);

    Sky sky;
    sky.black_ = !(mean > 0.0);
    sky.mean_luminance_ = static_cast<float>(mean);
    sky.map_ = std::move(map);
    return sky;
}

Sky Sky::read(const std::filesystem::path& path, float rotation) {
    const std::string extension = path.extension().string();
    if (extension == ".exr") return latitude_longitude(read_exr(path), rotation, path.filename().string());
    if (extension == ".hdr") return latitude_longitude(read_hdr(path), rotation, path.filename().string());
    throw InputError(ErrorKind::kUsage,
                     fmt::format("'{}': a sky is 'none', R,G,B, or a .hdr or .exr file", path.string()));
}

void Sky::add_to(Hasher& hasher) const {
    hasher.add(constant_);
    hasher.add(map_ != nullptr);
    if (!map_) return;
    hasher.add(map_->width);
    hasher.add(map_->height);
    hasher.add(map_->cos_rotation);
    hasher.add(map_->sin_rotation);
    hasher.add_range(std::span<const glm::vec3>(map_->texels));
}

glm::vec3 Sky::radiance(const glm::vec3& direction) const {
    if (!map_) return constant_;
    return map_->interpolate(map_->point_from_direction(direction));
}

Sky::Sample Sky::sample(const glm::vec2& u) const {
    Sample result;
    if (black_) return result;
    if (!map_) {
        result.direction = sample_uniform_sphere(u);
        result.radiance = constant_;
        result.pdf = kUniformSpherePdf;
        return result;
    }
    const Distribution2D::Sample point = map_->distribution.sample(u);
    if (!(point.pdf > 0.0f)) return result;
    result.direction = map_->direction_from_sample(point.point);
    result.radiance = map_->interpolate(map_->point_from_direction(result.direction));
    result.pdf = point.pdf / map_->scaled_solid_angle(map_->row_of(point.point));
    return result;
}

float Sky::pdf(const glm::vec3& direction) const {
    if (black_) return 0.0f;
    if (!map_) return kUniformSpherePdf;
    const glm::vec2 point = map_->point_from_direction(direction);
    return map_->distribution.pdf(point) / map_->scaled_solid_angle(map_->row_of(point));
}

SkySplit split_sky(const Sky& sky, float ratio) {
    assert(ratio >= 0.0f);
    if (sky.black()) return {sky, Sky()};
    if (ratio == 0.0f) return {Sky(), sky};
    if (!sky.map_) {
        if (ratio >= 1.0f) return {sky, Sky()};
        const glm::vec3 base = ratio * sky.constant_;
        return {Sky::constant(base), Sky::constant(sky.constant_ - base)};
    }
    const float threshold = ratio * sky.mean_luminance();
    const auto exceeds = [&](const glm::vec3& texel) { return luminance(texel) > threshold; };
    if (std::ranges::none_of(sky.map_->texels, exceeds)) return {sky, Sky()};

    const auto empty_map = [&] {
        auto map = std::make_shared<Sky::Map>();
        map->width = sky.map_->width;
        map->height = sky.map_->height;
        map->texels.reserve(sky.map_->texels.size());
        map->cos_rotation = sky.map_->cos_rotation;
        map->sin_rotation = sky.map_->sin_rotation;
        return map;
    };
    auto base = empty_map();
    auto peaks = empty_map();
    for (const glm::vec3& texel : sky.map_->texels) {
        const glm::vec3 kept = exceeds(texel) ? texel * (threshold / luminance(texel)) : texel;
        base->texels.push_back(kept);
        peaks->texels.push_back(texel - kept);
    }
    return {Sky::from_map(std::move(base)), Sky::from_map(std::move(peaks))};
}

}  // namespace core
