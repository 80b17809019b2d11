#include "tests/bench/bench_embree.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "core/support/error.h"

namespace tests {

class EmbreeScene {
public:
    EmbreeScene(const core::Scene& scene, bool robust);

    RTCScene root() const { return root_.get(); }
    bool has_instances() const { return !meshes_.empty(); }

private:
    using DeviceHandle =
        std::unique_ptr<RTCDeviceTy, decltype([](RTCDevice device) { rtcReleaseDevice(device); })>;
    using SceneHandle = std::unique_ptr<RTCSceneTy, decltype([](RTCScene scene) { rtcReleaseScene(scene); })>;

    SceneHandle new_scene(bool robust) const;
    void add_mesh(RTCScene target, const core::Mesh& mesh, const glm::dmat4& matrix) const;

    DeviceHandle device_;
    SceneHandle root_;
    std::vector<SceneHandle> meshes_;  ///< Empty where the only instance lies in the root.
};

EmbreeScene::EmbreeScene(const core::Scene& scene, bool robust)
    : device_(rtcNewDevice("ignore_config_files=1")) {
    root_ = new_scene(robust);
    if (scene.instances.size() == 1) {
        const core::Instance& instance = scene.instances[0];
        add_mesh(root_.get(), scene.meshes[instance.mesh], instance.world_from_local);
    } else {
        for (const core::Mesh& mesh : scene.meshes) {
            meshes_.push_back(new_scene(robust));
            add_mesh(meshes_.back().get(), mesh, glm::dmat4(1.0));
            rtcCommitScene(meshes_.back().get());
        }
        for (std::size_t i = 0; i < scene.instances.size(); ++i) {
            const core::Instance& instance = scene.instances[i];
            const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
            rtcSetGeometryInstancedScene(geometry, meshes_[instance.mesh].get());
            const glm::mat4 matrix(instance.world_from_local);
            rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, &matrix[0][0]);
            rtcCommitGeometry(geometry);
            rtcAttachGeometryByID(root_.get(), geometry, static_cast<unsigned>(i));
            rtcReleaseGeometry(geometry);
        }
    }
    rtcCommitScene(root_.get());
    if (const RTCError error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE) {
        throw core::InputError(core::ErrorKind::kOutOfMemory,
                               fmt::format("Embree cannot build '{}' (error {})", scene.name, int(error)));
    }
}

EmbreeScene::SceneHandle EmbreeScene::new_scene(bool robust) const {
    SceneHandle scene(rtcNewScene(device_.get()));
    rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneFlags(scene.get(), robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    return scene;
}

void EmbreeScene::add_mesh(RTCScene target, const core::Mesh& mesh, const glm::dmat4& matrix) const {
    const RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    auto* const vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.positions.size()));
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::vec3 vertex(matrix * glm::dvec4(glm::dvec3(mesh.positions[i]), 1.0));
        std::memcpy(vertices + 3 * i, &vertex, sizeof(vertex));
    }
    void* const triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                    3 * sizeof(unsigned), mesh.triangles.size());
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(target, geometry, 0);
    rtcReleaseGeometry(geometry);
}

namespace {

template <int Width>
struct Packet;
template <>
struct Packet<1> {
    using RayHit = RTCRayHit;
    using Ray = RTCRay;
};
template <>
struct Packet<8> {
    using RayHit = RTCRayHit8;
    using Ray = RTCRay8;
};
template <>
struct Packet<16> {
    using RayHit = RTCRayHit16;
    using Ray = RTCRay16;
};

/// A packet's column; a single ray's member is a column of one.
template <typename T>
T* column(T& scalar) {
    return &scalar;
}
template <typename T, std::size_t N>
T* column(T (&entries)[N]) {
    return entries;
}

template <int Width, typename T, typename Member>
void load(Member& member, const core::Column<T>& from, std::size_t first) {
    std::memcpy(column(member), from.data() + first, Width * sizeof(T));
}
template <int Width, typename T, typename Member>
void store(Member& member, core::Column<T>& to, std::size_t first) {
    std::memcpy(to.data() + first, column(member), Width * sizeof(T));
}

/// Columns are padded to 16 with rays that end before they begin, so that whole packets can be read.
template <int Width>
void load_rays(const core::RayStream& rays, std::size_t first, typename Packet<Width>::Ray& packet,
               int* valid) {
    load<Width>(packet.org_x, rays.origin_x, first);
    load<Width>(packet.org_y, rays.origin_y, first);
    load<Width>(packet.org_z, rays.origin_z, first);
    load<Width>(packet.tnear, rays.t_min, first);
    load<Width>(packet.dir_x, rays.direction_x, first);
    load<Width>(packet.dir_y, rays.direction_y, first);
    load<Width>(packet.dir_z, rays.direction_z, first);
    load<Width>(packet.tfar, rays.t_max, first);
    for (int lane = 0; lane < Width; ++lane) {
        valid[lane] = column(packet.tnear)[lane] <= column(packet.tfar)[lane] ? -1 : 0;
    }
}

/// What every ray has alike.
template <int Width>
typename Packet<Width>::Ray blank_rays() {
    typename Packet<Width>::Ray packet{};
    for (int lane = 0; lane < Width; ++lane) column(packet.mask)[lane] = ~0u;
    return packet;
}

template <int Width>
void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context,
               typename Packet<Width>::RayHit* packet) {
    if constexpr (Width == 16) rtcIntersect16(valid, scene, context, packet);
    if constexpr (Width == 8) rtcIntersect8(valid, scene, context, packet);
    if constexpr (Width == 1) rtcIntersect1(scene, context, packet);
}

template <int Width>
void occlude(const int* valid, RTCScene scene, RTCIntersectContext* context,
             typename Packet<Width>::Ray* packet) {
    if constexpr (Width == 16) rtcOccluded16(valid, scene, context, packet);
    if constexpr (Width == 8) rtcOccluded8(valid, scene, context, packet);
    if constexpr (Width == 1) rtcOccluded1(scene, context, packet);
}

class EmbreeTracer : public core::Tracer {
public:
    EmbreeTracer(std::shared_ptr<const EmbreeScene> scene, EmbreeCall call, bool is_coherent)
        : scene_(std::move(scene)), call_(call), is_coherent_(is_coherent) {}

    void trace_closest(const core::RayStream& rays, core::HitStream& hits) const override {
        hits.resize(rays.size());
        switch (call_) {
            case EmbreeCall::kSingle:
                return closest_packets<1>(rays, hits);
            case EmbreeCall::kPacket8:
                return closest_packets<8>(rays, hits);
            case EmbreeCall::kPacket16:
                return closest_packets<16>(rays, hits);
            case EmbreeCall::kStream:
                return closest_stream(rays, hits);
        }
    }

    void trace_occluded(const core::RayStream& rays, std::span<std::uint8_t> occluded) const override {
        switch (call_) {
            case EmbreeCall::kSingle:
                return occluded_packets<1>(rays, occluded);
            case EmbreeCall::kPacket8:
                return occluded_packets<8>(rays, occluded);
            case EmbreeCall::kPacket16:
                return occluded_packets<16>(rays, occluded);
            case EmbreeCall::kStream:
                return occluded_stream(rays, occluded);
        }
    }

    float start_offset(std::uint32_t) const override { return 0.0f; }

private:
    RTCIntersectContext new_context() const {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags =
            is_coherent_ ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
        return context;
    }

    template <int Width>
    void closest_packets(const core::RayStream& rays, core::HitStream& hits) const {
        RTCIntersectContext context = new_context();
        const bool has_instances = scene_->has_instances();
        alignas(64) int valid[Width];
        alignas(64) typename Packet<Width>::RayHit packet{};
        packet.ray = blank_rays<Width>();
        for (std::size_t first = 0; first < rays.size(); first += Width) {
            load_rays<Width>(rays, first, packet.ray, valid);
            for (int lane = 0; lane < Width; ++lane) column(packet.hit.geomID)[lane] = core::kNoIndex;
            intersect<Width>(valid, scene_->root(), &context, &packet);
            store<Width>(packet.ray.tfar, hits.t, first);
            store<Width>(packet.hit.Ng_x, hits.normal_x, first);
            store<Width>(packet.hit.Ng_y, hits.normal_y, first);
            store<Width>(packet.hit.Ng_z, hits.normal_z, first);
            store<Width>(packet.hit.u, hits.barycentric_u, first);
            store<Width>(packet.hit.v, hits.barycentric_v, first);
            store<Width>(packet.hit.primID, hits.triangle, first);
            // The only geometry of a scene without instances is number 0, and so is its instance.
            if (has_instances) {
                store<Width>(packet.hit.instID[0], hits.instance, first);
            } else {
                store<Width>(packet.hit.geomID, hits.instance, first);
            }
            for (int lane = 0; lane < Width; ++lane) {
                hits.status[first + static_cast<std::size_t>(lane)] =
                    column(packet.hit.geomID)[lane] == core::kNoIndex ? core::HitStatus::kMiss
                                                                      : core::HitStatus::kHit;
            }
        }
    }

    template <int Width>
    void occluded_packets(const core::RayStream& rays, std::span<std::uint8_t> occluded) const {
        RTCIntersectContext context = new_context();
        alignas(64) int valid[Width];
        alignas(64) typename Packet<Width>::Ray packet = blank_rays<Width>();
        for (std::size_t first = 0; first < rays.size(); first += Width) {
            load_rays<Width>(rays, first, packet, valid);
            occlude<Width>(valid, scene_->root(), &context, &packet);
            const std::size_t count = std::min<std::size_t>(Width, rays.size() - first);
            for (std::size_t lane = 0; lane < count; ++lane) {
                occluded[first + lane] = column(packet.tfar)[lane] < 0.0f ? 1 : 0;
            }
        }
    }

    /// Columns that Embree wants and our streams have not.
    struct Extra {
        core::Column<float> time, t_max;
        core::Column<std::uint32_t> mask, zero, geometry;
    };

    RTCRayNp stream_rays(const core::RayStream& rays, float* t_max, Extra& extra) const {
        const std::size_t count = rays.size();
        if (extra.time.size() < count) {
            extra.time.resize(count, 0.0f);
            extra.mask.resize(count, ~0u);
            extra.zero.resize(count, 0u);
        }
        std::memcpy(t_max, rays.t_max.data(), count * sizeof(float));
        // Embree writes nothing of a ray but t_max.
        const auto mutable_column = [](const core::Column<float>& from) {
            return const_cast<float*>(from.data());
        };
        RTCRayNp result;
        result.org_x = mutable_column(rays.origin_x);
        result.org_y = mutable_column(rays.origin_y);
        result.org_z = mutable_column(rays.origin_z);
        result.tnear = mutable_column(rays.t_min);
        result.dir_x = mutable_column(rays.direction_x);
        result.dir_y = mutable_column(rays.direction_y);
        result.dir_z = mutable_column(rays.direction_z);
        result.time = extra.time.data();
        result.tfar = t_max;
        result.mask = extra.mask.data();
        result.id = extra.zero.data();
        result.flags = extra.zero.data();
        return result;
    }

    void closest_stream(const core::RayStream& rays, core::HitStream& hits) const {
        static thread_local Extra extra;
        RTCIntersectContext context = new_context();
        const std::size_t count = rays.size();
        RTCRayHitNp stream;
        stream.ray = stream_rays(rays, hits.t.data(), extra);
        stream.hit.Ng_x = hits.normal_x.data();
        stream.hit.Ng_y = hits.normal_y.data();
        stream.hit.Ng_z = hits.normal_z.data();
        stream.hit.u = hits.barycentric_u.data();
        stream.hit.v = hits.barycentric_v.data();
        stream.hit.primID = hits.triangle.data();
        extra.geometry.assign(count, core::kNoIndex);
        stream.hit.geomID = extra.geometry.data();
        stream.hit.instID[0] = hits.instance.data();
        rtcIntersectNp(scene_->root(), &context, &stream, static_cast<unsigned>(count));
        for (std::size_t i = 0; i < count; ++i) {
            hits.status[i] =
                extra.geometry[i] == core::kNoIndex ? core::HitStatus::kMiss : core::HitStatus::kHit;
        }
        if (!scene_->has_instances()) {
            std::memcpy(hits.instance.data(), extra.geometry.data(), count * sizeof(std::uint32_t));
        }
    }

    void occluded_stream(const core::RayStream& rays, std::span<std::uint8_t> occluded) const {
        static thread_local Extra extra;
        RTCIntersectContext context = new_context();
        const std::size_t count = rays.size();
        extra.t_max.resize(count);
        const RTCRayNp stream = stream_rays(rays, extra.t_max.data(), extra);
        rtcOccludedNp(scene_->root(), &context, &stream, static_cast<unsigned>(count));
        for (std::size_t i = 0; i < count; ++i) occluded[i] = extra.t_max[i] < 0.0f ? 1 : 0;
    }

    std::shared_ptr<const EmbreeScene> scene_;
    EmbreeCall call_;
    bool is_coherent_;
};

}  // namespace

std::shared_ptr<const EmbreeScene> build_embree_scene(const core::Scene& scene, bool robust) {
    return std::make_shared<const EmbreeScene>(scene, robust);
}

std::unique_ptr<core::Tracer> make_embree_tracer(std::shared_ptr<const EmbreeScene> scene, EmbreeCall call,
                                                 bool is_coherent) {
    return std::make_unique<EmbreeTracer>(std::move(scene), call, is_coherent);
}

}  // namespace tests
