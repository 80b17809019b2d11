// tests/bench/trace_bench.cpp: accuracy against time, our fields against Embree and OpenVDB on the same rays.
//
//     fieldlight_bench [--side 512] [--fields FOLDER] [--benchmark_filter=...] [--benchmark_format=json] ...
//
// Rows are `trace/<tracer>/<mesh>/<rays>/<resolution>[/threads:N]`; tests/bench/trace_table.py makes a table
// of them. Rates of rows without `threads` count processor time of the one thread that traces, those of
// rows with it wall time. Side x side rays a set (a power of two). Baked fields are kept in FOLDER.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "sdf/field_kernel.h"
#include "tests/bench/bench_accuracy.h"
#include "tests/bench/bench_tracers.h"

namespace {

struct Options {
    int side = 512;
    std::filesystem::path fields = std::filesystem::temp_directory_path() / "fieldlight_bench";
};

struct Row {
    std::string tracer, mesh, rays;
    int resolution = 0;
    int threads = 0;  ///< 0: the one that runs the benchmark.

    std::string name() const {
        const std::string threads_text = threads > 0 ? fmt::format("/threads:{}", threads) : "";
        return fmt::format("trace/{}/{}/{}/{}{}", tracer, mesh, rays, resolution, threads_text);
    }
};

/// Scenes and answers, kept from row to row.
class Store {
public:
    explicit Store(const Options& options) : options_(options) {}

    tests::BenchWorld& world(const Row& row) {
        std::shared_ptr<const tests::BenchScene>& scene = scenes_[row.mesh];
        if (!scene) scene = std::make_shared<const tests::BenchScene>(tests::make_bench_scene(row.mesh));
        const sdf::SampleBits bits = tests::sample_bits_of(row.tracer);
        std::unique_ptr<tests::BenchWorld>& world = worlds_[{row.mesh, row.resolution, bits}];
        if (!world) {
            world = std::make_unique<tests::BenchWorld>(scene, row.resolution, bits, options_.fields);
        }
        return *world;
    }
    /// The same for all tracers.
    const tests::BenchRays& rays(Row row) {
        row.tracer = "sdf_cubic";
        return world(row).rays(row.rays, options_.side);
    }

    /// @pre the row's instruction set is selected
    const tests::BenchAccuracy& accuracy(const Row& row, const core::Tracer& tracer) {
        Row key = row;
        key.threads = 0;
        const auto [entry, is_new] = accuracies_.try_emplace(key.name());
        if (is_new) entry->second = tests::measure_accuracy(tracer, world(row), rays(row));
        return entry->second;
    }

private:
    Options options_;
    std::map<std::string, std::shared_ptr<const tests::BenchScene>> scenes_;
    std::map<std::tuple<std::string, int, sdf::SampleBits>, std::unique_ptr<tests::BenchWorld>> worlds_;
    std::map<std::string, tests::BenchAccuracy> accuracies_;
};

void trace_piece(const core::Tracer& tracer, const tests::BenchRays& rays, std::size_t piece) {
    const core::RayStream& stream = rays.pieces[piece];
    if (rays.is_occlusion) {
        static thread_local std::vector<std::uint8_t> occluded;
        occluded.resize(stream.size());
        tracer.trace_occluded(stream, occluded);
        benchmark::DoNotOptimize(occluded.data());
    } else {
        static thread_local core::HitStream hits;
        tracer.trace_closest(stream, hits);
        benchmark::DoNotOptimize(hits.t.data());
    }
    benchmark::ClobberMemory();
}

/// Traces on this thread; the rate is that of the processor's time.
void time_single(benchmark::State& state, const core::Tracer& tracer, const tests::BenchRays& rays) {
    const core::ScopedFlushDenormals flush;
    for ([[maybe_unused]] const auto _ : state) {
        for (std::size_t piece = 0; piece < rays.pieces.size(); ++piece) trace_piece(tracer, rays, piece);
    }
    state.counters["rays_per_second"] =
        benchmark::Counter(static_cast<double>(rays.size()), benchmark::Counter::kIsIterationInvariantRate);
}

/// Traces on several threads; the rate is that of the clock on the wall.
void time_threads(benchmark::State& state, const core::Tracer& tracer, const tests::BenchRays& rays,
                  int threads) {
    using Clock = std::chrono::steady_clock;
    Clock::duration spent{0};
    core::with_thread_limit(threads, [&] {
        for ([[maybe_unused]] const auto _ : state) {
            const Clock::time_point start = Clock::now();
            core::parallel_for(rays.pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
                const core::ScopedFlushDenormals flush;
                for (std::size_t piece = begin; piece < end; ++piece) trace_piece(tracer, rays, piece);
            });
            spent += Clock::now() - start;
        }
    });
    const double traced = static_cast<double>(rays.size()) * static_cast<double>(state.iterations());
    state.counters["rays_per_second"] = traced / std::chrono::duration<double>(spent).count();
}

void run_row(benchmark::State& state, Store& store, const Row& row) {
    try {
        const tests::BenchRays& rays = store.rays(row);
        const core::Tracer& tracer = store.world(row).tracer(row.tracer, rays.is_coherent);
        sdf::select_kernel_target(tests::kernel_target_of(row.tracer));
        const tests::BenchAccuracy& accuracy = store.accuracy(row, tracer);
        if (row.threads > 0) {
            time_threads(state, tracer, rays, row.threads);
        } else {
            time_single(state, tracer, rays);
        }
        sdf::select_kernel_target({});
        state.counters["hit_disagreement"] = accuracy.hit_disagreement;
        state.counters["reference_disagreement"] = accuracy.reference_disagreement;
        if (accuracy.steps_per_ray > 0.0) state.counters["steps_per_ray"] = accuracy.steps_per_ray;
        if (rays.is_occlusion) return;
        state.counters["mesh_error_mean_voxels"] = accuracy.mesh_error_mean_voxels;
        if (!tests::is_field_tracer(row.tracer)) return;
        state.counters["error_mean_voxels"] = accuracy.error_mean_voxels;
        state.counters["error_p99_voxels"] = accuracy.error_p99_voxels;
    } catch (const core::InputError& error) {
        state.SkipWithError(error.what());
    }
}

/// All rows. Scenes of many instances have no OpenVDB: it knows of none.
std::vector<Row> all_rows() {
    struct Bake {
        const char* mesh;
        int resolution;
    };
    constexpr Bake kBakes[] = {{"blob", 128},  {"blob", 256},   {"hall", 128},    {"hall", 256},
                               {"crowd1", 64}, {"crowd10", 64}, {"crowd100", 64}, {"crowd1000", 64}};
    std::vector<Row> rows;
    for (const Bake& bake : kBakes) {
        for (const char* kind : {"primary", "bounce", "occlusion"}) {
            for (const std::string& tracer : tests::bench_tracer_names()) {
                const std::string mesh = bake.mesh;
                if (tracer == "openvdb" && mesh.starts_with("crowd") && mesh != "crowd1") continue;
                rows.push_back({tracer, mesh, kind, bake.resolution});
            }
        }
    }
    const int most_threads = std::max(2, static_cast<int>(std::thread::hardware_concurrency()));
    for (const char* mesh : {"blob", "hall"}) {
        for (const char* tracer : {"sdf_eps", "sdf_cubic", "embree1", "embree16"}) {
            for (int threads = 1; threads <= most_threads; threads *= 2) {
                rows.push_back({tracer, mesh, "bounce", 128, threads});
            }
        }
    }
    return rows;
}

[[noreturn]] void usage(const std::string& message) {
    throw core::InputError(
        core::ErrorKind::kUsage,
        message + "\nusage: fieldlight_bench [--side N] [--fields FOLDER] [--benchmark_...]");
}

/// Takes what Google Benchmark has left.
Options parse(int count, char** arguments) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string_view whole = arguments[i];
        const std::size_t equals = whole.find('=');
        const std::string_view argument = whole.substr(0, equals);
        const auto next = [&]() -> std::string_view {
            if (equals != std::string_view::npos) return whole.substr(equals + 1);
            if (++i >= count) usage(fmt::format("'{}' wants a value", argument));
            return arguments[i];
        };
        if (argument == "--side") {
            const std::string_view text = next();
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), options.side);
            const bool is_power = options.side >= 4 && (options.side & (options.side - 1)) == 0;
            if (error != std::errc() || end != text.data() + text.size() || !is_power ||
                options.side > 4096) {
                usage(fmt::format("'--side' wants a power of two from 4 to 4096, not '{}'", text));
            }
        } else if (argument == "--fields") {
            options.fields = next();
        } else {
            usage(fmt::format("'{}' is unknown here", argument));
        }
    }
    return options;
}

}  // namespace

int main(int count, char** arguments) {
    try {
        benchmark::Initialize(&count, arguments);
        Store store(parse(count, arguments));
        for (const Row& row : all_rows()) {
            benchmark::RegisterBenchmark(row.name().c_str(), [&store, row](benchmark::State& state) {
                run_row(state, store, row);
            })->Unit(benchmark::kMillisecond);
        }
        benchmark::AddCustomContext("instruction_set", sdf::kernel_targets().front());
        benchmark::RunSpecifiedBenchmarks();
        benchmark::Shutdown();
        return 0;
    } catch (const core::InputError& error) {
        fmt::print(stderr, "fieldlight_bench: {}\n", error.what());
        return static_cast<int>(error.kind());
    }
}
