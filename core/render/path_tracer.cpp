#include "core/render/path_tracer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>

#include "core/math/random.h"
#include "core/render/film.h"
#include "core/render/light_sampler.h"
#include "core/support/error.h"
#include "core/support/parallel.h"
#include "core/trace/surface.h"

namespace core {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTileSize = 16;
constexpr int kPathsPerWave = 4096;

/// Paths play roulette from this vertex on; before, the gain is smaller than the noise it adds.
constexpr int kRouletteVertex = 3;
constexpr float kMinimumSurvival = 0.05f;
constexpr int kLongPathVertex = 16;
constexpr float kLongPathSurvival = 0.95f;

/// Later vertices take independent random numbers, which cost a third of the low-discrepancy points: after
/// two scatterings their stratification no longer shows in the picture.
constexpr int kStratifiedVertices = 2;

/// Sobol dimensions by use, so that leaving one out shifts no other.
enum Dimension : std::uint32_t { kFilm, kAlpha, kFirstVertex };
enum VertexDimension : std::uint32_t { kLobe, kLight, kDirection, kRoulette, kAlphaNext, kAlphaShadow };
constexpr std::uint32_t kDimensionsPerVertex = 8;

enum Pass : std::size_t { kPrimary, kBounce, kShadow, kShade, kPassCount };
constexpr std::array<const char*, kPassCount> kPassNames = {"primary", "bounce", "shadow", "shade"};

/// One path under way.
struct Path {
    glm::vec3 throughput{1.0f};
    float direction_pdf = 0.0f;  ///< Of the ray under way; unused for camera rays.
    LightReceiver receiver;      ///< Where that ray left.
    LightSampler::Selection selection;
    glm::vec3 diffuse_share{0.0f};  ///< Of the first scattering, by channel.
    SampleSequence sequence{0, 0};
    FilmSample result;

    /// Adds light that has been scattered `scatterings` times.
    void add(const glm::vec3& light, int scatterings) {
        result.radiance += light;
        if (scatterings <= 1) {
            result.direct += light;
        } else {
            result.indirect_diffuse += light * diffuse_share;
        }
    }
};

/// Light that arrives if its shadow ray gets through.
struct PendingLight {
    std::uint32_t path;
    glm::vec3 light;
};

bool any_positive(const glm::vec3& v) {
    return v.x > 0.0f || v.y > 0.0f || v.z > 0.0f;
}

std::uint32_t vertex_dimension(int vertex, VertexDimension use) {
    return kFirstVertex + static_cast<std::uint32_t>(vertex) * kDimensionsPerVertex + use;
}

glm::vec2 vertex_point(const Path& path, int vertex, VertexDimension use) {
    const std::uint32_t dimension = vertex_dimension(vertex, use);
    return vertex < kStratifiedVertices ? path.sequence.point(dimension)
                                        : path.sequence.independent_point(dimension);
}

int batch_count(const std::set<std::string>& aovs) {
    return aovs.count("Variance") ? PathTracer::kBatchCount : 1;
}

/// Everything that is the same for all tiles of a picture.
class Job {
public:
    Job(const RenderInputs& inputs, const PathTracerSettings& settings, const Crop& crop)
        : inputs_(inputs),
          settings_(settings),
          crop_(crop),
          scene_(inputs.scene),
          lights_(inputs.scene),
          camera_(inputs.camera, inputs.width, inputs.height),
          batch_count_(batch_count(inputs.aovs)),
          film_(crop.width, crop.height, batch_count_, inputs.aovs) {
        start_offsets_.resize(scene_.instances.size());
        for (std::uint32_t i = 0; i < scene_.instances.size(); ++i) {
            start_offsets_[i] = inputs.tracer.start_offset(i);
        }
    }

    /// Adds samples [first, first + count) to every pixel.
    void render_round(int first, int count);

    Frame finish(int sample_count, double wall_seconds) const;

private:
    struct Wave;

    void render_tile(Wave& wave, int tile_x, int tile_y, int first_sample, int sample_count);
    void start_paths(Wave& wave, const std::vector<glm::ivec2>& pixels, int first_sample,
                     int sample_count) const;
    void shade(Wave& wave, int vertex) const;
    void shade_miss(Path& path, const Ray& ray, const Hit& hit, int vertex) const;
    void shade_emission(Path& path, const glm::vec3& emission, const Ray& ray, const Hit& hit,
                        int vertex) const;
    void sample_lights(Wave& wave, std::uint32_t path_index, const SurfacePoint& surface,
                       const glm::vec3& outgoing, const glm::vec3& origin, int vertex) const;
    bool scatter(Wave& wave, std::uint32_t path_index, const SurfacePoint& surface, const glm::vec3& outgoing,
                 const glm::vec3& origin, int vertex) const;
    void resolve_shadows(Wave& wave, int vertex) const;
    std::unique_ptr<Wave> take_wave();
    void give_back(std::unique_ptr<Wave> wave);
    void count(Pass pass, Clock::time_point since, std::size_t rays);

    bool samples_lights() const { return settings_.light_sampling && !lights_.empty(); }
    bool bounded() const { return settings_.bounces >= 0; }

    const RenderInputs& inputs_;
    const PathTracerSettings& settings_;
    const Crop crop_;
    const Scene& scene_;
    LightSampler lights_;
    CameraRays camera_;
    const int batch_count_;  ///< Samples are dealt to that many independently scrambled sequences in turn.
    Film film_;
    std::vector<float> start_offsets_;
    std::array<std::atomic<std::int64_t>, kPassCount> nanoseconds_{};
    std::array<std::atomic<std::uint64_t>, kPassCount> rays_{};
    std::atomic<std::uint64_t> exhausted_{0};
    std::mutex spare_mutex_;
    std::vector<std::unique_ptr<Wave>> spare_waves_;  ///< Kept, so that tiles do not wait for memory.
};

/// The paths of a tile that advance together, with the streams they share.
struct Job::Wave {
    std::vector<Path> paths;
    std::vector<std::uint32_t> active;  ///< Path of each ray under way.
    RayStream rays;
    HitStream hits;
    std::vector<std::uint32_t> next_active;
    RayStream next_rays;
    std::vector<PendingLight> pending;
    RayStream shadow_rays;
    std::vector<std::uint8_t> occluded;
    std::uint64_t exhausted = 0;
};

void Job::count(Pass pass, Clock::time_point since, std::size_t rays) {
    nanoseconds_[pass] += std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - since).count();
    rays_[pass] += rays;
}

void Job::render_round(int first, int count) {
    const int tiles_x = (crop_.width + kTileSize - 1) / kTileSize;
    const int tiles_y = (crop_.height + kTileSize - 1) / kTileSize;
    parallel_for(static_cast<std::size_t>(tiles_x) * static_cast<std::size_t>(tiles_y), 1,
                 [&](std::size_t begin, std::size_t end) {
                     const ScopedFlushDenormals flush;
                     std::unique_ptr<Wave> wave = take_wave();
                     for (std::size_t tile = begin; tile < end; ++tile) {
                         if (inputs_.stop_requested && inputs_.stop_requested()) throw Interrupted();
                         render_tile(*wave, static_cast<int>(tile % static_cast<std::size_t>(tiles_x)),
                                     static_cast<int>(tile / static_cast<std::size_t>(tiles_x)), first,
                                     count);
                     }
                     give_back(std::move(wave));
                 });
}

std::unique_ptr<Job::Wave> Job::take_wave() {
    const std::lock_guard lock(spare_mutex_);
    if (spare_waves_.empty()) return std::make_unique<Wave>();
    std::unique_ptr<Wave> wave = std::move(spare_waves_.back());
    spare_waves_.pop_back();
    return wave;
}

void Job::give_back(std::unique_ptr<Wave> wave) {
    const std::lock_guard lock(spare_mutex_);
    spare_waves_.push_back(std::move(wave));
}

void Job::render_tile(Wave& wave, int tile_x, int tile_y, int first_sample, int sample_count) {
    std::vector<glm::ivec2> pixels;  // Within the crop.
    for (int y = tile_y * kTileSize; y < std::min((tile_y + 1) * kTileSize, crop_.height); ++y) {
        for (int x = tile_x * kTileSize; x < std::min((tile_x + 1) * kTileSize, crop_.width); ++x) {
            pixels.emplace_back(x, y);
        }
    }

    start_paths(wave, pixels, first_sample, sample_count);
    for (int vertex = 0; !wave.active.empty(); ++vertex) {
        auto start = Clock::now();
        (vertex == 0 ? inputs_.primary : inputs_.tracer).trace_closest(wave.rays, wave.hits);
        count(vertex == 0 ? kPrimary : kBounce, start, wave.rays.size());

        start = Clock::now();
        shade(wave, vertex);
        count(kShade, start, 0);

        start = Clock::now();
        const std::size_t shadow_count = wave.shadow_rays.size();
        resolve_shadows(wave, vertex);
        count(kShadow, start, shadow_count);
        std::swap(wave.rays, wave.next_rays);
        std::swap(wave.active, wave.next_active);
    }
    exhausted_ += wave.exhausted;
    wave.exhausted = 0;

    std::size_t path = 0;
    for (const glm::ivec2& pixel : pixels) {
        const std::size_t index = static_cast<std::size_t>(pixel.y) * static_cast<std::size_t>(crop_.width) +
                                  static_cast<std::size_t>(pixel.x);
        for (int sample = first_sample; sample < first_sample + sample_count; ++sample, ++path) {
            film_.add(index, sample % batch_count_, wave.paths[path].result);
        }
    }
}

void Job::start_paths(Wave& wave, const std::vector<glm::ivec2>& pixels, int first_sample,
                      int sample_count) const {
    const std::size_t path_count = pixels.size() * static_cast<std::size_t>(sample_count);
    wave.paths.assign(path_count, Path{});
    wave.active.resize(path_count);
    wave.rays.resize(path_count);
    const auto seed_low = static_cast<std::uint32_t>(inputs_.seed);
    const auto seed_high = static_cast<std::uint32_t>(inputs_.seed >> 32);
    std::uint32_t index = 0;
    for (const glm::ivec2& pixel : pixels) {
        const glm::ivec2 film_pixel(pixel.x + crop_.x, pixel.y + crop_.y);
        const auto pixel_key =
            static_cast<std::uint32_t>(film_pixel.y) * 0x10001u + static_cast<std::uint32_t>(film_pixel.x);
        for (int sample = first_sample; sample < first_sample + sample_count; ++sample, ++index) {
            const auto batch = static_cast<std::uint32_t>(sample % batch_count_);
            Path& path = wave.paths[index];
            path.sequence = SampleSequence(hash_words(seed_low, seed_high, pixel_key, batch),
                                           static_cast<std::uint32_t>(sample / batch_count_));
            Ray ray = camera_.ray(glm::vec2(film_pixel) + path.sequence.point(kFilm));
            ray.seed = path.sequence.bits(kAlpha);
            wave.rays.set(index, ray);
            wave.active[index] = index;
        }
    }
}

void Job::shade(Wave& wave, int vertex) const {
    wave.next_rays.resize(wave.active.size());
    wave.shadow_rays.resize(wave.active.size());
    wave.next_active.clear();
    wave.pending.clear();
    const bool last_vertex = bounded() && vertex > settings_.bounces;
    const bool record = vertex == 0 && !film_.beauty_only();
    // The camera's tracer may place a surface elsewhere than the tracer that goes on from there.
    const bool change_of_tracer = vertex == 0 && &inputs_.primary != &inputs_.tracer;
    for (std::size_t i = 0; i < wave.active.size(); ++i) {
        const std::uint32_t path_index = wave.active[i];
        Path& path = wave.paths[path_index];
        const Ray ray = wave.rays.get(i);
        const Hit hit = wave.hits.get(i);
        if (record) path.result.steps = static_cast<float>(hit.steps);
        if (!hit.hit()) {
            if (hit.status == HitStatus::kExhausted) ++wave.exhausted;
            shade_miss(path, ray, hit, vertex);
            continue;
        }
        if (last_vertex && !lights_.emits(hit.instance, hit.triangle)) continue;
        const SurfacePoint surface = surface_at(scene_, ray, hit);
        if (vertex == 0) path.result.hit = true;
        if (record) {
            path.result.depth = camera_.depth(surface.position);
            path.result.distance = hit.t;
            path.result.normal = surface.frame.normal;
            path.result.albedo = approximate_albedo(surface.brdf);
        }
        if (any_positive(surface.emission)) shade_emission(path, surface.emission, ray, hit, vertex);
        if (last_vertex) continue;

        const glm::vec3 origin =
            surface.origin_above(change_of_tracer ? start_offsets_[surface.instance] : 0.0f);
        const glm::vec3 outgoing = surface.frame.to_local(-ray.direction);
        path.receiver = {origin, surface.geometric_normal};
        if (samples_lights()) sample_lights(wave, path_index, surface, outgoing, origin, vertex);
        if (scatter(wave, path_index, surface, outgoing, origin, vertex)) {
            wave.next_active.push_back(path_index);
        }
    }
    wave.next_rays.resize(wave.next_active.size());
    wave.shadow_rays.resize(wave.pending.size());
}

void Job::shade_miss(Path& path, const Ray& ray, const Hit& hit, int vertex) const {
    // An exhausted ray claims neither surface nor sky: black, and counted.
    if (hit.status == HitStatus::kExhausted) return;
    const bool weighted = vertex > 0 && samples_lights();
    const glm::vec3 radiance = weighted ? lights_.weighted_escaped_radiance(path.receiver, path.selection,
                                                                            ray.direction, path.direction_pdf)
                                        : lights_.escaped_radiance(ray.direction);
    path.add(path.throughput * radiance, vertex);
}

void Job::shade_emission(Path& path, const glm::vec3& emission, const Ray& ray, const Hit& hit,
                         int vertex) const {
    float weight = 1.0f;
    if (vertex > 0 && samples_lights()) {
        const float light_pdf = lights_.emitter_pdf(path.receiver, path.selection, hit.instance, hit.triangle,
                                                    ray.direction, hit.t);
        weight = power_heuristic(path.direction_pdf, light_pdf);
    }
    path.add(path.throughput * emission * weight, vertex);
}

void Job::sample_lights(Wave& wave, std::uint32_t path_index, const SurfacePoint& surface,
                        const glm::vec3& outgoing, const glm::vec3& origin, int vertex) const {
    Path& path = wave.paths[path_index];
    path.selection = lights_.selection(path.receiver);
    const LightSampler::Sample light =
        lights_.sample(path.receiver, path.selection, vertex_point(path, vertex, kLight));
    if (!(light.pdf > 0.0f) || !any_positive(light.radiance) ||
        !(glm::dot(light.direction, surface.geometric_normal) > 0.0f)) {
        return;
    }
    const glm::vec3 incoming = surface.frame.to_local(light.direction);
    const BrdfEvaluation brdf = evaluate(surface.brdf, outgoing, incoming);
    const glm::vec3 brdf_value = brdf.value.sum();
    if (!any_positive(brdf_value)) return;
    const float weight = light.delta ? 1.0f : power_heuristic(light.pdf, brdf.pdf);
    const glm::vec3 arriving =
        path.throughput * brdf_value * light.radiance * (incoming.z * weight / light.pdf);
    if (!any_positive(arriving)) return;

    // The ray stops short of the emitter by what the tracer may misplace its surface.
    const float stop_short =
        light.instance == kNoIndex ? 0.0f : start_offsets_[light.instance] + 4e-6f * light.distance;
    Ray ray;
    ray.origin = origin;
    ray.direction = light.direction;
    ray.t_max = light.distance - stop_short;
    if (!(ray.t_max > 0.0f)) return;
    ray.seed = path.sequence.bits(vertex_dimension(vertex, kAlphaShadow));
    wave.shadow_rays.set(wave.pending.size(), ray);
    wave.pending.push_back({path_index, arriving});
}

bool Job::scatter(Wave& wave, std::uint32_t path_index, const SurfacePoint& surface,
                  const glm::vec3& outgoing, const glm::vec3& origin, int vertex) const {
    Path& path = wave.paths[path_index];
    const BrdfSample scattered = sample(surface.brdf, outgoing, vertex_point(path, vertex, kLobe).x,
                                        vertex_point(path, vertex, kDirection));
    if (!(scattered.pdf > 0.0f)) return false;
    const glm::vec3 direction = glm::normalize(surface.frame.to_world(scattered.incoming));
    if (!(glm::dot(direction, surface.geometric_normal) > 0.0f)) return false;
    const glm::vec3 value = scattered.value.sum();
    path.throughput *= value * (scattered.incoming.z / scattered.pdf);
    if (!any_positive(path.throughput)) return false;
    if (vertex == 0) {
        for (int channel = 0; channel < 3; ++channel) {
            path.diffuse_share[channel] =
                value[channel] > 0.0f ? scattered.value.diffuse[channel] / value[channel] : 0.0f;
        }
    }
    if (vertex >= kRouletteVertex) {
        // Throughput alone decides, never the light: brighter lights must not change which paths live. Its
        // root, because what a path carries says little about the light it will find.
        const float brightest = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
        // Long paths die even where nothing is absorbed, or a white furnace would never end.
        const float most = vertex < kLongPathVertex ? 1.0f : kLongPathSurvival;
        const float survival = std::clamp(std::sqrt(brightest), kMinimumSurvival, most);
        if (vertex_point(path, vertex, kRoulette).x >= survival) return false;
        path.throughput /= survival;
    }
    path.direction_pdf = scattered.pdf;
    Ray ray;
    ray.origin = origin;
    ray.direction = direction;
    ray.seed = path.sequence.bits(vertex_dimension(vertex, kAlphaNext));
    wave.next_rays.set(wave.next_active.size(), ray);
    return true;
}

void Job::resolve_shadows(Wave& wave, int vertex) const {
    if (wave.pending.empty()) return;
    wave.occluded.resize(wave.pending.size());
    inputs_.tracer.trace_occluded(wave.shadow_rays, wave.occluded);
    for (std::size_t i = 0; i < wave.pending.size(); ++i) {
        if (wave.occluded[i]) continue;
        const PendingLight& pending = wave.pending[i];
        wave.paths[pending.path].add(pending.light, vertex + 1);
    }
}

Frame Job::finish(int sample_count, double wall_seconds) const {
    Frame frame;
    frame.image = film_.develop(sample_count);
    frame.samples_per_pixel = sample_count;
    frame.exhausted_rays = exhausted_;
    std::int64_t total_nanoseconds = 0;
    for (const auto& nanoseconds : nanoseconds_) total_nanoseconds += nanoseconds;
    for (std::size_t pass = 0; pass < kPassCount; ++pass) {
        // Threads' time, scaled so that the passes add up to the wall's.
        const double share = total_nanoseconds > 0 ? static_cast<double>(nanoseconds_[pass]) /
                                                         static_cast<double>(total_nanoseconds)
                                                   : 0.0;
        frame.passes.push_back({kPassNames[pass], share * wall_seconds, rays_[pass]});
        frame.rays += rays_[pass];
    }
    return frame;
}

void check_layers(const std::set<std::string>& layers, int samples_per_pixel) {
    static const std::set<std::string> known = {"Depth",    "Normal",          "Albedo",
                                                "Direct",   "IndirectDiffuse", "IndirectSpecular",
                                                "Variance", "HitDistance",     "Steps"};
    for (const std::string& layer : layers) {
        if (known.count(layer)) continue;
        std::string names;
        for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
        throw InputError(ErrorKind::kUsage, fmt::format("--aov {}: the path tracer writes {}", layer, names));
    }
    if (layers.count("Variance") && samples_per_pixel < PathTracer::kBatchCount) {
        throw InputError(
            ErrorKind::kUsage,
            fmt::format("--aov Variance: needs at least {} samples a pixel, one a batch; --spp is {}",
                        PathTracer::kBatchCount, samples_per_pixel));
    }
}

}  // namespace

std::uint64_t PathTracer::picture_bytes(int width, int height, const std::set<std::string>& aovs) {
    return Film::bytes(width, height, batch_count(aovs), aovs);
}

Frame PathTracer::render(const RenderInputs& inputs) {
    check_layers(inputs.aovs, settings_.samples_per_pixel);
    Crop crop = inputs.crop;
    if (crop.width == 0) crop = {0, 0, inputs.width, inputs.height};
    Job job(inputs, settings_, crop);

    const auto start = Clock::now();
    const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
    // Under a time budget rounds are as short as they can be, so that it is kept; else as long as a wave
    // allows.
    const bool timed = inputs.time_budget_seconds > 0.0;
    const int round_length = timed ? 1 : kPathsPerWave / (kTileSize * kTileSize);
    const int least = inputs.aovs.count("Variance") ? kBatchCount : 1;
    int done = 0;
    while (done < settings_.samples_per_pixel) {
        if (timed && done >= least && elapsed() >= inputs.time_budget_seconds) break;
        const int count = std::min(round_length, settings_.samples_per_pixel - done);
        job.render_round(done, count);
        done += count;
        if (inputs.progress) {
            const double by_count = static_cast<double>(done) / settings_.samples_per_pixel;
            const double by_time = timed ? elapsed() / inputs.time_budget_seconds : 0.0;
            inputs.progress("render", std::min(1.0, std::max(by_count, by_time)));
        }
    }
    return job.finish(done, elapsed());
}

}  // namespace core
