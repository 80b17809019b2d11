// tests/stability/hard_case.h: what the hard cases share: the ways to trace, the numbers of rays, and the
// reference R.
//
// R is sdf::RayMarch, in double on the same 16-bit samples. "Agrees with R within a margin" means: where a
// ray hits, |f_R| <= margin and |t - t_R| |df/ds| <= margin; and before that, or all along a ray that misses,
// it has nowhere been deeper than the margin on the other side of the surface. All in voxels.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.h"
#include "core/trace/ray_stream.h"
#include "core/trace/tracer.h"
#include "sdf/brick_grid.h"
#include "sdf/sdf_tracer.h"
#include "tests/support/analytic_scenes.h"

namespace tests {

/// `quick`, or `full` where the environment has FIELDLIGHT_FULL, as in ./check --full.
int ray_count(int quick, int full);

/// Calls visit(seed, count) for parts of `total` rays that fit into memory.
void for_each_part(int total, const std::function<void(std::uint32_t seed, int count)>& visit);

/// One way to trace fields: an instruction set and a hit mode.
struct Way {
    std::string target;
    sdf::HitMode mode = sdf::HitMode::kCubic;

    bool is_cubic() const { return mode == sdf::HitMode::kCubic; }
    /// How far off R's surface a hit may lie, in voxels.
    double margin() const;
    friend std::ostream& operator<<(std::ostream& stream, const Way& way);
};

inline constexpr std::array kHitModes = {sdf::HitMode::kEps, sdf::HitMode::kSecant, sdf::HitMode::kCubic};

/// Calls visit(way) for every instruction set that runs here and every hit mode, with the kernels switched to
/// it.
void for_each_way(const std::function<void(const Way&)>& visit);

/// A scene with its fields, and tracers on them.
class BakedScene {
public:
    /// @param resolution voxels on the longest side of each mesh
    BakedScene(core::Scene scene, int resolution, sdf::SampleBits bits = sdf::SampleBits::k16);
    BakedScene(const BakedScene&) = delete;
    BakedScene& operator=(const BakedScene&) = delete;

    const core::Scene& scene() const { return scene_; }
    const sdf::SdfTracer& tracer(sdf::HitMode mode) const {
        return *tracers_[static_cast<std::size_t>(mode)];
    }
    const sdf::BrickGrid& grid(std::uint32_t mesh = 0) const { return *grids_[mesh]; }
    const std::vector<std::shared_ptr<const sdf::BrickGrid>>& grids() const { return grids_; }
    /// h, local units.
    double voxel(std::uint32_t mesh = 0) const { return grid(mesh).voxel_size(); }

private:
    core::Scene scene_;
    std::vector<std::shared_ptr<const sdf::BrickGrid>> grids_;
    std::array<std::unique_ptr<sdf::SdfTracer>, 3> tracers_;
};

/// Closest hits, on all threads. Fails where the other query disagrees on a ray, or where what a hit says is
/// not finite, or its normal not unit and facing the ray.
core::HitStream trace_both(const core::Tracer& tracer, const core::RayStream& rays);

/// How far an answer lies off R's, in voxels.
struct Deviation {
    double value = 0.0;    ///< |f_R| at the hit.
    double along = 0.0;    ///< |t - t_R| |df/ds| to the nearest crossing, if there is one.
    double skipped = 0.0;  ///< How deep the ray has been behind the surface before.
};

/// R's answer for one ray and one instance.
class Reference {
public:
    Reference(const sdf::BrickGrid& grid, const core::Instance& instance, const core::Ray& ray);

    bool hit() const { return !crossings_.empty(); }
    bool is_exhausted() const { return is_exhausted_; }
    /// Of the first crossing. @pre hit()
    double t() const { return crossings_[0].t; }
    /// Of that crossing: |df/ds|, the cosine between the field's gradient and the ray in voxels.
    double slope() const { return crossings_[0].slope; }
    std::size_t crossing_count() const { return crossings_.size(); }
    /// Voxels a world unit along the ray.
    double speed() const;

    Deviation deviation_of(const core::Hit& hit) const;

private:
    struct Place {
        double t;
        double slope;
    };
    double field_at(double t, double outside) const;

    const sdf::BrickGrid* grid_;
    glm::dvec3 origin_, direction_;
    double t_min_ = 0.0, t_max_ = -1.0;
    bool is_exhausted_ = false;
    bool starts_negative_ = false;
    std::vector<Place> crossings_;
};

/// R's answers for a stream, on all threads.
std::vector<Reference> references_of(const BakedScene& baked, const core::RayStream& rays,
                                     std::uint32_t instance = 0);

/// What is found over many rays.
struct Agreement {
    std::size_t rays = 0, hits = 0, exhausted = 0;
    Deviation worst;
    /// Rays with a deviation beyond the margin: more than one of them a ray counts once.
    std::size_t beyond = 0;
    std::size_t first_beyond = 0;

    friend std::ostream& operator<<(std::ostream& stream, const Agreement& agreement);
};
Agreement agreement_of(const std::vector<Reference>& references, const core::HitStream& hits, double margin);

/// Traces the rays in every way and expects agreement with R within each mode's margin.
void expect_agreement(const BakedScene& baked, const core::RayStream& rays, std::uint32_t instance = 0);

/// Distance between a float and the next.
inline double ulp(double value) {
    const float magnitude = std::abs(static_cast<float>(value));
    return static_cast<double>(std::nextafter(magnitude, std::numeric_limits<float>::infinity())) -
           static_cast<double>(magnitude);
}

}  // namespace tests
