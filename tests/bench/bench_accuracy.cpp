#include "tests/bench/bench_accuracy.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "sdf/sdf_tracer.h"

namespace tests {
namespace {

/// Pieces that are looked at: enough for a 99th percentile.
constexpr std::size_t kMostPieces = 4;

/// Counts of one comparison.
struct Agreement {
    std::uint64_t either = 0, differ = 0;

    void add(bool a, bool b) {
        either += a || b;
        differ += a != b;
    }
    double part() const {
        return either > 0 ? static_cast<double>(differ) / static_cast<double>(either) : 0.0;
    }
};

double mean(const std::vector<double>& values) {
    return values.empty()
               ? 0.0
               : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// |t - t_reference| across the surface, in voxels of the instance that the reference hit.
double across_surface(const BenchWorld& world, const core::Ray& ray, const core::Hit& reference, float t) {
    const core::Instance& instance = world.scene().instances[reference.instance];
    const glm::dmat3 voxel_from_world = glm::dmat3(instance.local_from_world) / world.grid().voxel_size();
    const glm::dvec3 direction = voxel_from_world * glm::dvec3(ray.direction);
    // Normals map by the inverse transpose of what positions map by.
    const glm::dvec3 normal =
        glm::normalize(glm::transpose(glm::inverse(voxel_from_world)) * glm::dvec3(reference.normal));
    return std::abs((double(t) - double(reference.t)) * glm::dot(normal, direction));
}

double distance_to_mesh(const BenchWorld& world, const core::Ray& ray, const core::Hit& hit) {
    const core::Instance& instance = world.scene().instances[hit.instance];
    const glm::dvec3 position = glm::dvec3(ray.origin) + double(hit.t) * glm::dvec3(ray.direction);
    const glm::dvec3 local(instance.local_from_world * glm::dvec4(position, 1.0));
    return std::sqrt(world.mesh_tree().closest(local).distance_squared) / world.grid().voxel_size();
}

/// What the tracer has counted so far; 0 if it does not.
std::uint64_t steps_of(const core::Tracer& tracer) {
    const auto* const fields = dynamic_cast<const sdf::SdfTracer*>(&tracer);
    return fields ? fields->statistics().steps : 0;
}

}  // namespace

BenchAccuracy measure_accuracy(const core::Tracer& tracer, const BenchWorld& world, const BenchRays& rays) {
    const std::size_t piece_step = (rays.pieces.size() + kMostPieces - 1) / kMostPieces;
    Agreement with_mesh, with_reference;
    std::vector<double> errors, mesh_errors;
    std::uint64_t steps = 0;
    std::size_t ray_count = 0;
    for (std::size_t piece = 0; piece < rays.pieces.size(); piece += piece_step) {
        const core::RayStream& stream = rays.pieces[piece];
        ray_count += stream.size();
        const std::uint64_t steps_before = steps_of(tracer);
        if (rays.is_occlusion) {
            std::vector<std::uint8_t> own(stream.size()), mesh(stream.size()), field(stream.size());
            tracer.trace_occluded(stream, own);
            steps += steps_of(tracer) - steps_before;
            world.triangles().trace_occluded(stream, mesh);
            world.reference().trace_occluded(stream, field);
            for (std::size_t i = 0; i < stream.size(); ++i) {
                with_mesh.add(own[i] != 0, mesh[i] != 0);
                with_reference.add(own[i] != 0, field[i] != 0);
            }
            continue;
        }
        core::HitStream own, mesh, field;
        tracer.trace_closest(stream, own);
        steps += steps_of(tracer) - steps_before;
        world.triangles().trace_closest(stream, mesh);
        world.reference().trace_closest(stream, field);
        for (std::size_t i = 0; i < stream.size(); ++i) {
            const core::Ray ray = stream.get(i);
            const core::Hit hit = own.get(i), truth = field.get(i);
            with_mesh.add(hit.hit(), mesh.status[i] == core::HitStatus::kHit);
            with_reference.add(hit.hit(), truth.hit());
            if (!hit.hit()) continue;
            mesh_errors.push_back(distance_to_mesh(world, ray, hit));
            if (truth.hit()) errors.push_back(across_surface(world, ray, truth, hit.t));
        }
    }
    BenchAccuracy result;
    result.steps_per_ray = static_cast<double>(steps) / static_cast<double>(ray_count);
    result.error_mean_voxels = mean(errors);
    result.mesh_error_mean_voxels = mean(mesh_errors);
    if (!errors.empty()) {
        const auto rank =
            errors.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(errors.size() - 1));
        std::nth_element(errors.begin(), rank, errors.end());
        result.error_p99_voxels = *rank;
    }
    result.hit_disagreement = with_mesh.part();
    result.reference_disagreement = with_reference.part();
    return result;
}

}  // namespace tests
