#include "tests/support/sheet_rays.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <ostream>
#include <utility>

#include "core/support/parallel.h"
#include "sdf/clean_mesh.h"
#include "tests/support/analytic_scenes.h"

namespace tests {
namespace {

constexpr double kNearestStartVoxels = 1.5;

/// Edges that one triangle alone has.
std::vector<sdf::Triangle> borders_of(const sdf::CleanMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
    for (const glm::uvec3& t : mesh.triangles) {
        for (int i = 0; i < 3; ++i) ++uses[std::minmax(t[i], t[(i + 1) % 3])];
    }
    std::vector<sdf::Triangle> borders;
    for (const auto& [edge, count] : uses) {
        const glm::dvec3 &a = mesh.vertices[edge.first], &b = mesh.vertices[edge.second];
        if (count == 1) borders.push_back({a, b, b});
    }
    return borders;
}

double area_of(const sdf::Triangle& triangle) {
    return 0.5 * glm::length(triangle.scaled_normal());
}

glm::dvec3 random_point(const sdf::Triangle& triangle, TestRandom& random) {
    double u = random.uniform(), v = random.uniform();
    if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
    }
    return triangle.a + u * (triangle.b - triangle.a) + v * (triangle.c - triangle.a);
}

}  // namespace

SheetTargets::SheetTargets(const core::Scene& scene,
                           const std::vector<std::shared_ptr<const sdf::BrickGrid>>& grids)
    : scene_(scene), size_(glm::length(core::world_bounds(scene).extent())) {
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        meshes_.push_back(grids[i] ? sheets_of(scene.meshes[i], *grids[i]) : SheetMesh{});
    }
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        if (!meshes_[scene.instances[i].mesh].triangles.empty()) instances_.push_back(i);
    }
}

SheetTargets::SheetMesh SheetTargets::sheets_of(const core::Mesh& mesh, const sdf::BrickGrid& grid) const {
    SheetMesh sheets;
    sheets.voxel = grid.voxel_size();
    if (grid.info().mesh_class == sdf::MeshClass::kSolid) return sheets;
    const sdf::CleanMesh clean = sdf::clean_mesh({mesh.positions, mesh.triangles});
    std::vector<sdf::Triangle> local, voxels;
    for (const glm::uvec3& t : clean.triangles) {
        local.push_back({clean.vertices[t.x], clean.vertices[t.y], clean.vertices[t.z]});
        const sdf::Triangle& last = local.back();
        voxels.push_back({last.a / sheets.voxel, last.b / sheets.voxel, last.c / sheets.voxel});
    }
    std::vector<double> chances;
    double area = 0.0;
    std::size_t parts = 0;
    for (const sdf::Component& part : sdf::classify_components(clean, voxels, sdf::ClassOverride::kAuto)) {
        if (grid.feature(clean.source_triangle[part.triangles[0]]) != sdf::Feature::kSheet) continue;
        double part_area = 0.0;
        for (const std::uint32_t triangle : part.triangles) part_area += area_of(local[triangle]);
        for (const std::uint32_t triangle : part.triangles) {
            sheets.triangles.push_back(local[triangle]);
            chances.push_back(area_of(local[triangle]) / part_area);
        }
        area += part_area;
        ++parts;
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < chances.size(); ++i) {
        sum += 0.5 * chances[i] / static_cast<double>(parts) + 0.5 * area_of(sheets.triangles[i]) / area;
        sheets.cumulative.push_back(sum);
    }
    const std::vector<sdf::Triangle> borders = borders_of(clean);
    std::vector<std::uint32_t> all(borders.size());
    std::iota(all.begin(), all.end(), 0u);
    sheets.borders = sdf::TriangleBvh(borders, all);
    return sheets;
}

std::vector<SheetTargets::Target> SheetTargets::targets(std::size_t count, TestRandom& random) const {
    constexpr std::size_t kMostTries = 20;
    std::vector<Target> found;
    for (std::size_t tries = 0; tries < kMostTries * count && found.size() < count; ++tries) {
        const std::uint32_t number = instances_[random.bits() % instances_.size()];
        const SheetMesh& sheets = meshes_[scene_.instances[number].mesh];
        const double chance = random.uniform() * sheets.cumulative.back();
        const auto place = std::upper_bound(sheets.cumulative.begin(), sheets.cumulative.end() - 1, chance);
        const auto triangle = static_cast<std::uint32_t>(place - sheets.cumulative.begin());
        const glm::dvec3 point = random_point(sheets.triangles[triangle], random);
        const sdf::ClosestTriangle border{sheets.voxel * sheets.voxel, sdf::kNoTriangle};
        if (sheets.borders.closest(point, border).triangle == sdf::kNoTriangle) {
            found.push_back({number, triangle, point});
        }
    }
    return found;
}

AimedRays SheetTargets::aim(std::size_t count, std::uint32_t seed) const {
    AimedRays aimed;
    TestRandom random(seed);
    const std::vector<Target> found = targets(count, random);
    std::vector<core::Ray> rays;
    for (std::size_t tries = 0; !found.empty() && tries < 2 * count && rays.size() < count; ++tries) {
        const Target& target = found[tries % found.size()];
        const core::Instance& instance = scene_.instances[target.instance];
        const SheetMesh& sheets = meshes_[instance.mesh];
        const glm::dmat3 local_from_world(instance.local_from_world);
        const glm::dvec3 direction = random.direction();
        const double along = sheets.voxel / glm::length(local_from_world * direction);
        const double nearest = kNearestStartVoxels * along;
        const double distance = nearest * std::pow(std::max(size_ / nearest, 1.0), random.uniform());
        const glm::dvec3 world(instance.world_from_local * glm::dvec4(target.point, 1.0));
        const core::Ray ray = make_ray(world - distance * direction, direction);
        const double t =
            sdf::intersect(sheets.triangles[target.triangle],
                           glm::dvec3(instance.local_from_world * glm::dvec4(glm::dvec3(ray.origin), 1.0)),
                           local_from_world * glm::dvec3(ray.direction));
        if (!(t > 0.0 && std::abs(t - distance) < along)) continue;
        rays.push_back(ray);
        aimed.target.push_back(static_cast<float>(t));
        aimed.voxel.push_back(static_cast<float>(along));
    }
    aimed.rays = stream_of(rays);
    return aimed;
}

SheetPassages count_passages(const AimedRays& aimed, const core::Tracer& tracer, const core::Tracer& judge) {
    constexpr std::size_t kPart = 4096, kMostNamed = 8;
    const std::size_t count = aimed.rays.size();
    std::vector<core::Hit> ours(count), theirs(count);
    std::vector<std::uint8_t> occluded(count);
    core::parallel_for((count + kPart - 1) / kPart, 1, [&](std::size_t begin_part, std::size_t) {
        const std::size_t begin = begin_part * kPart, end = std::min(begin + kPart, count);
        core::RayStream rays, short_rays;
        rays.resize(end - begin);
        short_rays.resize(end - begin);
        for (std::size_t i = begin; i < end; ++i) {
            core::Ray ray = aimed.rays.get(i);
            rays.set(i - begin, ray);
            ray.t_max = aimed.target[i] + aimed.voxel[i];
            short_rays.set(i - begin, ray);
        }
        core::HitStream hits;
        tracer.trace_closest(rays, hits);
        for (std::size_t i = begin; i < end; ++i) ours[i] = hits.get(i - begin);
        judge.trace_closest(rays, hits);
        for (std::size_t i = begin; i < end; ++i) theirs[i] = hits.get(i - begin);
        tracer.trace_occluded(short_rays, std::span(occluded).subspan(begin, end - begin));
    });
    SheetPassages result;
    result.rays = count;
    for (std::size_t i = 0; i < count; ++i) {
        const float limit = aimed.target[i] + aimed.voxel[i];
        if (!theirs[i].hit() || theirs[i].t > limit) {
            ++result.unconfirmed;
            continue;
        }
        const bool passed = !ours[i].hit() || ours[i].t > limit;
        if (passed && result.first_passed.size() < kMostNamed) result.first_passed.push_back(i);
        result.passed += passed;
        result.unoccluded += !occluded[i];
        result.early += ours[i].hit() && ours[i].t < theirs[i].t - aimed.voxel[i];
    }
    return result;
}

std::ostream& operator<<(std::ostream& stream, const SheetPassages& passages) {
    return stream << passages.rays << " rays: " << passages.passed << " passed, " << passages.unoccluded
                  << " unoccluded, " << passages.early << " early, " << passages.unconfirmed
                  << " unconfirmed";
}

core::Scene without_alpha(core::Scene scene) {
    for (core::Material& material : scene.materials) material.alpha_mode = core::AlphaMode::kOpaque;
    return scene;
}

}  // namespace tests
