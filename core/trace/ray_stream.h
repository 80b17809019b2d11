// core/trace/ray_stream.h: rays and hits as structures of arrays, the vocabulary of core::Tracer.
//
// Columns are 64-byte aligned and padded to kStreamLanes entries, so that kernels may load whole vectors at
// the end of a stream. Padding rays are invalid (t_max < t_min) and therefore miss.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <new>
#include <vector>

#include "core/math/ray.h"

namespace core {

/// Entries that every column is padded to: the widest vector of 32-bit lanes.
inline constexpr std::size_t kStreamLanes = 16;

/// Hands out 64-byte aligned memory.
template <typename T>
struct CacheLineAllocator {
    using value_type = T;
    static constexpr std::align_val_t kAlignment{64};

    CacheLineAllocator() = default;
    template <typename U>
    explicit CacheLineAllocator(const CacheLineAllocator<U>&) {}

    T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), kAlignment)); }
    void deallocate(T* memory, std::size_t) { ::operator delete(memory, kAlignment); }
    bool operator==(const CacheLineAllocator&) const { return true; }
};

template <typename T>
using Column = std::vector<T, CacheLineAllocator<T>>;

/// The stream length rounded up to whole vectors.
constexpr std::size_t padded_stream_size(std::size_t size) {
    return (size + kStreamLanes - 1) / kStreamLanes * kStreamLanes;
}

/// Many rays, one column a component.
class RayStream {
public:
    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }

    void clear() { resize(0); }
    void reserve(std::size_t count);

    /// Sets the number of rays; new ones and the padding are invalid rays.
    void resize(std::size_t count);

    void push_back(const Ray& ray) {
        resize(size_ + 1);
        set(size_ - 1, ray);
    }

    /// @pre index < size()
    void set(std::size_t index, const Ray& ray) {
        origin_x[index] = ray.origin.x;
        origin_y[index] = ray.origin.y;
        origin_z[index] = ray.origin.z;
        t_min[index] = ray.t_min;
        direction_x[index] = ray.direction.x;
        direction_y[index] = ray.direction.y;
        direction_z[index] = ray.direction.z;
        t_max[index] = ray.t_max;
        seed[index] = ray.seed;
    }
    Ray get(std::size_t index) const {
        return {{origin_x[index], origin_y[index], origin_z[index]},
                t_min[index],
                {direction_x[index], direction_y[index], direction_z[index]},
                t_max[index],
                seed[index]};
    }

    Column<float> origin_x, origin_y, origin_z, t_min;
    Column<float> direction_x, direction_y, direction_z, t_max;
    Column<std::uint32_t> seed;

private:
    std::size_t size_ = 0;
};

enum class HitStatus : std::uint8_t {
    kMiss,
    kHit,
    kExhausted,  ///< The tracer ran out of steps; no surface is claimed, and frames count these.
};

/// What one ray met. For anything but kHit only `status` and `steps` mean something.
struct Hit {
    float t = std::numeric_limits<float>::infinity();  ///< Distance along the ray in world units.
    glm::vec3 normal{0.0f};  ///< Geometric, unit, world; faces the ray: dot(n, d) <= 0.
    std::uint32_t instance = kNoIndex;
    std::uint32_t triangle = kNoIndex;  ///< Index into the mesh's triangles.
    glm::vec2 barycentrics{0.0f};       ///< Weights of the triangle's second and third vertex.
    bool front = true;                  ///< The side the winding of the stored triangle calls front.
    HitStatus status = HitStatus::kMiss;
    std::uint32_t steps = 0;  ///< Field samples or nodes visited, as the tracer counts; 0 where it does not.
    float offset = 0.0f;      ///< A ray that leaves this hit starts at least this far off along the normal.

    bool hit() const { return status == HitStatus::kHit; }
};

/// Many hits, one column a component; entry i answers ray i.
class HitStream {
public:
    std::size_t size() const { return size_; }

    /// Sets the number of hits; contents are unspecified until a tracer fills them.
    void resize(std::size_t count);

    /// Makes every hit a miss.
    void fill_with_misses();

    void set(std::size_t index, const Hit& hit) {
        t[index] = hit.t;
        normal_x[index] = hit.normal.x;
        normal_y[index] = hit.normal.y;
        normal_z[index] = hit.normal.z;
        instance[index] = hit.instance;
        triangle[index] = hit.triangle;
        barycentric_u[index] = hit.barycentrics.x;
        barycentric_v[index] = hit.barycentrics.y;
        front[index] = hit.front ? 1 : 0;
        status[index] = hit.status;
        steps[index] = hit.steps;
        offset[index] = hit.offset;
    }
    Hit get(std::size_t index) const {
        return {t[index],
                {normal_x[index], normal_y[index], normal_z[index]},
                instance[index],
                triangle[index],
                {barycentric_u[index], barycentric_v[index]},
                front[index] != 0,
                status[index],
                steps[index],
                offset[index]};
    }

    Column<float> t, normal_x, normal_y, normal_z;
    Column<std::uint32_t> instance, triangle;
    Column<float> barycentric_u, barycentric_v;
    Column<std::uint8_t> front;
    Column<HitStatus> status;
    Column<std::uint32_t> steps;
    Column<float> offset;

private:
    std::size_t size_ = 0;
};

/// True where every component is finite enough to trace: origin, t_min finite, direction finite and of unit
/// length within 1e-3, t_max a number, t_min <= t_max. Every tracer misses on all other rays, by this one
/// test.
bool is_valid_ray(const Ray& ray);

/// is_valid_ray() of rays begin to end - 1: valid[0] belongs to ray `begin`. @pre room for end - begin
void find_valid_rays(const RayStream& rays, std::size_t begin, std::size_t end, std::uint8_t* valid);

}  // namespace core
