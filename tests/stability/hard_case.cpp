#include "tests/stability/hard_case.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <optional>

#include "core/support/parallel.h"
#include "sdf/baker.h"
#include "sdf/distance.h"
#include "sdf/field_kernel.h"
#include "sdf/instance_tree.h"
#include "sdf/sphere_trace.h"

namespace tests {

int ray_count(int quick, int full) {
    return std::getenv("FIELDLIGHT_FULL") ? full : quick;
}

void for_each_part(int total, const std::function<void(std::uint32_t seed, int count)>& visit) {
    constexpr int kPart = 100'000;
    std::uint32_t seed = 1;
    for (int done = 0; done < total; done += kPart) visit(seed++, std::min(kPart, total - done));
}

double Way::margin() const {
    switch (mode) {
        case sdf::HitMode::kEps:
            return static_cast<double>(sdf::kHitEpsVoxels);
        case sdf::HitMode::kSecant:
            return 0.05;
        case sdf::HitMode::kCubic:
            break;
    }
    return 1e-3;
}

std::ostream& operator<<(std::ostream& stream, const Way& way) {
    constexpr const char* kNames[] = {"eps", "secant", "cubic"};
    return stream << way.target << " " << kNames[static_cast<int>(way.mode)];
}

void for_each_way(const std::function<void(const Way&)>& visit) {
    for (const std::string& target : sdf::kernel_targets()) {
        ASSERT_TRUE(sdf::select_kernel_target(target));
        for (const sdf::HitMode mode : kHitModes) visit({target, mode});
    }
    sdf::select_kernel_target("");
}

BakedScene::BakedScene(core::Scene scene, int resolution, sdf::SampleBits bits) : scene_(std::move(scene)) {
    sdf::BakeSettings settings;
    settings.sample_bits = bits;
    settings.resolution = resolution;
    grids_ = sdf::grids_by_mesh(scene_, sdf::bake_scene(scene_, settings, {}));
    for (const sdf::HitMode mode : kHitModes) {
        tracers_[static_cast<std::size_t>(mode)] = std::make_unique<sdf::SdfTracer>(scene_, grids_, mode);
    }
}

core::HitStream trace_both(const core::Tracer& tracer, const core::RayStream& rays) {
    core::HitStream hits;
    hits.resize(rays.size());
    std::mutex mutex;
    std::size_t mismatches = 0, wrong = 0;
    constexpr std::size_t kGrain = 8192;
    core::parallel_for(rays.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        core::RayStream part;
        part.resize(end - begin);
        for (std::size_t i = begin; i < end; ++i) part.set(i - begin, rays.get(i));
        core::HitStream found;
        std::vector<std::uint8_t> occluded(part.size(), 2);
        tracer.trace_closest(part, found);
        tracer.trace_occluded(part, occluded);
        std::size_t different = 0, bad = 0;
        for (std::size_t i = 0; i < part.size(); ++i) {
            const core::Hit hit = found.get(i);
            hits.set(begin + i, hit);
            different += occluded[i] != (hit.hit() ? 1 : 0);
            if (!hit.hit()) continue;
            const float length = glm::length(hit.normal);
            bad +=
                !(std::isfinite(hit.t) && hit.t >= part.t_min[i] && hit.t <= part.t_max[i] &&
                  std::abs(length - 1.0f) < 1e-5f && glm::dot(hit.normal, part.get(i).direction) <= 1e-6f &&
                  hit.offset > 0.0f && std::isfinite(hit.offset) && std::isfinite(hit.barycentrics.x) &&
                  std::isfinite(hit.barycentrics.y));
        }
        const std::lock_guard lock(mutex);
        mismatches += different;
        wrong += bad;
    });
    EXPECT_EQ(mismatches, 0u) << "rays on which the two queries disagree";
    EXPECT_EQ(wrong, 0u) << "hits that are no hits: not finite, beyond t_max, or with a bad normal";
    return hits;
}

Reference::Reference(const sdf::BrickGrid& grid, const core::Instance& instance, const core::Ray& ray)
    : grid_(&grid) {
    const double h = grid.voxel_size();
    const glm::dvec3 local(instance.local_from_world * glm::dvec4(glm::dvec3(ray.origin), 1.0));
    origin_ = (local - grid.origin()) / h;
    direction_ = glm::dmat3(instance.local_from_world) * glm::dvec3(ray.direction) / h;
    double t_min = ray.t_min, t_max = ray.t_max;
    if (!core::is_valid_ray(ray) ||
        !sdf::clip_to_box(grid.traced_voxels(), origin_, sdf::finite_inverse(direction_), t_min, t_max)) {
        return;
    }
    t_min_ = t_min;
    t_max_ = t_max;
    sdf::RayMarch march(grid, origin_, direction_, t_min, t_max);
    sdf::Crossing crossing;
    while (march.next(crossing)) {
        if (crossings_.empty()) starts_negative_ = !crossing.enters_negative;
        const sdf::Brick& brick = grid.brick_at(crossing.brick);
        const glm::ivec3 cell = crossing.cell - crossing.cell / sdf::kBrickCells * sdf::kBrickCells;
        const auto v = sdf::CellCorners::load(brick, cell).value;
        const glm::dvec3 u = crossing.point, r = 1.0 - u;
        const auto mix = [](double a, double b, double s) { return a + s * (b - a); };
        const glm::dvec3 gradient(
            mix(mix(v[4] - v[0], v[5] - v[1], u.z), mix(v[6] - v[2], v[7] - v[3], u.z), u.y),
            mix(mix(v[2] - v[0], v[3] - v[1], u.z), mix(v[6] - v[4], v[7] - v[5], u.z), u.x),
            r.x * r.y * (v[1] - v[0]) + r.x * u.y * (v[3] - v[2]) + u.x * r.y * (v[5] - v[4]) +
                u.x * u.y * (v[7] - v[6]));
        crossings_.push_back({crossing.t, std::abs(glm::dot(gradient, direction_)) / speed()});
    }
    is_exhausted_ = march.is_exhausted();
}

double Reference::speed() const {
    return glm::length(direction_);
}

double Reference::field_at(double t, double outside) const {
    // In the face between a brick and an empty block the value is the brick's.
    constexpr double kFaceVoxels = 1e-4;
    for (const double shift : {0.0, -kFaceVoxels, kFaceVoxels}) {
        const std::optional<double> value =
            sdf::distance_at(*grid_, origin_ + (t + shift / speed()) * direction_);
        if (value) return *value;
    }
    return outside;
}

Deviation Reference::deviation_of(const core::Hit& hit) const {
    constexpr double kFar = sdf::kBandVoxels;
    Deviation deviation;
    double end = t_max_;
    if (hit.hit()) {
        end = hit.t;
        deviation.value = std::abs(field_at(end, kFar));
        double nearest = std::numeric_limits<double>::infinity(), place = end;
        for (const Place& crossing : crossings_) {
            const double apart = std::abs(crossing.t - end) * speed();
            if (apart > nearest) continue;
            nearest = apart;
            place = crossing.t;
            deviation.along = apart * crossing.slope;
        }
        // A ray that only touched the surface leaves it again on its way to that crossing; one that runs in
        // the surface may be said to hit anywhere.
        constexpr int kParts = 8;
        double farthest = deviation.value;
        for (int k = 1; k < kParts; ++k) {
            farthest = std::max(farthest, std::abs(field_at(end + (place - end) * k / kParts, kFar)));
        }
        deviation.along = farthest > 2.0 * deviation.value + 1e-7 ? 0.0 : std::min(deviation.along, farthest);
    }
    // Between the first and the second crossing, the third and the fourth, and so on the ray is behind the
    // surface.
    for (std::size_t i = 0; i < crossings_.size(); i += 2) {
        const double from = crossings_[i].t;
        const double to = i + 1 < crossings_.size() ? std::min(crossings_[i + 1].t, end) : end;
        constexpr int kParts = 32;
        for (int k = 1; k < kParts && from < to; ++k) {
            const double outside = starts_negative_ ? kFar : -kFar;
            const double value = field_at(from + (to - from) * k / kParts, outside);
            deviation.skipped = std::max(deviation.skipped, starts_negative_ ? value : -value);
        }
    }
    return deviation;
}

std::vector<Reference> references_of(const BakedScene& baked, const core::RayStream& rays,
                                     std::uint32_t instance) {
    const core::Instance& placed = baked.scene().instances[instance];
    const sdf::BrickGrid& grid = baked.grid(placed.mesh);
    std::vector<Reference> references(rays.size(), Reference(grid, placed, core::Ray{.t_max = -1.0f}));
    core::parallel_for(rays.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) references[i] = Reference(grid, placed, rays.get(i));
    });
    return references;
}

std::ostream& operator<<(std::ostream& stream, const Agreement& agreement) {
    return stream << agreement.rays << " rays, " << agreement.hits << " hits, " << agreement.exhausted
                  << " exhausted; worst |f| " << agreement.worst.value << ", |dt| |df/ds| "
                  << agreement.worst.along << ", skipped " << agreement.worst.skipped << "; "
                  << agreement.beyond << " beyond, the first " << agreement.first_beyond;
}

Agreement agreement_of(const std::vector<Reference>& references, const core::HitStream& hits, double margin) {
    std::vector<Deviation> deviations(references.size());
    core::parallel_for(references.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) deviations[i] = references[i].deviation_of(hits.get(i));
    });
    Agreement agreement;
    agreement.rays = references.size();
    for (std::size_t i = 0; i < references.size(); ++i) {
        const Deviation& one = deviations[i];
        agreement.hits += hits.status[i] == core::HitStatus::kHit;
        agreement.exhausted += hits.status[i] == core::HitStatus::kExhausted;
        agreement.worst.value = std::max(agreement.worst.value, one.value);
        agreement.worst.along = std::max(agreement.worst.along, one.along);
        agreement.worst.skipped = std::max(agreement.worst.skipped, one.skipped);
        if (std::max({one.value, one.along, one.skipped}) > margin) {
            if (agreement.beyond++ == 0) agreement.first_beyond = i;
        }
    }
    return agreement;
}

void expect_agreement(const BakedScene& baked, const core::RayStream& rays, std::uint32_t instance) {
    const std::vector<Reference> references = references_of(baked, rays, instance);
    for_each_way([&](const Way& way) {
        const core::HitStream hits = trace_both(baked.tracer(way.mode), rays);
        const Agreement agreement = agreement_of(references, hits, way.margin());
        if (std::getenv("FIELDLIGHT_FIGURES")) std::cerr << way << ": " << agreement << "\n";
        // One secant over a crease may end farther off than eps.
        const std::size_t allowed = way.mode == sdf::HitMode::kEps ? agreement.rays / 1000 : 0;
        EXPECT_LE(agreement.beyond, allowed) << way << ": " << agreement;
        EXPECT_EQ(agreement.exhausted, 0u) << way << ": " << agreement;
    });
}

}  // namespace tests
