#include "core/trace/ray_stream.h"

#include <cmath>

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

bool is_valid_ray(const Ray& ray) {
    const float length_squared = glm::dot(ray.direction, ray.direction);
    const float origin_sum = ray.origin.x + ray.origin.y + ray.origin.z;
    // Written so that a NaN anywhere makes the comparison false.
    return std::abs(length_squared - 1.0f) <= 2e-3f && std::isfinite(origin_sum) &&
           std::isfinite(ray.t_min) && ray.t_min <= ray.t_max;
}

}  // namespace core
