#include "tests/bench/bench_tracers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <numeric>
#include <utility>

#include "core/support/error.h"
#include "sdf/baker.h"
#include "sdf/sdf_tracer.h"
#include "sdf/vdb_file.h"
#include "tests/bench/bench_openvdb.h"

namespace tests {
namespace {

struct NamedMode {
    const char* name;
    sdf::HitMode mode;
};
constexpr NamedMode kModes[] = {{"sdf_eps", sdf::HitMode::kEps},
                                {"sdf_secant", sdf::HitMode::kSecant},
                                {"sdf_cubic", sdf::HitMode::kCubic}};

struct NamedCall {
    const char* name;
    EmbreeCall call;
};
constexpr NamedCall kCalls[] = {{"embree1", EmbreeCall::kSingle},
                                {"embree8", EmbreeCall::kPacket8},
                                {"embree16", EmbreeCall::kPacket16},
                                {"embree_stream", EmbreeCall::kStream}};
constexpr const char* kFast = "_fast";
constexpr const char* kCoarse = "_8bit";

/// "AVX3_ZEN4" as part of a tracer's name.
std::string suffix_of(const std::string& target) {
    std::string suffix = "_";
    for (const char c : target) suffix += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return suffix;
}

sdf::SampledField bake(const core::Scene& scene, int resolution, const std::filesystem::path& cache) {
    sdf::BakeSettings settings;
    settings.resolution = resolution;
    const sdf::BakeResult result = sdf::bake_scene(scene, settings, cache / fmt::format("{}", resolution));
    const sdf::MeshBake& bake = result.meshes.at(0);
    if (bake.error) throw *bake.error;
    sdf::SampledField field = sdf::read_field(bake.file);
    if (field.info.half_thickness > 0.0) {
        throw core::InputError(
            core::ErrorKind::kBadData,
            fmt::format("'{}' has sheets or thin walls at {}: that would measure the triangles within",
                        scene.name, resolution));
    }
    return field;
}

sdf::TriangleBvh tree_of(const core::Mesh& mesh) {
    std::vector<sdf::Triangle> triangles;
    for (const glm::uvec3& t : mesh.triangles) {
        triangles.push_back({glm::dvec3(mesh.positions[t.x]), glm::dvec3(mesh.positions[t.y]),
                             glm::dvec3(mesh.positions[t.z])});
    }
    std::vector<std::uint32_t> all(triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    return {triangles, all};
}

}  // namespace

std::vector<std::string> bench_tracer_names() {
    std::vector<std::string> names;
    // The best one is what the plain name stands for; older ones than SSE4 no build needs.
    std::vector<std::string> targets = sdf::kernel_targets();
    targets.erase(targets.begin());
    std::erase_if(targets, [](const std::string& target) { return target == "SSSE3" || target == "SSE2"; });
    for (const NamedMode& mode : kModes) {
        names.emplace_back(mode.name);
        for (const std::string& target : targets) names.push_back(mode.name + suffix_of(target));
        names.push_back(mode.name + std::string(kCoarse));
    }
    names.emplace_back("sdf_scalar");
    for (const NamedCall& call : kCalls) {
        names.emplace_back(call.name);
        names.push_back(call.name + std::string(kFast));
    }
    names.emplace_back("openvdb");
    return names;
}

std::string kernel_target_of(const std::string& tracer_name) {
    for (const std::string& target : sdf::kernel_targets()) {
        for (const NamedMode& mode : kModes) {
            if (tracer_name == mode.name + suffix_of(target)) return target;
        }
    }
    return {};
}

sdf::SampleBits sample_bits_of(const std::string& tracer_name) {
    return tracer_name.ends_with(kCoarse) ? sdf::SampleBits::k8 : sdf::SampleBits::k16;
}

bool is_field_tracer(const std::string& tracer_name) {
    return tracer_name.starts_with("sdf_") || tracer_name == "openvdb";
}

BenchWorld::BenchWorld(std::shared_ptr<const BenchScene> scene, int resolution, sdf::SampleBits bits,
                       const std::filesystem::path& cache)
    : scene_(std::move(scene)),
      field_(bake(scene_->scene, resolution, cache)),
      grids_{std::make_shared<const sdf::BrickGrid>(field_, bits)},
      mesh_tree_(tree_of(scene_->scene.meshes[0])),
      triangles_(scene_->scene),
      reference_(scene_->scene, grids_) {}

const BenchRays& BenchWorld::rays(const std::string& kind, int side) {
    const auto [entry, is_new] = rays_.try_emplace(fmt::format("{}/{}", kind, side));
    if (is_new) {
        entry->second = make_bench_rays(kind, *scene_, {triangles_, tracer("sdf_cubic", false)}, side);
    }
    return entry->second;
}

const core::Tracer& BenchWorld::tracer(const std::string& name, bool is_coherent) {
    // Instruction sets share a tracer: which one runs is set from outside.
    std::string key = name;
    for (const NamedMode& mode : kModes) {
        if (name.starts_with(mode.name)) key = mode.name;
    }
    const bool takes_hint = name.starts_with("embree");
    std::unique_ptr<core::Tracer>& entry = tracers_[takes_hint && is_coherent ? key + "/coherent" : key];
    if (!entry) entry = make_tracer(key, is_coherent);
    return *entry;
}

std::unique_ptr<core::Tracer> BenchWorld::make_tracer(const std::string& name, bool is_coherent) {
    for (const NamedMode& mode : kModes) {
        if (name == mode.name) return std::make_unique<sdf::SdfTracer>(scene(), grids_, mode.mode);
    }
    if (name == "sdf_scalar") return std::make_unique<ScalarFieldTracer>(scene(), grids_);
    if (name == "openvdb") return make_openvdb_tracer(scene(), field_);
    return make_embree(name, is_coherent);
}

std::unique_ptr<core::Tracer> BenchWorld::make_embree(const std::string& name, bool is_coherent) {
    for (const NamedCall& call : kCalls) {
        const bool is_fast = name == call.name + std::string(kFast);
        if (!is_fast && name != call.name) continue;
        std::shared_ptr<const EmbreeScene>& trees = is_fast ? fast_ : robust_;
        if (!trees) trees = build_embree_scene(scene(), !is_fast);
        return make_embree_tracer(trees, call.call, is_coherent);
    }
    throw core::InputError(core::ErrorKind::kUsage, fmt::format("no tracer '{}'", name));
}

}  // namespace tests
