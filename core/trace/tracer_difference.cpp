#include "core/trace/tracer_difference.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

#include "core/math/random.h"
#include "core/math/sampling.h"
#include "core/support/error.h"
#include "core/support/parallel.h"
#include "core/trace/surface.h"

namespace core {

namespace {

constexpr std::size_t kStreamSize = 4096;
constexpr int kJitterCount = 8;
constexpr double kTwoPi = 6.28318530717958647692;

/// What random numbers are for.
enum Use : std::uint32_t { kFilm, kAlpha, kDirection, kTarget, kShadowAlpha };

/// What is measured of one ray.
struct RayRecord {
    bool reference_hit = false;
    bool tested_hit = false;
    bool silhouette = false;
    float voxels = 0.0f;
    float degrees = 0.0f;
};

/// The voxel of an instance, in world units across the ray, and in voxels a world unit along it.
struct VoxelScale {
    double world_size = 0.0;
    double voxels_per_t = 0.0;
};

/// An end of an occlusion query, off its surface.
struct LiftedPoint {
    glm::vec3 position{0.0f};
    glm::vec3 normal{0.0f};
};

LiftedPoint lifted(const TracerPair& tracers, const Ray& ray, const Hit& hit) {
    const SurfacePoint surface = surface_at(tracers.scene, ray, hit);
    return {surface.origin_above(tracers.tested.start_offset(hit.instance)), surface.geometric_normal};
}

class Comparison {
public:
    Comparison(const TracerPair& tracers, const RayStream& rays, std::uint32_t seed,
               const StopRequested& stop_requested)
        : tracers_(tracers), ray_count_(rays.size()), seed_(seed), stop_requested_(stop_requested) {
        for (std::size_t first = 0; first < rays.size(); first += kStreamSize) {
            RayStream stream;
            stream.resize(std::min(kStreamSize, rays.size() - first));
            for (std::size_t i = 0; i < stream.size(); ++i) stream.set(i, rays.get(first + i));
            streams_.push_back(std::move(stream));
        }
    }

    TracerDifference run() {
        TracerDifference found;
        found.rays = ray_count_;
        found.reference_rays_per_second = timed(tracers_.reference, expected_);
        found.tested_rays_per_second = timed(tracers_.tested, found_);
        std::vector<std::vector<RayRecord>> records(streams_.size());
        std::vector<ShadowCount> shadows(streams_.size());
        parallel_for(streams_.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s) {
                check_stop();
                records[s] = compare(s);
                shadows[s] = compare_shadows(s);
            }
        });
        for (const ShadowCount& count : shadows) {
            found.shadow_rays += count.rays;
            found.shadow_disagree += count.disagree;
        }
        sum_up(records, found);
        return found;
    }

private:
    struct ShadowCount {
        std::uint64_t rays = 0, disagree = 0;
    };

    void check_stop() const {
        if (stop_requested_ && stop_requested_()) throw Interrupted();
    }

    double timed(const Tracer& tracer, std::vector<HitStream>& hits) const {
        hits.resize(streams_.size());
        const auto start = std::chrono::steady_clock::now();
        for (std::size_t s = 0; s < streams_.size(); ++s) {
            check_stop();
            tracer.trace_closest(streams_[s], hits[s]);
        }
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        return static_cast<double>(ray_count_) / seconds.count();
    }

    void sum_up(const std::vector<std::vector<RayRecord>>& records, TracerDifference& found) const {
        std::vector<float> raw, beyond;
        std::uint64_t steps = 0;
        double degrees = 0.0;
        for (std::size_t s = 0; s < streams_.size(); ++s) {
            for (std::size_t i = 0; i < streams_[s].size(); ++i) {
                steps += found_[s].steps[i];
                found.exhausted += found_[s].status[i] == HitStatus::kExhausted ? 1 : 0;
                const RayRecord& record = records[s][i];
                if (!record.reference_hit && !record.tested_hit) continue;
                ++found.either;
                found.silhouettes += record.silhouette ? 1 : 0;
                if (record.reference_hit != record.tested_hit) {
                    ++(record.reference_hit ? found.misses : found.false_hits);
                    found.disagree_beyond += record.silhouette ? 0 : 1;
                    continue;
                }
                raw.push_back(record.voxels);
                if (record.silhouette) continue;
                beyond.push_back(record.voxels);
                degrees += record.degrees;
            }
        }
        found.steps_per_ray =
            static_cast<double>(steps) / static_cast<double>(std::max<std::size_t>(1, ray_count_));
        found.normal_degrees = degrees / static_cast<double>(std::max<std::size_t>(1, beyond.size()));
        found.voxels = quantiles(raw);
        found.voxels_beyond = quantiles(beyond);
    }

    static DistanceQuantiles quantiles(std::vector<float>& values) {
        if (values.empty()) return {};
        std::sort(values.begin(), values.end());
        const auto at = [&](double share) {
            const auto last = static_cast<double>(values.size() - 1);
            return double(values[static_cast<std::size_t>(std::ceil(share * last))]);
        };
        return {at(0.5), at(0.99), at(1.0)};
    }

    /// By the reference's instance; by the tested one's where only that has a voxel.
    VoxelScale voxel_scale(const Hit& expected, const Hit& found, const glm::vec3& direction) const {
        for (const Hit* hit : {&expected, &found}) {
            if (!hit->hit()) continue;
            const Instance& placed = tracers_.scene.instances[hit->instance];
            const double voxel = tracers_.voxel_of_mesh[placed.mesh];
            if (!(voxel > 0.0)) continue;
            const glm::dmat3 linear(placed.world_from_local);
            double largest = 0.0;
            for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, glm::length(linear[axis]));
            const double along = glm::length(glm::dmat3(placed.local_from_world) * glm::dvec3(direction));
            return {voxel * largest, along / voxel};
        }
        return {};
    }

    std::vector<RayRecord> compare(std::size_t s) const {
        const RayStream& rays = streams_[s];
        std::vector<RayRecord> records(rays.size());
        std::vector<std::size_t> asked;
        std::vector<VoxelScale> scales;
        RayStream jittered;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const Hit a = expected_[s].get(i), b = found_[s].get(i);
            RayRecord& record = records[i];
            record.reference_hit = a.hit();
            record.tested_hit = b.hit();
            if (!a.hit() && !b.hit()) continue;
            const Ray ray = rays.get(i);
            const VoxelScale scale = voxel_scale(a, b, ray.direction);
            asked.push_back(i);
            scales.push_back(scale);
            add_jittered(ray, scale.world_size, jittered);
            if (!a.hit() || !b.hit()) continue;
            const double slope = std::abs(glm::dot(glm::dvec3(a.normal), glm::dvec3(ray.direction)));
            record.voxels =
                static_cast<float>(std::abs(double(a.t) - double(b.t)) * slope * scale.voxels_per_t);
            const double cosine = glm::dot(glm::dvec3(a.normal), glm::dvec3(b.normal));
            record.degrees = static_cast<float>(glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0))));
        }
        HitStream around;
        tracers_.reference.trace_closest(jittered, around);
        for (std::size_t k = 0; k < asked.size(); ++k) {
            const std::size_t i = asked[k];
            records[i].silhouette =
                near_silhouette(rays.get(i), expected_[s].get(i), scales[k].world_size, k, jittered, around);
        }
        return records;
    }

    static void add_jittered(const Ray& ray, double distance, RayStream& jittered) {
        const glm::dvec3 d(ray.direction);
        const glm::dvec3 helper = std::abs(d.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        const glm::dvec3 u = glm::normalize(glm::cross(d, helper)), v = glm::cross(d, u);
        for (int k = 0; k < kJitterCount; ++k) {
            const double angle = kTwoPi * k / kJitterCount;
            Ray moved = ray;
            moved.origin =
                glm::vec3(glm::dvec3(ray.origin) + distance * (std::cos(angle) * u + std::sin(angle) * v));
            jittered.push_back(moved);
        }
    }

    static bool near_silhouette(const Ray& ray, const Hit& hit, double voxel_world, std::size_t k,
                                const RayStream& jittered, const HitStream& around) {
        const glm::dvec3 normal(hit.normal),
            position = glm::dvec3(ray.origin) + double(hit.t) * glm::dvec3(ray.direction);
        for (std::size_t j = kJitterCount * k; j < kJitterCount * (k + 1); ++j) {
            const Hit other = around.get(j);
            if (other.hit() != hit.hit()) return true;
            if (!hit.hit()) continue;
            const Ray moved = jittered.get(j);
            const glm::dvec3 there = glm::dvec3(moved.origin) + double(other.t) * glm::dvec3(moved.direction);
            if (std::abs(glm::dot(there - position, normal)) > voxel_world) return true;
        }
        return false;
    }

    ShadowCount compare_shadows(std::size_t s) const {
        RayStream queries;
        for (std::size_t i = 0; i < streams_[s].size(); ++i) {
            const Hit hit = expected_[s].get(i);
            if (!hit.hit()) continue;
            const SampleSequence random(
                hash_words(seed_, static_cast<std::uint32_t>(s), static_cast<std::uint32_t>(i)), 0);
            const auto drawn = static_cast<std::size_t>(random.independent_point(kTarget).x *
                                                        static_cast<float>(ray_count_));
            // In float the largest product may round up to the count.
            const std::size_t target = std::min(drawn, ray_count_ - 1);
            Ray query;
            query.seed = random.bits(kShadowAlpha);
            if (aim(lifted(tracers_, streams_[s].get(i), hit), target, query)) queries.push_back(query);
        }
        std::vector<std::uint8_t> expected(queries.size()), found(queries.size());
        tracers_.reference.trace_occluded(queries, expected);
        tracers_.tested.trace_occluded(queries, found);
        ShadowCount count{queries.size(), 0};
        for (std::size_t i = 0; i < queries.size(); ++i) count.disagree += expected[i] != found[i] ? 1 : 0;
        return count;
    }

    /// Points a query from a lifted hit to where ray `target` came to; false where nobody would ask it.
    bool aim(const LiftedPoint& from, std::size_t target, Ray& query) const {
        const std::size_t s = target / kStreamSize, i = target % kStreamSize;
        const Ray ray = streams_[s].get(i);
        const Hit hit = expected_[s].get(i);
        query.origin = from.position;
        if (hit.status == HitStatus::kMiss) {
            query.direction = ray.direction;
            return glm::dot(query.direction, from.normal) > 0.0f;
        }
        if (!hit.hit()) return false;
        const LiftedPoint to = lifted(tracers_, ray, hit);
        const glm::dvec3 between = glm::dvec3(to.position) - glm::dvec3(from.position);
        const double distance = glm::length(between);
        query.direction = glm::vec3(between / distance);
        // Short of the end by what rounding may misplace it.
        query.t_max = static_cast<float>(distance * (1.0 - 4e-6));
        return distance > 0.0 && glm::dot(query.direction, from.normal) > 0.0f &&
               glm::dot(query.direction, to.normal) < 0.0f;
    }

    const TracerPair& tracers_;
    const std::size_t ray_count_;
    const std::uint32_t seed_;
    const StopRequested& stop_requested_;
    std::vector<RayStream> streams_;
    std::vector<HitStream> expected_, found_;
};

}  // namespace

TracerDifference compare_tracers(const TracerPair& tracers, const RayStream& rays, std::uint32_t seed,
                                 const StopRequested& stop_requested) {
    assert(tracers.voxel_of_mesh.size() == tracers.scene.meshes.size());
    return Comparison(tracers, rays, seed, stop_requested).run();
}

RayStream picture_rays(const TracerPair& tracers, const Camera& camera, int width, int height, int bounces,
                       std::uint32_t seed) {
    const CameraRays camera_rays(camera, width, height);
    RayStream rays;
    std::vector<std::uint32_t> pixel_of_ray;
    const auto sequence = [&](std::uint32_t pixel, int bounce) {
        return SampleSequence(hash_words(seed, pixel, static_cast<std::uint32_t>(bounce)), 0);
    };
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const auto pixel = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(width) +
                               static_cast<std::uint32_t>(x);
            const SampleSequence random = sequence(pixel, 0);
            Ray ray = camera_rays.ray(glm::vec2(x, y) + random.point(kFilm));
            ray.seed = random.bits(kAlpha);
            rays.push_back(ray);
            pixel_of_ray.push_back(pixel);
        }
    }
    RayStream last = rays;
    for (int bounce = 1; bounce <= bounces; ++bounce) {
        HitStream hits;
        tracers.reference.trace_closest(last, hits);
        RayStream next;
        std::vector<std::uint32_t> next_pixels;
        for (std::size_t i = 0; i < last.size(); ++i) {
            const Hit hit = hits.get(i);
            if (!hit.hit()) continue;
            const SampleSequence random = sequence(pixel_of_ray[i], bounce);
            const LiftedPoint from = lifted(tracers, last.get(i), hit);
            Ray ray;
            ray.origin = from.position;
            ray.direction =
                glm::normalize(ShadingFrame::from_normal(from.normal)
                                   .to_world(sample_cosine_hemisphere(random.independent_point(kDirection))));
            ray.seed = random.bits(kAlpha);
            next.push_back(ray);
            next_pixels.push_back(pixel_of_ray[i]);
            rays.push_back(ray);
        }
        last = std::move(next);
        pixel_of_ray = std::move(next_pixels);
    }
    return rays;
}

}  // namespace core
