// Cases 32, 33 and 36: what lies within a cell: several roots, none that is simple, samples of exactly zero;
// and the hit modes against each other.
#include <algorithm>
#include <cmath>

#include "core/support/parallel.h"
#include "sdf/field_kernel.h"
#include "sdf/field_table.h"
#include "sdf/instance_tree.h"
#include "tests/stability/hard_case.h"

namespace tests {
namespace {

constexpr int kSide = 24;  ///< Samples along a side of fields made by hand.

/// A field of kSide^3 samples, in voxels of size 1 from the origin on.
template <typename Value>
sdf::BrickGrid field_of(const Value& value) {
    sdf::SampledField field;
    field.info.voxel_size = 1.0;
    for (int leaf = 0; leaf < 27; ++leaf) {
        sdf::FieldLeaf& filled = field.leaves.emplace_back();
        filled.origin = sdf::kLeafSide * glm::ivec3(leaf / 9, leaf / 3 % 3, leaf % 3);
        filled.triangle.fill(-1);
        for (int i = 0; i < sdf::kLeafSize; ++i) {
            const glm::ivec3 sample = filled.origin + glm::ivec3(i / 64, i / 8 % 8, i % 8);
            // Two outer layers of one sign: whatever is beyond them is no matter.
            const bool is_border = glm::any(glm::lessThan(sample, glm::ivec3(2))) ||
                                   glm::any(glm::greaterThan(sample, glm::ivec3(kSide - 3)));
            filled.distance[static_cast<std::size_t>(i)] =
                is_border ? 0.5f : static_cast<float>(value(sample));
            filled.set_active(i);
        }
    }
    return sdf::BrickGrid(field);
}

/// What the kernels say without a tracer round them.
class BareField {
public:
    explicit BareField(sdf::BrickGrid grid)
        : grid_(std::make_shared<const sdf::BrickGrid>(std::move(grid))),
          meshes_(1),
          atlas_(std::span(&grid_, 1), meshes_) {}

    const sdf::BrickGrid& grid() const { return *grid_; }

    core::HitStream march(const core::RayStream& rays, sdf::HitMode mode) const {
        std::vector<sdf::MarchRay> march_rays;
        std::vector<std::size_t> number;
        std::vector<double> starts;
        core::HitStream hits;
        hits.resize(rays.size());
        for (std::size_t i = 0; i < rays.size(); ++i) {
            hits.set(i, core::Hit());
            const core::Ray ray = rays.get(i);
            const glm::dvec3 origin = glm::dvec3(ray.origin) - grid_->origin(), direction(ray.direction);
            double t_min = ray.t_min, t_max = ray.t_max;
            if (!sdf::clip_to_box(grid_->traced_voxels(), origin, sdf::finite_inverse(direction), t_min,
                                  t_max)) {
                continue;
            }
            const sdf::FieldAtlas::Place& place = atlas_.place(0);
            sdf::MarchRay march;
            for (int axis = 0; axis < 3; ++axis) {
                const auto start = static_cast<float>(origin[axis] + t_min * direction[axis]);
                march.origin[axis] = std::clamp(start, 0.0f, place.cell_count[axis]);
                march.direction[axis] = ray.direction[axis];
                march.cell_count[axis] = place.cell_count[axis];
            }
            march.length = static_cast<float>(t_max - t_min);
            march.top_base = place.top_base;
            march.top_octant = place.octant_stride;
            march.top_stride_x = place.stride_x;
            march.top_stride_y = place.stride_y;
            march_rays.push_back(march);
            number.push_back(i);
            starts.push_back(t_min);
        }
        std::vector<sdf::MarchHit> found(march_rays.size());
        sdf::march_rays(atlas_.table(), mode, march_rays, found);
        for (std::size_t k = 0; k < found.size(); ++k) {
            core::Hit hit;
            hit.status = static_cast<core::HitStatus>(found[k].status);
            hit.t = static_cast<float>(starts[k] + static_cast<double>(found[k].distance));
            EXPECT_TRUE(!hit.hit() || std::isfinite(hit.t));
            hits.set(number[k], hit);
        }
        return hits;
    }

    void expect_cubic_agreement(const core::RayStream& rays, const std::string& name) const {
        core::Instance identity;
        std::vector<Reference> references;
        for (std::size_t i = 0; i < rays.size(); ++i) references.emplace_back(*grid_, identity, rays.get(i));
        for_each_way([&](const Way& way) {
            if (!way.is_cubic()) return;
            const Agreement agreement = agreement_of(references, march(rays, way.mode), way.margin());
            if (std::getenv("FIELDLIGHT_FIGURES"))
                std::cerr << name << ", " << way << ": " << agreement << "\n";
            // Near a double root the sixth step of Newton may still be a thousandth of a voxel off.
            EXPECT_LE(agreement.beyond, agreement.rays / 100'000) << name << ", " << way << ": " << agreement;
            EXPECT_LE(agreement.worst.value, 2.0 * way.margin()) << name << ", " << way << ": " << agreement;
            EXPECT_EQ(agreement.exhausted, 0u) << name << ", " << way << ": " << agreement;
            EXPECT_GT(agreement.hits, agreement.rays / 10) << name;
        });
    }

private:
    std::shared_ptr<const sdf::BrickGrid> grid_;
    std::vector<core::Mesh> meshes_;
    sdf::FieldAtlas atlas_;
};

core::RayStream rays_through_cube(int count, std::uint32_t seed, bool on_lattice) {
    TestRandom random(seed);
    std::vector<core::Ray> rays;
    const double middle = 0.5 * (kSide - 1);
    for (int i = 0; i < count; ++i) {
        glm::dvec3 target, direction;
        for (int axis = 0; axis < 3; ++axis) target[axis] = random.uniform(3.0, kSide - 4.0);
        direction = random.direction();
        if (on_lattice) {
            // Through samples and middles of edges, along axes and diagonals.
            target = 0.5 * glm::round(2.0 * target);
            do {
                for (int axis = 0; axis < 3; ++axis)
                    direction[axis] = static_cast<int>(random.bits() % 5) - 2.0;
            } while (direction == glm::dvec3(0.0));
        }
        static_cast<void>(middle);
        rays.push_back(make_ray(target - 2.0 * kSide * glm::normalize(direction), direction));
    }
    return stream_of(rays);
}

TEST(Case32, OfSeveralRootsInACellTheFirstIsFound) {
    // Noise: every cell holds pieces of surface, bent as no distance field is. Neighbours differ by less than
    // 1, which is all that the steps rely on. The other modes do not claim to see two roots in one cell.
    TestRandom random(3);
    const BareField noise(field_of([&](const glm::ivec3&) { return random.uniform(-0.5, 0.5); }));
    noise.expect_cubic_agreement(rays_through_cube(ray_count(30'000, 1'000'000), 1, false), "noise");
    // Fewer negative samples: rays touch many a bulge.
    const BareField bulges(field_of([&](const glm::ivec3&) { return random.uniform(-0.15, 0.5); }));
    bulges.expect_cubic_agreement(rays_through_cube(ray_count(30'000, 1'000'000), 2, false), "bulges");
}

TEST(Case32, DegenerateCubicsHaveRsAnswer) {
    TestRandom random(5);
    const int count = ray_count(20'000, 500'000);
    // Few values, zero among them: planes, saddles and double roots in every cell, met along lattice lines.
    const BareField steps(
        field_of([&](const glm::ivec3&) { return 0.25 * (static_cast<int>(random.bits() % 5) - 2); }));
    const BareField saddle(field_of([](const glm::ivec3& sample) {
        const glm::dvec3 p = glm::dvec3(sample) - 11.5;
        return std::clamp(0.02 * p.x * p.y, -0.4, 0.4);
    }));
    const BareField plane(
        field_of([](const glm::ivec3& sample) { return std::clamp(0.1 * (sample.x - 11), -0.4, 0.4); }));
    const BareField cone(field_of([](const glm::ivec3& sample) {
        const glm::dvec3 p = glm::dvec3(sample) - 11.0;
        return std::clamp(0.01 * (p.x * p.x + p.y * p.y - p.z * p.z), -0.4, 0.4);
    }));
    const struct {
        const char* name;
        const BareField& field;
    } fields[] = {{"steps", steps}, {"saddle", saddle}, {"plane", plane}, {"cone", cone}};
    for (const auto& one : fields) {
        one.field.expect_cubic_agreement(rays_through_cube(count, 7, true), one.name);
        one.field.expect_cubic_agreement(rays_through_cube(count, 8, false), one.name);
    }
}

TEST(Case33, ASurfaceOnSamplesIsOneHitACrossing) {
    // All faces of the box lie on samples of exactly 0.
    const BakedScene baked(scene_of(box(glm::vec3(1.0f))), 32);
    const double h = baked.voxel();
    TestRandom random(2);
    std::vector<core::Ray> rays;
    for (int i = 0; i < ray_count(20'000, 1'000'000); ++i) {
        const int axis = i % 3;
        const auto coordinate = [&] {
            const double voxels = random.uniform(-13.0, 13.0);
            return h * (i % 4 == 0 ? std::round(voxels) : voxels);
        };
        glm::dvec3 target(coordinate(), coordinate(), coordinate()), slope(0.0);
        target[axis] = 0.0;
        slope[axis] = i % 2 ? 1.0 : -1.0;
        if (i % 8 < 6) {
            // Through the same two faces.
            slope[(axis + 1) % 3] = random.uniform(-0.1, 0.1);
            slope[(axis + 2) % 3] = i % 8 < 3 ? 0.0 : random.uniform(-0.1, 0.1);
        }
        rays.push_back(make_ray(target - 2.0 * slope, slope));
    }
    const core::RayStream stream = stream_of(rays);
    expect_agreement(baked, stream);
    for_each_way([&](const Way& way) {
        core::RayStream rest = stream;
        // Past a hit by more than what its mode may be off.
        const double beyond = (way.margin() + 0.15) * h;
        for (int number = 0; number < 3; ++number) {
            const core::HitStream hits = trace_both(baked.tracer(way.mode), rest);
            std::size_t wrong = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const core::Hit hit = hits.get(i);
                if (number == 2) {
                    wrong += hit.hit();
                    continue;
                }
                const glm::dvec3 point =
                    glm::dvec3(rays[i].origin) + double(hit.t) * glm::dvec3(rays[i].direction);
                const double off = std::abs(std::abs(point[static_cast<int>(i % 3)]) - 1.0) / h;
                wrong += !hit.hit() || hit.front != (number == 0) || off > way.margin();
                rest.t_min[i] = hit.t + static_cast<float>(beyond);
            }
            EXPECT_EQ(wrong, 0u) << way << ", hit " << number;
        }
    });
}

TEST(Case33, ASurfaceInTheJointOfABrickAndAnEmptyBlockIsNotLost) {
    // Boxes of every size, so that some face lies between a brick and a block that holds nothing else.
    for (int half = 12; half <= 25; ++half) {
        const double h = 1.0 / 32;
        const BakedScene baked(scene_of(box(glm::vec3(static_cast<float>(half * h)))), 2 * half);
        TestRandom random(6);
        std::vector<core::Ray> rays;
        for (int i = 0; i < ray_count(2'000, 100'000); ++i) {
            const double reach = (half - 1.0) * h;
            rays.push_back(make_ray(
                {random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach)},
                random.direction()));
        }
        SCOPED_TRACE(half);
        expect_agreement(baked, stream_of(rays));
    }
}

TEST(Case36, EpsConvergesToCubic) {
    // The eps of the mode is a constant, 0.1 voxels. What converges is the voxel: what eps and secant are off
    // falls with it.
    double mean[3][3] = {};
    for (int level = 0; level < 3; ++level) {
        const BakedScene baked(scene_of(torus(1.0f, 0.4f, 192, 96)), 24 << level);
        const core::RayStream rays =
            random_lines(glm::dvec3(0.0), 1.4, static_cast<std::size_t>(ray_count(30'000, 500'000)), 3);
        const core::HitStream exact = trace_both(baked.tracer(sdf::HitMode::kCubic), rays);
        for (const sdf::HitMode mode : kHitModes) {
            const core::HitStream hits = trace_both(baked.tracer(mode), rays);
            double sum = 0.0;
            int compared = 0, elsewhere = 0;
            for (std::size_t i = 0; i < rays.size(); ++i) {
                const core::Hit a = exact.get(i), b = hits.get(i);
                if (!a.hit() || !b.hit()) continue;
                const double cosine = -glm::dot(glm::dvec3(a.normal), glm::dvec3(rays.get(i).direction));
                if (cosine < 0.2) continue;
                const double off = std::abs(double(a.t) - b.t) * cosine;
                ++compared;
                // Where a mode meets another piece of the surface it says nothing of convergence.
                if (off > 0.5 * baked.voxel()) {
                    ++elsewhere;
                } else {
                    sum += off;
                }
            }
            mean[static_cast<int>(mode)][level] = sum / compared;
            EXPECT_LE(elsewhere, compared / 1000);
        }
    }
    for (const auto mode : {sdf::HitMode::kEps, sdf::HitMode::kSecant}) {
        const double* of_mode = mean[static_cast<int>(mode)];
        if (std::getenv("FIELDLIGHT_FIGURES")) {
            std::cerr << of_mode[0] << " " << of_mode[1] << " " << of_mode[2] << "\n";
        }
        EXPECT_LT(of_mode[1], 0.5 * of_mode[0]);
        EXPECT_LT(of_mode[2], 0.5 * of_mode[1]);
        // In voxels: a tenth of the margin.
        EXPECT_LT(of_mode[2] / (2.8 / 96), 0.01);
    }
}

TEST(Case36, FlushToZeroChangesNoHit) {
    const BakedScene baked(
        scene_of(merged(torus(1.0f, 0.4f, 48, 24), moved(quad(), translation({0, 0, 1.2})))), 48);
    core::RayStream rays =
        random_lines(glm::dvec3(0.0), 1.5, static_cast<std::size_t>(ray_count(10'000, 500'000)), 3);
    // Denormal numbers wherever a ray may have them.
    for (std::size_t i = 0; i < rays.size(); i += 4) {
        rays.direction_x[i] = 0.0f;
        const core::Ray ray = rays.get(i);
        rays.set(i, make_ray(ray.origin, ray.direction));
        rays.direction_x[i] = i % 8 ? 1e-40f : -1e-42f;
        if (i % 3 == 0) rays.origin_y[i] = 1e-41f;
        if (i % 5 == 0) rays.t_min[i] = 1e-39f;
    }
    for_each_way([&](const Way& way) {
        core::HitStream plain, flushed;
        baked.tracer(way.mode).trace_closest(rays, plain);
        {
            const core::ScopedFlushDenormals flush;
            baked.tracer(way.mode).trace_closest(rays, flushed);
        }
        std::size_t different = 0, hits = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const core::Hit a = plain.get(i), b = flushed.get(i);
            hits += a.hit();
            different += a.status != b.status ||
                         (a.hit() && (a.t != b.t || a.normal != b.normal || a.triangle != b.triangle));
        }
        EXPECT_GT(hits, rays.size() / 20);
        EXPECT_EQ(different, 0u) << way;
    });
}

}  // namespace
}  // namespace tests
