#include "gather/final_gather.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <optional>
#include <utility>

#include "core/support/error.h"
#include "core/support/parallel.h"
#include "core/trace/surface.h"
#include "gather/effect_costs.h"
#include "gather/integrate/bent_normal.h"
#include "gather/integrate/integrate.h"
#include "gather/integrate/reflection_reuse.h"
#include "gather/integrate/reflections.h"
#include "gather/lighting/outlines.h"
#include "gather/lighting/scene_lighting.h"
#include "gather/lighting/visible_surfaces.h"
#include "gather/screen_probes/filtering.h"
#include "gather/screen_probes/near_field.h"
#include "gather/screen_probes/placement.h"
#include "gather/screen_probes/probe_visibility.h"
#include "gather/screen_probes/tracing.h"
#include "gather/temporal/accumulation.h"

namespace gather {

namespace {

using Clock = std::chrono::steady_clock;

/// What each pass of a picture took, by name, in the order of their first call.
class Ledger {
public:
    explicit Ledger(core::StopRequested stop_requested) : stop_requested_(std::move(stop_requested)) {}

    /// @throws core::Interrupted before a pass, when asked to stop
    template <typename Work>
    void time(const char* name, const Work& work) {
        if (stop_requested_ && stop_requested_()) throw core::Interrupted();
        const auto start = Clock::now();
        const PassRays rays = work();
        const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
        exhausted_ += rays.exhausted;
        for (core::PassCost& pass : passes_) {
            if (pass.name != name) continue;
            pass.seconds += seconds;
            pass.rays += rays.rays;
            return;
        }
        passes_.push_back({name, seconds, rays.rays});
    }

    const std::vector<core::PassCost>& passes() const { return passes_; }
    std::uint64_t exhausted() const { return exhausted_; }

private:
    core::StopRequested stop_requested_;
    std::vector<core::PassCost> passes_;
    std::uint64_t exhausted_ = 0;
};

/// Everything that lives as long as one picture.
class Picture {
public:
    Picture(const core::RenderInputs& inputs, const Settings& settings, const Plan& plan)
        : inputs_(inputs),
          settings_(settings),
          plan_(plan),
          lighting_(inputs.scene, inputs.tracer, planned_lighting(settings, plan)),
          hit_lighting_(inputs.scene, inputs.tracer, lighting_,
                        settings.bounces > 0 && !lighting_.everything().empty(),
                        settings.lighting.hit_roughness_min, settings.lighting.hit_roughness_min),
          mirrored_lighting_(inputs.scene, inputs.tracer, lighting_,
                             settings.bounces > 0 && !lighting_.everything().empty(), 0.0f,
                             settings.lighting.hit_roughness_min),
          outlines_(inputs.width, inputs.height,
                    plan.on(Effect::kTemporal) ? settings.film.outline_samples : 1),
          accumulation_(inputs.width, inputs.height, inputs.aovs, compares_near_light()),
          ledger_(inputs.stop_requested) {
        if (plan.on(Effect::kScreenProbes)) table_.emplace(settings.screen_probes.resolution);
    }

    /// The frame as an ordered list of passes.
    void render_frame(std::uint32_t frame) {
        if (!plan_.on(Effect::kTemporal)) accumulation_.clear();
        const std::size_t pixels =
            static_cast<std::size_t>(inputs_.width) * static_cast<std::size_t>(inputs_.height);
        direct_.assign(pixels, glm::vec3(0.0f));
        ledger_.time("primary", [&] {
            return find_visible_surfaces(inputs_, lighting_, outlines_.film_indices(), visible_);
        });
        if (outlines_.wanted()) {
            Outlines::Rays rays;
            ledger_.time("outlines", [&] {
                rays = outlines_.sample(inputs_, lighting_, visible_);
                return PassRays{rays.camera_rays, rays.exhausted};
            });
            ledger_.time("outline_shadows", [&] { return PassRays{rays.shadow_rays, 0}; });
        }
        if (lighting_.samples_anything()) {
            ledger_.time("direct", [&] {
                return add_direct_light(inputs_, lighting_, visible_,
                                        lighting_.direct_samples(settings_.lighting.direct_samples), frame,
                                        direct_);
            });
        }
        if (plan_.on(Effect::kScreenProbes)) gather_light(frame);
        ledger_.time("accumulate", [&] {
            accumulate();
            return PassRays{};
        });
    }

    core::Frame finish(int frame_count);

private:
    /// Whether short rays are compared with the probes: their light has control variates.
    bool compares_near_light() const {
        return plan_.on(Effect::kBentNormal) && settings_.integrate.near_field == NearField::kTraced;
    }
    void gather_light(std::uint32_t frame);
    SpecularReaders specular_readers() const;
    void trace_smooth(std::uint32_t frame);
    template <bool kGathers, bool kCompares>
    FramePixel frame_pixel(std::size_t pixel) const;
    template <bool kGathers, bool kCompares>
    FramePixel outline_pixel(const OutlineSample& sample) const;
    template <bool kGathers, bool kCompares>
    void accumulate_pixels();
    void accumulate();
    void add_probe_layers(core::Image& image) const;
    /// Each uniform probe's map over its tile.
    template <typename Value>
    void spread_over_tiles(const std::vector<Value>& texels, std::vector<float>& values) const;

    const core::RenderInputs& inputs_;
    const Settings& settings_;
    const Plan& plan_;
    SceneLighting lighting_;
    HitLighting hit_lighting_;
    HitLighting mirrored_lighting_;  ///< As sharp as it is: such rays stand for one pixel, not for a probe's.
    std::optional<TexelTable> table_;  ///< Where there are probes.
    Outlines outlines_;
    Accumulation accumulation_;
    Ledger ledger_;

    VisibleSurfaces visible_;
    std::vector<glm::vec3> direct_;
    IndirectLight indirect_;
    ReflectionRays reflection_rays_;
    ProbeAtlas atlas_, last_atlas_;
    bool has_last_ = false;
    double probe_light_ = 0.0, clamped_light_ = 0.0;  ///< Of all frames; see ProbeTraceCost.
    std::vector<ProbeWeights> weights_;
    std::vector<BentNormal> bent_;
    std::vector<NearLight> near_light_;
    NearHistory history_;
};

void Picture::gather_light(std::uint32_t frame) {
    const ScreenProbeSettings& probes = settings_.screen_probes;
    const bool guided = plan_.on(Effect::kLightingPdf);
    const bool filtered = plan_.on(Effect::kSpatialFilter);
    const bool directional = plan_.on(Effect::kRoughSpecular);
    if (guided) {
        std::swap(atlas_, last_atlas_);
        has_last_ = frame > 0;
    }
    ledger_.time("place_probes", [&] {
        place_probes(visible_, probes, plan_.on(Effect::kAdaptiveProbes), frame, inputs_.seed, atlas_);
        return PassRays{};
    });
    ProbeTraceCost cost;
    ledger_.time("trace_probes", [&] {
        cost = trace_probes({.inputs = inputs_,
                             .visible = visible_,
                             .lighting = lighting_,
                             .hit_lighting = hit_lighting_,
                             .table = *table_,
                             .settings = probes,
                             .last = has_last_ ? &last_atlas_ : nullptr,
                             .cull = probes.importance_sampling && filtered,
                             .specular_readers = directional ? specular_readers() : SpecularReaders{},
                             .frame = frame},
                            atlas_);
        probe_light_ += cost.light;
        clamped_light_ += cost.clamped;
        return PassRays{cost.probe_rays, cost.exhausted};
    });
    ledger_.time("probe_shadows", [&] { return PassRays{cost.shadow_rays, 0}; });
    const bool bent = plan_.on(Effect::kBentNormal);
    const bool traced = compares_near_light();
    if (traced) {
        ledger_.time("near_field", [&] {
            take_out_near_field(probes, visible_, settings_.integrate.bent_normal_pixels, atlas_);
            return PassRays{};
        });
    }
    if (filtered) {
        ledger_.time("filter_probes", [&] {
            filter_probes(probes, *table_, atlas_);
            return PassRays{};
        });
    }
    const IntegrateInputs in{visible_, atlas_, *table_, probes, settings_.integrate, inputs_.seed, frame};
    ledger_.time("integrate", [&] {
        interpolate_probes(in, weights_);
        return PassRays{};
    });
    if (probes.probe_visibility && probes.spacing > 1) {
        ledger_.time("probe_visibility", [&] {
            return hide_probes(inputs_, visible_, atlas_, history_.openness, frame, weights_);
        });
    }
    if (bent) {
        BentNormalRays rays;
        ledger_.time("bent_normal", [&] {
            const NearLighting near{hit_lighting_, atlas_, weights_, history_};
            rays = trace_bent_normals(inputs_, visible_, settings_.integrate, frame, traced ? &near : nullptr,
                                      bent_, near_light_);
            if (traced) {
                share_near_light(visible_, settings_.integrate, probes.plane_sharpness, frame, bent_,
                                 history_, near_light_);
            }
            return PassRays{rays.short_rays, rays.exhausted};
        });
        if (traced) ledger_.time("bent_normal_shadows", [&] { return PassRays{rays.shadow_rays, 0}; });
    }
    ledger_.time("integrate", [&] {
        const bool cone = bent && !traced;
        if (cone || settings_.integrate.diffuse == DiffuseIntegral::kSh) project_to_sh(*table_, atlas_);
        static const std::vector<BentNormal> kOpen;
        indirect_.reset(visible_.depth.size(), compares_near_light());
        integrate_diffuse(in, weights_, cone ? bent_ : kOpen, near_light_, indirect_);
        integrate_specular(in, weights_, {directional, plan_.on(Effect::kReflections)}, near_light_,
                           indirect_);
        return PassRays{};
    });
    if (plan_.on(Effect::kReflections)) trace_smooth(frame);
}

SpecularReaders Picture::specular_readers() const {
    const IntegrateSettings& integrate = settings_.integrate;
    const float mirrored = plan_.on(Effect::kReflections) ? integrate.reflection_roughness_max : -1.0f;
    return {.above = mirrored, .most = integrate.rough_specular_max};
}

void Picture::trace_smooth(std::uint32_t frame) {
    ReflectionCost cost;
    ledger_.time("reflections", [&] {
        cost = trace_reflections(inputs_, visible_, mirrored_lighting_, settings_.integrate, frame,
                                 reflection_rays_);
        return PassRays{cost.rays, cost.exhausted};
    });
    ledger_.time("reflection_shadows", [&] { return PassRays{cost.shadow_rays, 0}; });
    ledger_.time("reflection_reuse", [&] {
        reuse_reflections(visible_, reflection_rays_, settings_.integrate, inputs_.seed, frame,
                          indirect_.specular);
        return PassRays{};
    });
}

/// @tparam kGathers whether there are probes @tparam kCompares whether near light is compared with them
template <bool kGathers, bool kCompares>
FramePixel Picture::frame_pixel(std::size_t pixel) const {
    FramePixel value;
    value.direct = visible_.emitted[pixel] + direct_[pixel];
    value.steps = static_cast<float>(visible_.steps[pixel]);
    if (!visible_.surface(pixel)) return value;
    const core::SurfacePoint& point = visible_.points[pixel];
    value.surface = true;
    value.depth = visible_.depth[pixel];
    value.distance = visible_.distance[pixel];
    value.normal = point.frame.normal;
    value.albedo = core::approximate_albedo(point.brdf);
    value.bent_normal = bent_.empty() ? point.frame.normal : bent_[pixel].direction;
    if constexpr (kGathers) {
        value.indirect_diffuse = indirect_.diffuse[pixel];
        value.indirect_specular = indirect_.specular[pixel];
        if constexpr (kCompares) {
            value.diffuse_control = indirect_.diffuse_control[pixel];
            value.specular_control = indirect_.specular_control[pixel];
        }
        value.probe_support = weights_[pixel].support;
    }
    return value;
}

template <bool kGathers, bool kCompares>
FramePixel Picture::outline_pixel(const OutlineSample& sample) const {
    FramePixel value;
    if (sample.source < OutlineSample::kAlone) {
        value = frame_pixel<kGathers, kCompares>(sample.source);
        value.indirect_diffuse *= sample.tint;
        value.indirect_specular *= sample.tint;
        value.diffuse_control *= sample.tint;
        value.specular_control *= sample.tint;
    }
    value.surface = sample.source != OutlineSample::kSky;
    value.depth = sample.depth;
    value.distance = sample.distance;
    value.normal = sample.normal;
    value.albedo = sample.albedo;
    value.direct = sample.direct;
    value.steps = static_cast<float>(sample.steps);
    return value;
}

template <bool kGathers, bool kCompares>
void Picture::accumulate_pixels() {
    core::parallel_for(visible_.depth.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t pixel = begin; pixel < end; ++pixel)
            accumulation_.add(pixel, frame_pixel<kGathers, kCompares>(pixel));
    });
    outlines_.for_pixels([&](std::span<const OutlineSample> samples) {
        for (const OutlineSample& sample : samples) {
            accumulation_.add(sample.pixel, outline_pixel<kGathers, kCompares>(sample));
        }
    });
}

void Picture::accumulate() {
    if (compares_near_light()) {
        accumulate_pixels<true, true>();
    } else if (plan_.on(Effect::kScreenProbes)) {
        accumulate_pixels<true, false>();
    } else {
        accumulate_pixels<false, false>();
    }
    outlines_.end_frame(visible_);
}

void Picture::add_probe_layers(core::Image& image) const {
    // Of the last frame: probes move from one to the next.
    if (inputs_.aovs.count("Probes")) {
        static constexpr std::array<glm::vec3, 4> kLevelColors = {
            glm::vec3(1.0f), glm::vec3(0.1f, 0.9f, 0.1f), glm::vec3(1.0f, 0.7f, 0.0f),
            glm::vec3(1.0f, 0.1f, 0.1f)};
        std::vector<glm::vec3> colors(visible_.depth.size(), glm::vec3(0.0f));
        for (const Probe& probe : atlas_.probes) {
            if (!probe.valid()) continue;
            colors[visible_.index(probe.pixel.x, probe.pixel.y)] =
                kLevelColors[static_cast<std::size_t>(probe.level)];
        }
        image.add_color("Probes", colors);
    }
    if (inputs_.aovs.count("RaysPerTexel")) {
        spread_over_tiles(atlas_.ray_count, image.add_channel("RaysPerTexel.Y"));
    }
    if (inputs_.aovs.count("ProbeHitDistance")) {
        spread_over_tiles(atlas_.hit_distance, image.add_channel("ProbeHitDistance.Z"));
    }
}

template <typename Value>
void Picture::spread_over_tiles(const std::vector<Value>& texels, std::vector<float>& values) const {
    if (texels.empty()) return;
    for (int y = 0; y < visible_.height; ++y) {
        for (int x = 0; x < visible_.width; ++x) {
            const int tile = (y / atlas_.spacing) * atlas_.tiles_x + x / atlas_.spacing;
            const int u = (x % atlas_.spacing) * atlas_.resolution / atlas_.spacing;
            const int v = (y % atlas_.spacing) * atlas_.resolution / atlas_.spacing;
            values[visible_.index(x, y)] =
                static_cast<float>(texels[static_cast<std::size_t>(tile) * atlas_.texel_count() +
                                          static_cast<std::size_t>(v * atlas_.resolution + u)]);
        }
    }
}

core::Image crop_image(const core::Image& image, const core::Crop& crop) {
    core::Image result(crop.width, crop.height);
    for (const core::Channel& channel : image.channels()) {
        std::vector<float>& values = result.add_channel(channel.name);
        for (int y = 0; y < crop.height; ++y) {
            const auto from =
                channel.values.begin() + static_cast<std::ptrdiff_t>(y + crop.y) * image.width() + crop.x;
            std::copy(from, from + crop.width, values.begin() + static_cast<std::ptrdiff_t>(y) * crop.width);
        }
    }
    return result;
}

core::Frame Picture::finish(int frame_count) {
    core::Frame frame;
    std::vector<float> control_shares;
    for (const ProbeAgreement& pixel : history_.agreement) control_shares.push_back(pixel.probe_share());
    frame.image = accumulation_.develop(control_shares);
    add_probe_layers(frame.image);
    if (inputs_.crop.width > 0) frame.image = crop_image(frame.image, inputs_.crop);
    frame.passes = ledger_.passes();
    for (const core::PassCost& pass : frame.passes) frame.rays += pass.rays;
    frame.exhausted_rays = ledger_.exhausted();
    frame.clamped_share = clamped_light_ > 0.0 ? clamped_light_ / probe_light_ : 0.0;
    frame.samples_per_pixel = frame_count;
    return frame;
}

void check_layers(const std::set<std::string>& layers) {
    static const std::set<std::string> known = {"Depth",
                                                "Normal",
                                                "Albedo",
                                                "Direct",
                                                "IndirectDiffuse",
                                                "IndirectSpecular",
                                                "HitDistance",
                                                "BentNormal",
                                                "Steps",
                                                "Probes",
                                                "RaysPerTexel",
                                                "ProbeWeight",
                                                "ProbeHitDistance",
                                                "FilmSamples"};
    for (const std::string& layer : layers) {
        if (known.count(layer)) continue;
        std::string names;
        for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
        throw core::InputError(core::ErrorKind::kUsage,
                               fmt::format("--aov {}: the final gather writes {}", layer, names));
    }
}

}  // namespace

std::uint64_t FinalGather::picture_bytes(int width, int height, const Settings& settings,
                                         const std::set<std::string>& aovs) {
    const std::uint64_t pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
    Plan everything;
    for (PlannedEffect& effect : everything.effects) effect.on = true;
    return effect_bytes(everything, width, height, settings) + Accumulation::bytes(width, height, aovs) +
           Outlines::bytes(width, height, settings.film.outline_samples) +
           pixels * (kVisibleSurfaceBytes + 3 * sizeof(glm::vec3) + sizeof(ProbeWeights));
}

core::Frame FinalGather::render(const core::RenderInputs& inputs) {
    check_layers(inputs.aovs);
    const auto start = Clock::now();
    Picture picture(inputs, settings_, plan_);
    int done = 0;
    while (done < settings_.frames) {
        const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
        if (done > 0 && inputs.time_budget_seconds > 0.0 && elapsed >= inputs.time_budget_seconds) break;
        picture.render_frame(static_cast<std::uint32_t>(done));
        ++done;
        if (!inputs.progress) continue;
        const double by_count = static_cast<double>(done) / settings_.frames;
        const double by_time = inputs.time_budget_seconds > 0.0 ? elapsed / inputs.time_budget_seconds : 0.0;
        inputs.progress("render", std::min(1.0, std::max(by_count, by_time)));
    }
    return picture.finish(done);
}

}  // namespace gather
