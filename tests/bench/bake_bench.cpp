// tests/bench/bake_bench.cpp: what a bake costs, against OpenVDB's conversion of the same mesh at the same
// width.
//
//     fieldlight_bake_bench [--benchmark_filter=...] [--benchmark_format=json] ...
//
// Rows are `bake/<baker>/<mesh>/<resolution>/real_time`. `ours` is all of a bake but the file: cleaning,
// classes, exact distances, signs, thin walls and the report of errors. `openvdb` is
// openvdb::tools::meshToVolume alone, signed, from vertices that are in voxels already; `openvdb_unsigned`
// the same without its signs, which is the part that `ours` contains. Two threads; rows run in turns, so that
// what else the machine does falls on all of them. bake_table() of tests/bench/mesh_table.py reads it.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "sdf/mesh_to_sdf.h"
#include "tests/bench/bench_meshes.h"

namespace {

constexpr int kThreads = 2;

/// A mesh and the voxel that it is baked with.
struct BenchMesh {
    core::Mesh mesh;
    double voxel = 0.0;
};

BenchMesh make_bench_mesh(const std::string& name, int resolution) {
    BenchMesh result{tests::make_bench_scene(name).scene.meshes.at(0), 0.0};
    const glm::dvec3 extent = sdf::usable_extent({result.mesh.positions, result.mesh.triangles});
    result.voxel = std::max({extent.x, extent.y, extent.z}) / resolution;
    return result;
}

/// The mesh as meshToVolume takes it, in voxels.
struct OpenVdbMesh {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;

    explicit OpenVdbMesh(const BenchMesh& from) {
        for (const glm::vec3& p : from.mesh.positions) {
            const glm::vec3 voxels(glm::dvec3(p) / from.voxel);
            points.emplace_back(voxels.x, voxels.y, voxels.z);
        }
        for (const glm::uvec3& t : from.mesh.triangles) triangles.emplace_back(t.x, t.y, t.z);
    }
};

void time_bake(benchmark::State& state, const std::function<std::size_t()>& bake) {
    std::size_t voxels = 0;
    core::with_thread_limit(kThreads, [&] {
        for ([[maybe_unused]] const auto _ : state) {
            voxels = bake();
            benchmark::ClobberMemory();
        }
    });
    state.counters["voxels"] = static_cast<double>(voxels);
}

void bake_ours(benchmark::State& state, const BenchMesh& from) {
    time_bake(state, [&] {
        const sdf::SampledField field =
            sdf::bake_mesh({from.mesh.positions, from.mesh.triangles}, {.voxel_size = from.voxel});
        std::size_t active = 0;
        for (const sdf::FieldLeaf& leaf : field.leaves) {
            for (int i = 0; i < sdf::kLeafSize; ++i) active += leaf.is_active(i);
        }
        return active;
    });
}

void bake_openvdb(benchmark::State& state, const BenchMesh& from, int flags) {
    const OpenVdbMesh mesh(from);
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(mesh.points,
                                                                                             mesh.triangles);
    const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
    time_bake(state, [&] {
        const openvdb::FloatGrid::Ptr grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
            adapter, *transform, sdf::kBandVoxels, sdf::kBandVoxels, flags);
        return grid->activeVoxelCount();
    });
}

}  // namespace

int main(int count, char** arguments) {
    try {
        openvdb::initialize();
        benchmark::Initialize(&count, arguments);
        if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 64;
        constexpr int kResolution = 128;
        const std::string mesh_name = "blob";
        const BenchMesh mesh = make_bench_mesh(mesh_name, kResolution);
        const auto add = [&](const char* baker, const std::function<void(benchmark::State&)>& run) {
            benchmark::RegisterBenchmark(fmt::format("bake/{}/{}/{}", baker, mesh_name, kResolution).c_str(),
                                         run)
                ->Unit(benchmark::kMillisecond)
                ->MeasureProcessCPUTime()
                ->UseRealTime();
        };
        add("ours", [&](benchmark::State& state) { bake_ours(state, mesh); });
        add("openvdb", [&](benchmark::State& state) { bake_openvdb(state, mesh, 0); });
        add("openvdb_unsigned", [&](benchmark::State& state) {
            bake_openvdb(state, mesh, openvdb::tools::UNSIGNED_DISTANCE_FIELD);
        });
        benchmark::RunSpecifiedBenchmarks();
        benchmark::Shutdown();
        return 0;
    } catch (const core::InputError& error) {
        fmt::print(stderr, "fieldlight_bake_bench: {}\n", error.what());
        return static_cast<int>(error.kind());
    }
}
