#include "core/trace/ray_stream.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace core {

void RayStream::reserve(std::size_t count) {
    const std::size_t padded = padded_stream_size(count);
    for (Column<float>* column :
         {&origin_x, &origin_y, &origin_z, &t_min, &direction_x, &direction_y, &direction_z, &t_max}) {
        column->reserve(padded);
    }
    seed.reserve(padded);
}

void RayStream::resize(std::size_t count) {
    const std::size_t old_size = size_;
    const std::size_t padded = padded_stream_size(count);
    if (padded != origin_x.size()) {
        for (Column<float>* column :
             {&origin_x, &origin_y, &origin_z, &t_min, &direction_x, &direction_y, &direction_z, &t_max}) {
            column->resize(padded, 0.0f);
        }
        seed.resize(padded, 0);
    }
    for (std::size_t i = count < old_size ? count : old_size; i < padded; ++i) {
        t_min[i] = 1.0f;
        t_max[i] = 0.0f;
    }
    size_ = count;
}

void HitStream::resize(std::size_t count) {
    const std::size_t padded = padded_stream_size(count);
    if (padded != t.size()) {
        for (Column<float>* column :
             {&t, &normal_x, &normal_y, &normal_z, &barycentric_u, &barycentric_v, &offset}) {
            column->resize(padded);
        }
        for (Column<std::uint32_t>* column : {&instance, &triangle, &steps}) column->resize(padded);
        front.resize(padded);
        status.resize(padded);
    }
    size_ = count;
}

void HitStream::fill_with_misses() {
    const Hit miss;
    for (Column<float>* column : {&normal_x, &normal_y, &normal_z, &barycentric_u, &barycentric_v, &offset}) {
        std::fill(column->begin(), column->end(), 0.0f);
    }
    std::fill(t.begin(), t.end(), miss.t);
    std::fill(instance.begin(), instance.end(), miss.instance);
    std::fill(triangle.begin(), triangle.end(), miss.triangle);
    std::fill(steps.begin(), steps.end(), miss.steps);
    std::fill(front.begin(), front.end(), std::uint8_t{1});
    std::fill(status.begin(), status.end(), miss.status);
}

namespace {

/// The one test, without branches, so that compilers make vectors of it.
inline bool is_valid(float origin_sum, float length_squared, float t_min, float t_max) {
    constexpr float kLargest = std::numeric_limits<float>::max();
    // Written so that a NaN anywhere makes the comparison false.
    const int is_unit = std::abs(length_squared - 1.0f) <= 2e-3f,
              is_finite = std::abs(origin_sum) <= kLargest, starts = std::abs(t_min) <= kLargest,
              is_ordered = t_min <= t_max;
    return (is_unit & is_finite & starts & is_ordered) != 0;
}

}  // namespace

bool is_valid_ray(const Ray& ray) {
    const glm::vec3 &o = ray.origin, &d = ray.direction;
    return is_valid(o.x + o.y + o.z, d.x * d.x + d.y * d.y + d.z * d.z, ray.t_min, ray.t_max);
}

void find_valid_rays(const RayStream& rays, std::size_t begin, std::size_t end, std::uint8_t* valid) {
    const float *ox = rays.origin_x.data(), *oy = rays.origin_y.data(), *oz = rays.origin_z.data(),
                *dx = rays.direction_x.data(), *dy = rays.direction_y.data(), *dz = rays.direction_z.data(),
                *t_min = rays.t_min.data(), *t_max = rays.t_max.data();
    for (std::size_t i = begin; i < end; ++i) {
        valid[i - begin] = is_valid(ox[i] + oy[i] + oz[i], dx[i] * dx[i] + dy[i] * dy[i] + dz[i] * dz[i],
                                    t_min[i], t_max[i]);
    }
}

}  // namespace core
