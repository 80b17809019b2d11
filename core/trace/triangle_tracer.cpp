#include "core/trace/triangle_tracer.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <vector>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "core/trace/placed_mesh.h"
#include "core/trace/surface.h"

namespace core {
namespace {

/// Triangles that a mesh may have, over all instances together, to be repeated in the flattened level.
constexpr std::size_t kLargestFlattenedRepeat = 1 << 16;

/// The largest stretch between an instance's space and the world, either way: determinants, products of
/// three of them, stay in the range of floats.
constexpr double kLargestStretch = 2e12;

/// Embree asserts that coordinates of rays are under 1.8e18, in the instances' spaces too. A sum of three
/// products and a translation has room below that.
constexpr double kLargestRayCoordinate = 1e17;

/// What a geometry of the top level stands for.
struct TopGeometry {
    std::uint32_t instance = kNoIndex;
    std::uint32_t first_triangle = 0;                   ///< Of a flattened mesh.
    const std::vector<std::uint32_t>* parts = nullptr;  ///< Of an instanced mesh: first triangles.
};

/// User data of geometries that ask about alpha.
struct AlphaGeometry {
    const Scene* scene = nullptr;
    const std::vector<TopGeometry>* top = nullptr;
    std::uint32_t instance = kNoIndex;  ///< Of a flattened mesh.
    std::uint32_t first_triangle = 0;
};

using DeviceHandle =
    std::unique_ptr<RTCDeviceTy, decltype([](RTCDevice device) { rtcReleaseDevice(device); })>;
using SceneHandle = std::unique_ptr<RTCSceneTy, decltype([](RTCScene scene) { rtcReleaseScene(scene); })>;

template <int Width>
struct Packet;
template <>
struct Packet<1> {
    using RayHit = RTCRayHit;
    using Ray = RTCRay;
};
template <>
struct Packet<4> {
    using RayHit = RTCRayHit4;
    using Ray = RTCRay4;
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

/// Entry `lane` of a packet's column, which for single rays is a plain member.
template <typename T>
T& lane_of(T& scalar, int) {
    return scalar;
}
template <typename T, std::size_t N>
T& lane_of(T (&column)[N], int lane) {
    return column[lane];
}

/// Copies rays [first, first + Width) and marks with -1 the valid ones whose origin has no coordinate beyond
/// `farthest`. Returns whether any is.
template <int Width>
bool load_packet(const RayStream& rays, std::size_t first, float farthest,
                 typename Packet<Width>::Ray& packet, int* valid) {
    // One loop a column, so that the compiler copies whole vectors.
    const auto copy = [first](auto& to, const auto& from) {
        for (int lane = 0; lane < Width; ++lane) lane_of(to, lane) = from[first + std::size_t(lane)];
    };
    copy(packet.org_x, rays.origin_x);
    copy(packet.org_y, rays.origin_y);
    copy(packet.org_z, rays.origin_z);
    copy(packet.dir_x, rays.direction_x);
    copy(packet.dir_y, rays.direction_y);
    copy(packet.dir_z, rays.direction_z);
    copy(packet.tnear, rays.t_min);
    copy(packet.tfar, rays.t_max);
    copy(packet.id, rays.seed);
    int any = 0;
    for (int lane = 0; lane < Width; ++lane) {
        // A range that lies before the origin holds nothing that Embree may be asked about.
        const Ray ray = rays.get(first + std::size_t(lane));
        const glm::vec3 distance = glm::abs(ray.origin);
        valid[lane] = is_valid_ray(ray) && lane_of(packet.tfar, lane) >= 0.0f &&
                              std::max({distance.x, distance.y, distance.z}) <= farthest
                          ? -1
                          : 0;
        any |= valid[lane];
        lane_of(packet.tnear, lane) = std::max(0.0f, lane_of(packet.tnear, lane));
        lane_of(packet.time, lane) = 0.0f;
        lane_of(packet.mask, lane) = ~0u;
        lane_of(packet.flags, lane) = 0;
    }
    return any != 0;
}

template <int Width>
void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context,
               typename Packet<Width>::RayHit* packet) {
    if constexpr (Width == 16) rtcIntersect16(valid, scene, context, packet);
    if constexpr (Width == 8) rtcIntersect8(valid, scene, context, packet);
    if constexpr (Width == 4) rtcIntersect4(valid, scene, context, packet);
    if constexpr (Width == 1) rtcIntersect1(scene, context, packet);
}

template <int Width>
void occlude(const int* valid, RTCScene scene, RTCIntersectContext* context,
             typename Packet<Width>::Ray* packet) {
    if constexpr (Width == 16) rtcOccluded16(valid, scene, context, packet);
    if constexpr (Width == 8) rtcOccluded8(valid, scene, context, packet);
    if constexpr (Width == 4) rtcOccluded4(valid, scene, context, packet);
    if constexpr (Width == 1) rtcOccluded1(scene, context, packet);
}

void skip_invisible(const RTCFilterFunctionNArguments* arguments) {
    const auto& geometry = *static_cast<const AlphaGeometry*>(arguments->geometryUserPtr);
    const unsigned int count = arguments->N;
    for (unsigned int i = 0; i < count; ++i) {
        if (arguments->valid[i] == 0) continue;
        std::uint32_t instance = geometry.instance;
        if (instance == kNoIndex) {
            instance = (*geometry.top)[RTCHitN_instID(arguments->hit, count, i, 0)].instance;
        }
        const std::uint32_t triangle = geometry.first_triangle + RTCHitN_primID(arguments->hit, count, i);
        const glm::vec2 barycentrics(RTCHitN_u(arguments->hit, count, i),
                                     RTCHitN_v(arguments->hit, count, i));
        const std::uint32_t seed = RTCRayN_id(arguments->ray, count, i);
        if (!is_visible(*geometry.scene, instance, triangle, barycentrics, seed)) arguments->valid[i] = 0;
    }
}

/// Contiguous triangles that all ask about alpha, or none of them.
struct PartRun {
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;
    bool asks_alpha = false;
};

std::vector<PartRun> part_runs(const Scene& scene, const Mesh& mesh,
                               const std::vector<std::uint32_t>& instances) {
    std::vector<PartRun> runs;
    for (std::uint32_t part = 0; part < mesh.parts.size(); ++part) {
        const bool asks = std::any_of(instances.begin(), instances.end(), [&](std::uint32_t instance) {
            return may_be_invisible(scene, instance, part);
        });
        const MeshPart& range = mesh.parts[part];
        if (range.triangle_count == 0) continue;
        if (!runs.empty() && runs.back().asks_alpha == asks) {
            runs.back().triangle_count += range.triangle_count;
        } else {
            runs.push_back({range.first_triangle, range.triangle_count, asks});
        }
    }
    return runs;
}

}  // namespace

struct TriangleTracer::Impl {
    Impl(const Scene& traced_scene, const TriangleTracerOptions& options);

    void create_device(const TriangleTracerOptions& options);
    void add_flattened(std::uint32_t instance);
    void add_shared(std::uint32_t mesh, const std::vector<std::uint32_t>& instances);
    void add_part(RTCScene target, unsigned int id, const TriangleSoup& soup, const PartRun& run,
                  const AlphaGeometry* alpha);
    const AlphaGeometry* alpha_of(const PartRun& run, std::uint32_t instance);
    void check_device() const;
    void check_stretch(const Stretch& stretch, const Instance& instance);

    template <int Width>
    void trace_closest(const RayStream& rays, HitStream& hits) const;
    template <int Width>
    void trace_occluded(const RayStream& rays, std::span<std::uint8_t> occluded) const;
    void set_hit(const RayStream& rays, std::size_t i, std::uint32_t geometry, std::uint32_t primitive,
                 std::uint32_t instance, HitStream& hits) const;

    const Scene& scene;
    std::atomic<std::ptrdiff_t> embree_bytes{0};  // The device reports to it until it is gone.
    DeviceHandle device;
    SceneHandle root;
    std::vector<SceneHandle> mesh_scenes;
    int packet_width = 1;
    std::vector<std::unique_ptr<TriangleSoup>> flattened;
    std::vector<std::unique_ptr<SharedSoup>> shared;
    std::vector<std::unique_ptr<std::vector<std::uint32_t>>> part_tables;
    std::vector<std::unique_ptr<AlphaGeometry>> alpha_geometries;
    std::vector<TopGeometry> top;
    std::vector<PlacedMesh> placed;
    double world_size = 0.0;  ///< Largest |coordinate| of the world's box.
    float farthest_origin = static_cast<float>(kLargestRayCoordinate);
};

TriangleTracer::Impl::Impl(const Scene& traced_scene, const TriangleTracerOptions& options)
    : scene(traced_scene) {
    create_device(options);
    root.reset(rtcNewScene(device.get()));
    rtcSetSceneFlags(root.get(), RTC_SCENE_FLAG_ROBUST);

    std::vector<std::vector<std::uint32_t>> instances_of(scene.meshes.size());
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
        instances_of[scene.instances[i].mesh].push_back(i);
    }
    placed.resize(scene.instances.size());
    if (const DoubleBounds world = world_bounds(scene); !world.empty()) {
        const glm::dvec3 farthest = glm::max(glm::abs(world.minimum), glm::abs(world.maximum));
        world_size = std::max({farthest.x, farthest.y, farthest.z});
    }
    for (std::uint32_t mesh = 0; mesh < scene.meshes.size(); ++mesh) {
        const std::vector<std::uint32_t>& instances = instances_of[mesh];
        if (instances.empty() || scene.meshes[mesh].triangles.empty()) continue;
        const bool cheap = instances.size() == 1 ||
                           instances.size() * scene.meshes[mesh].triangles.size() <= kLargestFlattenedRepeat;
        const bool flatten = options.flatten && cheap &&
                             std::all_of(instances.begin(), instances.end(), [&](std::uint32_t instance) {
                                 return survives_flattening(scene.meshes[mesh], scene.instances[instance]);
                             });
        if (flatten) {
            for (const std::uint32_t instance : instances) add_flattened(instance);
        } else {
            add_shared(mesh, instances);
        }
    }
    rtcCommitScene(root.get());
    check_device();
}

void TriangleTracer::Impl::create_device(const TriangleTracerOptions& options) {
    std::string configuration = "ignore_config_files=1";
    if (!options.instruction_set.empty()) configuration += ",isa=" + options.instruction_set;
    device.reset(rtcNewDevice(configuration.c_str()));
    if (!device) {
        const RTCError error = rtcGetDeviceError(nullptr);
        if (error == RTC_ERROR_OUT_OF_MEMORY) {
            throw InputError(ErrorKind::kOutOfMemory,
                             fmt::format("'{}': not enough memory to start the triangle tracer", scene.name));
        }
        throw InputError(ErrorKind::kUsage,
                         fmt::format("Embree cannot start with instruction set '{}' on this processor (error "
                                     "{}); use one that it has, or none for the best",
                                     options.instruction_set, static_cast<int>(error)));
    }
    rtcSetDeviceMemoryMonitorFunction(
        device.get(),
        [](void* counter, ssize_t bytes, bool) {
            static_cast<std::atomic<std::ptrdiff_t>*>(counter)->fetch_add(bytes, std::memory_order_relaxed);
            return true;
        },
        &embree_bytes);
    packet_width = options.packet_width;
    if (packet_width == 0) {
        packet_width = rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)  ? 16
                       : rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? 8
                       : rtcGetDeviceProperty(device.get(), RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED) ? 4
                                                                                                       : 1;
    }
    if (packet_width != 1 && packet_width != 4 && packet_width != 8 && packet_width != 16) {
        throw InputError(ErrorKind::kUsage, fmt::format("packets of {} rays do not exist; use 1, 4, 8 or 16",
                                                        options.packet_width));
    }
}

void TriangleTracer::Impl::check_device() const {
    const RTCError error = rtcGetDeviceError(device.get());
    if (error == RTC_ERROR_NONE) return;
    if (error == RTC_ERROR_OUT_OF_MEMORY) {
        throw InputError(ErrorKind::kOutOfMemory,
                         fmt::format("'{}': not enough memory for the triangle tracer's trees", scene.name));
    }
    throw std::logic_error(fmt::format("Embree reports error {}", static_cast<int>(error)));
}

/// Embree would end the program on rays that it cannot hold, so no instance may ask it to.
void TriangleTracer::Impl::check_stretch(const Stretch& stretch, const Instance& instance) {
    // Written so that NaN is refused.
    const bool fits = stretch.world_from_soup <= kLargestStretch &&
                      stretch.soup_from_world <= kLargestStretch &&
                      world_size * std::max(1.0, stretch.soup_from_world) <= kLargestRayCoordinate;
    if (!fits) {
        throw InputError(
            ErrorKind::kBadData,
            fmt::format("'{}': instance '{}' is scaled {:.3g}-fold at most and 1 / {:.3g}-fold at "
                        "least in a world of size {:.3g}; scales of 1e-12 to 1e12 that are not "
                        "more than 1e17 times smaller than the world can be traced",
                        scene.name, instance.name, stretch.world_from_soup, stretch.soup_from_world,
                        world_size));
    }
    farthest_origin =
        std::min(farthest_origin, static_cast<float>(kLargestRayCoordinate / stretch.soup_from_world));
}

void TriangleTracer::Impl::add_part(RTCScene target, unsigned int id, const TriangleSoup& soup,
                                    const PartRun& run, const AlphaGeometry* alpha) {
    RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, soup.vertices.data(),
                               0, sizeof(glm::vec3), soup.vertices.size() - 2);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, soup.triangles.data(),
                               run.first_triangle * sizeof(glm::uvec3), sizeof(glm::uvec3),
                               run.triangle_count);
    if (alpha) {
        rtcSetGeometryUserData(geometry, const_cast<AlphaGeometry*>(alpha));
        rtcSetGeometryIntersectFilterFunction(geometry, skip_invisible);
        rtcSetGeometryOccludedFilterFunction(geometry, skip_invisible);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(target, geometry, id);
    rtcReleaseGeometry(geometry);
}

const AlphaGeometry* TriangleTracer::Impl::alpha_of(const PartRun& run, std::uint32_t instance) {
    if (!run.asks_alpha) return nullptr;
    alpha_geometries.push_back(
        std::make_unique<AlphaGeometry>(AlphaGeometry{&scene, &top, instance, run.first_triangle}));
    return alpha_geometries.back().get();
}

void TriangleTracer::Impl::add_flattened(std::uint32_t instance) {
    const Instance& source = scene.instances[instance];
    const Mesh& mesh = scene.meshes[source.mesh];
    flattened.push_back(std::make_unique<TriangleSoup>(flattened_soup(mesh, source)));
    const TriangleSoup& soup = *flattened.back();
    for (const PartRun& run : part_runs(scene, mesh, {instance})) {
        add_part(root.get(), static_cast<unsigned int>(top.size()), soup, run, alpha_of(run, instance));
        top.push_back({instance, run.first_triangle, nullptr});
    }
    placed[instance] = place_flattened(soup, mesh, source);
}

void TriangleTracer::Impl::add_shared(std::uint32_t mesh_index, const std::vector<std::uint32_t>& instances) {
    const Mesh& mesh = scene.meshes[mesh_index];
    shared.push_back(std::make_unique<SharedSoup>(shared_soup(mesh)));
    const SharedSoup& soup = *shared.back();

    mesh_scenes.emplace_back(rtcNewScene(device.get()));
    RTCScene mesh_scene = mesh_scenes.back().get();
    rtcSetSceneFlags(mesh_scene, RTC_SCENE_FLAG_ROBUST);
    part_tables.push_back(std::make_unique<std::vector<std::uint32_t>>());
    std::vector<std::uint32_t>& parts = *part_tables.back();
    for (const PartRun& run : part_runs(scene, mesh, instances)) {
        add_part(mesh_scene, static_cast<unsigned int>(parts.size()), soup.triangles, run,
                 alpha_of(run, kNoIndex));
        parts.push_back(run.first_triangle);
    }
    rtcCommitScene(mesh_scene);

    for (const std::uint32_t instance : instances) {
        check_stretch(stretch_of(soup, scene.instances[instance]), scene.instances[instance]);
        const glm::mat4 matrix(world_from_soup(soup, scene.instances[instance]));
        RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(geometry, mesh_scene);
        rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, &matrix[0][0]);
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(root.get(), geometry, static_cast<unsigned int>(top.size()));
        rtcReleaseGeometry(geometry);
        top.push_back({instance, 0, &parts});
        placed[instance] = place_shared(soup, mesh, scene.instances[instance]);
    }
}

void TriangleTracer::Impl::set_hit(const RayStream& rays, std::size_t i, std::uint32_t geometry,
                                   std::uint32_t primitive, std::uint32_t instance, HitStream& hits) const {
    const TopGeometry& source = top[instance == RTC_INVALID_GEOMETRY_ID ? geometry : instance];
    hits.instance[i] = source.instance;
    hits.triangle[i] = primitive + (source.parts ? (*source.parts)[geometry] : source.first_triangle);
    hits.status[i] = HitStatus::kHit;
    finish_hit(placed[source.instance], rays, i, hits);
}

template <int Width>
void TriangleTracer::Impl::trace_closest(const RayStream& rays, HitStream& hits) const {
    RTCIntersectContext context;
    // INCOHERENT is the default and stays: with COHERENT, Embree 3.13.5 does not return from some packets.
    rtcInitIntersectContext(&context);
    typename Packet<Width>::RayHit packet;
    alignas(64) int valid[Width];
    for (std::size_t first = 0; first < rays.size(); first += Width) {
        const bool any = load_packet<Width>(rays, first, farthest_origin, packet.ray, valid);
        for (int lane = 0; lane < Width; ++lane) {
            lane_of(packet.hit.geomID, lane) = RTC_INVALID_GEOMETRY_ID;
            lane_of(packet.hit.instID[0], lane) = RTC_INVALID_GEOMETRY_ID;
        }
        if (any) intersect<Width>(valid, root.get(), &context, &packet);
        for (int lane = 0; lane < Width; ++lane) {
            const std::size_t i = first + static_cast<std::size_t>(lane);
            const std::uint32_t geometry = lane_of(packet.hit.geomID, lane);
            hits.steps[i] = 0;
            hits.status[i] = HitStatus::kMiss;
            if (geometry == RTC_INVALID_GEOMETRY_ID) continue;
            // Kernels compare before they divide, so the quotient may lie an ulp outside.
            hits.t[i] = std::clamp(lane_of(packet.ray.tfar, lane), rays.t_min[i], rays.t_max[i]);
            hits.barycentric_u[i] = lane_of(packet.hit.u, lane);
            hits.barycentric_v[i] = lane_of(packet.hit.v, lane);
            set_hit(rays, i, geometry, lane_of(packet.hit.primID, lane), lane_of(packet.hit.instID[0], lane),
                    hits);
        }
    }
}

template <int Width>
void TriangleTracer::Impl::trace_occluded(const RayStream& rays, std::span<std::uint8_t> occluded) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    typename Packet<Width>::Ray packet;
    alignas(64) int valid[Width];
    for (std::size_t first = 0; first < rays.size(); first += Width) {
        const bool any = load_packet<Width>(rays, first, farthest_origin, packet, valid);
        if (any) occlude<Width>(valid, root.get(), &context, &packet);
        const std::size_t count = std::min<std::size_t>(Width, rays.size() - first);
        for (std::size_t lane = 0; lane < count; ++lane) {
            // Embree marks a blocked ray by tfar = -infinity.
            const bool blocked = valid[lane] != 0 && lane_of(packet.tfar, static_cast<int>(lane)) < 0.0f;
            occluded[first + lane] = blocked ? 1 : 0;
        }
    }
}

TriangleTracer::TriangleTracer(const Scene& scene, const TriangleTracerOptions& options)
    : impl_(std::make_unique<Impl>(scene, options)) {}

TriangleTracer::~TriangleTracer() = default;

void TriangleTracer::trace_closest(const RayStream& rays, HitStream& hits) const {
    const ScopedFlushDenormals flush;
    hits.resize(rays.size());
    switch (impl_->packet_width) {
        case 16:
            return impl_->trace_closest<16>(rays, hits);
        case 8:
            return impl_->trace_closest<8>(rays, hits);
        case 4:
            return impl_->trace_closest<4>(rays, hits);
        default:
            return impl_->trace_closest<1>(rays, hits);
    }
}

void TriangleTracer::trace_occluded(const RayStream& rays, std::span<std::uint8_t> occluded) const {
    const ScopedFlushDenormals flush;
    switch (impl_->packet_width) {
        case 16:
            return impl_->trace_occluded<16>(rays, occluded);
        case 8:
            return impl_->trace_occluded<8>(rays, occluded);
        case 4:
            return impl_->trace_occluded<4>(rays, occluded);
        default:
            return impl_->trace_occluded<1>(rays, occluded);
    }
}

float TriangleTracer::start_offset(std::uint32_t instance) const {
    return impl_->placed[instance].start_offset;
}

std::size_t TriangleTracer::bytes() const {
    std::size_t sum = static_cast<std::size_t>(impl_->embree_bytes.load()) +
                      impl_->placed.size() * sizeof(PlacedMesh) + impl_->top.size() * sizeof(TopGeometry);
    for (const auto& soup : impl_->flattened) sum += soup->bytes();
    for (const auto& soup : impl_->shared) sum += soup->triangles.bytes();
    return sum;
}

int TriangleTracer::packet_width() const {
    return impl_->packet_width;
}

}  // namespace core
