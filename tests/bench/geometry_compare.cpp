// tests/bench/geometry_compare.cpp: how far a scene's distance fields lie off its triangles, on the same
// rays.
//
//     fieldlight_geometry SCENE.glb [--resolution 128] [--rays 1000000] [--seed 1] [--cache FOLDER] [--json]
//
// Rays are isotropic uniform lines through the scene's bounding sphere. Shares are of the rays that hit in
// either tracer, because a background would dilute them. A distance is |t_sdf - t_triangles| (n.d) in voxels
// of the hit instance. A ray is within one voxel of a silhouette if any of eight parallel rays, one voxel
// away, changes between hit and miss on the triangles, or hits more than one voxel off the plane that the ray
// itself hit.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/gltf_loader.h"
#include "core/support/error.h"
#include "core/support/parallel.h"
#include "core/trace/triangle_tracer.h"
#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"
#include "tests/support/analytic_scenes.h"

namespace {

constexpr std::size_t kStreamSize = 4096;
constexpr int kJitterCount = 8;
constexpr double kPi = 3.14159265358979323846;

struct Options {
    std::string scene;
    std::string cache;
    std::uint64_t rays = 1'000'000;
    std::uint64_t resolution = 128;
    std::uint64_t seed = 1;
    bool json = false;
};

struct Row {
    std::uint64_t rays = 0;
    std::uint64_t either = 0;        ///< Rays that hit in either tracer.
    std::uint64_t disagree = 0;      ///< Of them, those that miss in the other.
    std::uint64_t disagree_far = 0;  ///< The same beyond silhouettes.
    std::uint64_t silhouette = 0;    ///< Rays of `either` within one voxel of a silhouette.
    std::uint64_t exhausted = 0;
    std::vector<float> raw_voxels;  ///< |dt| (n.d) of rays that hit in both.
    std::vector<float> far_voxels;  ///< The same beyond silhouettes.
    double normal_degrees = 0.0;    ///< Mean angle between the normals, beyond silhouettes.
    double steps = 0.0;             ///< Mean over all rays.
    double triangle_mrays = 0.0;    ///< Millions of rays a second on one thread.
    double sdf_mrays = 0.0;
};

/// What is measured of one ray.
struct RayRecord {
    bool triangle_hit = false;
    bool sdf_hit = false;
    bool silhouette = false;
    float voxels = 0.0f;
    float degrees = 0.0f;
};

class Comparison {
public:
    Comparison(const core::Scene& scene, const core::Tracer& triangles, const core::Tracer& fields,
               const std::vector<std::shared_ptr<const sdf::BrickGrid>>& grids)
        : scene_(scene), triangles_(triangles), fields_(fields), grids_(grids) {}

    Row run(const core::RayStream& rays) const {
        std::vector<core::RayStream> streams;
        for (std::size_t first = 0; first < rays.size(); first += kStreamSize) {
            core::RayStream stream;
            stream.resize(std::min(kStreamSize, rays.size() - first));
            for (std::size_t i = 0; i < stream.size(); ++i) stream.set(i, rays.get(first + i));
            streams.push_back(std::move(stream));
        }
        Row row;
        row.rays = rays.size();
        std::vector<core::HitStream> expected(streams.size()), found(streams.size());
        row.triangle_mrays = timed(triangles_, streams, expected, rays.size());
        row.sdf_mrays = timed(fields_, streams, found, rays.size());

        std::vector<std::vector<RayRecord>> records(streams.size());
        core::parallel_for(streams.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                records[i] = compare(streams[i], expected[i], found[i]);
            }
        });
        std::uint64_t far_count = 0;
        for (std::size_t s = 0; s < streams.size(); ++s) {
            for (std::size_t i = 0; i < streams[s].size(); ++i) {
                row.steps += found[s].steps[i];
                row.exhausted += found[s].status[i] == core::HitStatus::kExhausted ? 1 : 0;
                const RayRecord& record = records[s][i];
                if (!record.triangle_hit && !record.sdf_hit) continue;
                ++row.either;
                row.silhouette += record.silhouette ? 1 : 0;
                if (record.triangle_hit != record.sdf_hit) {
                    ++row.disagree;
                    row.disagree_far += record.silhouette ? 0 : 1;
                    continue;
                }
                row.raw_voxels.push_back(record.voxels);
                if (record.silhouette) continue;
                row.far_voxels.push_back(record.voxels);
                row.normal_degrees += record.degrees;
                ++far_count;
            }
        }
        row.steps /= static_cast<double>(std::max<std::uint64_t>(1, row.rays));
        row.normal_degrees /= static_cast<double>(std::max<std::uint64_t>(1, far_count));
        return row;
    }

private:
    static double timed(const core::Tracer& tracer, const std::vector<core::RayStream>& streams,
                        std::vector<core::HitStream>& hits, std::size_t ray_count) {
        const auto start = std::chrono::steady_clock::now();
        for (std::size_t i = 0; i < streams.size(); ++i) tracer.trace_closest(streams[i], hits[i]);
        const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        return static_cast<double>(ray_count) / seconds.count() * 1e-6;
    }

    /// The voxel of an instance, in world units across the ray, and in voxels a world unit along it.
    struct VoxelScale {
        double world_size = 0.0;
        double voxels_per_t = 0.0;
    };
    VoxelScale voxel_scale(std::uint32_t instance, const glm::vec3& direction) const {
        const core::Instance& placed = scene_.instances[instance];
        const auto& grid = grids_[placed.mesh];
        // A mesh that could not be baked is missing from the fields altogether.
        if (!grid) return {};
        const glm::dmat3 linear(placed.world_from_local);
        double largest = 0.0;
        for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, glm::length(linear[axis]));
        const double along = glm::length(glm::dmat3(placed.local_from_world) * glm::dvec3(direction));
        return {grid->voxel_size() * largest, along / grid->voxel_size()};
    }

    std::vector<RayRecord> compare(const core::RayStream& rays, const core::HitStream& expected,
                                   const core::HitStream& found) const {
        std::vector<RayRecord> records(rays.size());
        std::vector<std::size_t> asked;
        core::RayStream jittered;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const core::Hit a = expected.get(i), b = found.get(i);
            RayRecord& record = records[i];
            record.triangle_hit = a.hit();
            record.sdf_hit = b.hit();
            if (!a.hit() && !b.hit()) continue;
            const core::Ray ray = rays.get(i);
            const VoxelScale scale = voxel_scale(a.hit() ? a.instance : b.instance, ray.direction);
            asked.push_back(i);
            add_jittered(ray, scale.world_size, jittered);
            if (!a.hit() || !b.hit()) continue;
            const double slope = std::abs(glm::dot(glm::dvec3(a.normal), glm::dvec3(ray.direction)));
            record.voxels =
                static_cast<float>(std::abs(double(a.t) - double(b.t)) * slope * scale.voxels_per_t);
            const double cosine = glm::dot(glm::dvec3(a.normal), glm::dvec3(b.normal));
            record.degrees = static_cast<float>(glm::degrees(std::acos(std::clamp(cosine, -1.0, 1.0))));
        }
        core::HitStream around;
        triangles_.trace_closest(jittered, around);
        for (std::size_t k = 0; k < asked.size(); ++k) {
            const std::size_t i = asked[k];
            records[i].silhouette =
                near_silhouette(rays.get(i), expected.get(i), found.get(i), k, jittered, around);
        }
        return records;
    }

    static void add_jittered(const core::Ray& ray, double distance, core::RayStream& jittered) {
        const glm::dvec3 d(ray.direction);
        const glm::dvec3 helper = std::abs(d.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        const glm::dvec3 u = glm::normalize(glm::cross(d, helper)), v = glm::cross(d, u);
        for (int k = 0; k < kJitterCount; ++k) {
            const double angle = 2.0 * kPi * k / kJitterCount;
            core::Ray moved = ray;
            moved.origin =
                glm::vec3(glm::dvec3(ray.origin) + distance * (std::cos(angle) * u + std::sin(angle) * v));
            jittered.push_back(moved);
        }
    }

    bool near_silhouette(const core::Ray& ray, const core::Hit& hit, const core::Hit& sdf_hit, std::size_t k,
                         const core::RayStream& jittered, const core::HitStream& around) const {
        const VoxelScale scale = voxel_scale(hit.hit() ? hit.instance : sdf_hit.instance, ray.direction);
        const glm::dvec3 normal(hit.normal),
            position = glm::dvec3(ray.origin) + double(hit.t) * glm::dvec3(ray.direction);
        for (std::size_t j = kJitterCount * k; j < kJitterCount * (k + 1); ++j) {
            const core::Hit other = around.get(j);
            if (other.hit() != hit.hit()) return true;
            if (!hit.hit()) continue;
            const core::Ray moved = jittered.get(j);
            const glm::dvec3 there = glm::dvec3(moved.origin) + double(other.t) * glm::dvec3(moved.direction);
            if (std::abs(glm::dot(there - position, normal)) > scale.world_size) return true;
        }
        return false;
    }

    const core::Scene& scene_;
    const core::Tracer& triangles_;
    const core::Tracer& fields_;
    const std::vector<std::shared_ptr<const sdf::BrickGrid>>& grids_;
};

struct Quantiles {
    double p50 = 0.0, p99 = 0.0, max = 0.0;
};
Quantiles quantiles(std::vector<float> values) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) {
        const auto last = static_cast<double>(values.size() - 1);
        return double(values[static_cast<std::size_t>(std::ceil(share * last))]);
    };
    return {at(0.5), at(0.99), at(1.0)};
}

std::string json_escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result;
}

void print(const Options& options, const Row& row) {
    const double either = static_cast<double>(std::max<std::uint64_t>(1, row.either));
    const Quantiles raw = quantiles(row.raw_voxels), far = quantiles(row.far_voxels);
    const std::string name = options.scene.substr(options.scene.find_last_of('/') + 1);
    const double percent = 100.0 * static_cast<double>(row.disagree) / either;
    const double percent_far = 100.0 * static_cast<double>(row.disagree_far) /
                               std::max(1.0, either - static_cast<double>(row.silhouette));
    const double percent_silhouette = 100.0 * static_cast<double>(row.silhouette) / either;
    if (options.json) {
        fmt::print(
            "{{\"scene\": \"{}\", \"resolution\": {}, \"rays\": {}, \"hit_in_either\": {}, "
            "\"disagree_percent\": {:.6g}, \"disagree_beyond_silhouettes_percent\": {:.6g}, "
            "\"silhouette_percent\": {:.6g}, \"raw_voxels\": {{\"p50\": {:.6g}, \"p99\": {:.6g}, \"max\": "
            "{:.6g}}}, "
            "\"beyond_silhouettes_voxels\": {{\"p50\": {:.6g}, \"p99\": {:.6g}, \"max\": {:.6g}}}, "
            "\"normal_degrees\": {:.6g}, \"steps\": {:.6g}, \"exhausted\": {}, \"triangle_mrays\": {:.4g}, "
            "\"sdf_mrays\": {:.4g}}}\n",
            json_escaped(name), options.resolution, row.rays, row.either, percent, percent_far,
            percent_silhouette, raw.p50, raw.p99, raw.max, far.p50, far.p99, far.max, row.normal_degrees,
            row.steps, row.exhausted, row.triangle_mrays, row.sdf_mrays);
        return;
    }
    fmt::print(
        "{:<28} {:>9} {:>9} {:>9} {:>7} | {:>7} {:>7} {:>8} | {:>7} {:>7} {:>8} | {:>7} {:>6} {:>5} {:>6} "
        "{:>6}\n",
        "scene", "hits", "disagr %", "far dis %", "silh %", "raw p50", "p99", "max", "far p50", "p99", "max",
        "norm deg", "steps", "exh", "tri M/s", "sdf M/s");
    fmt::print(
        "{:<28} {:>9} {:>9.4f} {:>9.4f} {:>7.2f} | {:>7.4f} {:>7.4f} {:>8.3f} | {:>7.4f} {:>7.4f} {:>8.3f} | "
        "{:>7.3f} {:>6.1f} {:>5} {:>6.2f} {:>6.2f}\n",
        name, row.either, percent, percent_far, percent_silhouette, raw.p50, raw.p99, raw.max, far.p50,
        far.p99, far.max, row.normal_degrees, row.steps, row.exhausted, row.triangle_mrays, row.sdf_mrays);
}

[[noreturn]] void usage(const std::string& why) {
    throw core::InputError(core::ErrorKind::kUsage,
                           why +
                               "; usage: fieldlight_geometry SCENE.glb [--resolution N] [--rays N] "
                               "[--seed N] [--cache FOLDER] [--json]");
}

Options parse(int count, char** arguments) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string_view argument = arguments[i];
        const auto next = [&]() -> std::string_view {
            if (++i >= count) usage(fmt::format("'{}' wants a value", argument));
            return arguments[i];
        };
        const auto number = [&](std::uint64_t& value) {
            const std::string_view text = next();
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            if (error != std::errc() || end != text.data() + text.size() || value == 0) {
                usage(fmt::format("'{}' wants a positive whole number, not '{}'", argument, text));
            }
        };
        if (argument == "--json") {
            options.json = true;
        } else if (argument == "--rays") {
            number(options.rays);
        } else if (argument == "--resolution") {
            number(options.resolution);
        } else if (argument == "--seed") {
            number(options.seed);
        } else if (argument == "--cache") {
            options.cache = next();
        } else if (argument.starts_with("--") || !options.scene.empty()) {
            usage(fmt::format("'{}' is unknown here", argument));
        } else {
            options.scene = argument;
        }
    }
    if (options.scene.empty()) usage("no scene");
    return options;
}

void run(const Options& options) {
    const core::Scene scene = core::load_gltf(options.scene);
    sdf::BakeSettings settings;
    settings.resolution = static_cast<int>(options.resolution);
    const sdf::BakeResult bakes = sdf::bake_scene(scene, settings, options.cache);
    for (const sdf::MeshBake& bake : bakes.meshes) {
        if (bake.error) fmt::print(stderr, "warning: {}\n", bake.error->what());
    }
    const auto grids = sdf::grids_by_mesh(scene, bakes);
    const core::TriangleTracer triangles(scene);
    const sdf::SdfTracer fields(scene, grids);
    const core::DoubleBounds box = core::world_bounds(scene);
    const core::RayStream rays = tests::random_lines(box.center(), 0.5 * glm::length(box.extent()),
                                                     options.rays, static_cast<std::uint32_t>(options.seed));
    print(options, Comparison(scene, triangles, fields, grids).run(rays));
}

}  // namespace

int main(int count, char** arguments) {
    try {
        run(parse(count, arguments));
        return 0;
    } catch (const core::InputError& error) {
        fmt::print(stderr, "fieldlight_geometry: {}\n", error.what());
        return static_cast<int>(error.kind());
    }
}
