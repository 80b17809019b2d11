#include "gather/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

#include "core/support/error.h"
#include "core/support/spelling.h"

namespace gather {

namespace {

[[noreturn]] void fail(const std::string& message) {
    throw core::InputError(core::ErrorKind::kUsage, message);
}

/// One row of the table: how a knob is read and written.
struct Knob {
    std::string name;
    std::string values;
    std::string meaning;
    std::function<std::string(const Settings&)> get;
    std::function<bool(Settings&, std::string_view)> set;  ///< False: not one of `values`.
};

template <typename Number>
bool parse(std::string_view text, Number& number) {
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, number);
    return error == std::errc() && rest == end && !text.empty();
}

template <typename Section, typename Number>
Knob number(std::string name, Section Settings::*section, Number Section::*member, Number least, Number most,
            std::string meaning) {
    return {std::move(name), fmt::format("{} ... {}", least, most), std::move(meaning),
            [=](const Settings& s) { return fmt::format("{}", s.*section.*member); },
            [=](Settings& s, std::string_view text) {
                Number value{};
                // Written so that NaN is refused.
                if (!parse(text, value) || !(value >= least && value <= most)) return false;
                s.*section.*member = value;
                return true;
            }};
}

template <typename Section, typename Value>
Knob choice(std::string name, Section Settings::*section, Value Section::*member,
            std::vector<std::pair<std::string, Value>> values, std::string meaning) {
    std::string names;
    for (const auto& [value_name, value] : values) names += (names.empty() ? "" : "|") + value_name;
    return {std::move(name), names, std::move(meaning),
            [=](const Settings& s) {
                for (const auto& [value_name, value] : values) {
                    if (value == s.*section.*member) return value_name;
                }
                return std::string();
            },
            [=](Settings& s, std::string_view text) {
                for (const auto& [value_name, value] : values) {
                    if (value_name != text) continue;
                    s.*section.*member = value;
                    return true;
                }
                return false;
            }};
}

template <typename Section>
Knob flag(std::string name, Section Settings::*section, bool Section::*member, std::string meaning) {
    return choice<Section, bool>(std::move(name), section, member, {{"on", true}, {"off", false}},
                                 std::move(meaning));
}

const std::vector<Knob>& knobs() {
    using L = LightingSettings;
    using P = ScreenProbeSettings;
    using I = IntegrateSettings;
    constexpr auto kL = &Settings::lighting;
    constexpr auto kP = &Settings::screen_probes;
    constexpr auto kI = &Settings::integrate;
    static const std::vector<Knob> table = {
        number(
            "film.outline_samples", &Settings::film, &FilmSettings::outline_samples, 1, 64,
            "of the film a frame, in pixels that an outline crosses; all but one take their indirect light "
            "from a sample beside them"),
        choice("lighting.sampled_emitters", kL, &L::sampled_emitters,
               {{"auto", SampledEmitters::kAuto},
                {"none", SampledEmitters::kNone},
                {"all", SampledEmitters::kAll}},
               "emitters and sky that take shadow rays; the others are found by being hit"),
        number("lighting.sampled_solid_angle", kL, &L::sampled_solid_angle, 0.0f, 13.0f,
               "steradians; emitters that look larger from within the scene are not sampled"),
        number("lighting.sampled_power_share", kL, &L::sampled_power_share, 0.0f, 1.0f,
               "of the emitters' power; those with less are not sampled"),
        number("lighting.sky_peak_ratio", kL, &L::sky_peak_ratio, 0.0f, 1e6f,
               "sky beyond this multiple of its mean luminance is sampled"),
        number("lighting.hit_roughness_min", kL, &L::hit_roughness_min, 0.0f, 1.0f,
               "what gathering rays hit is lit as if no smoother: no fireflies, and blurred caustics"),
        number("lighting.direct_samples", kL, &L::direct_samples, 1, 64,
               "lights that a pixel samples a frame; no more than there are if all are points and suns"),
        choice<P, int>("screen_probes.spacing", kP, &P::spacing,
                       {{"1", 1}, {"2", 2}, {"4", 4}, {"8", 8}, {"16", 16}, {"32", 32}},
                       "pixels between uniform probes"),
        choice<P, int>("screen_probes.resolution", kP, &P::resolution,
                       {{"4", 4}, {"8", 8}, {"16", 16}, {"32", 32}}, "texels along an edge of a probe's map"),
        flag("screen_probes.jitter_placement", kP, &P::jitter_placement,
             "moves the grid from frame to frame"),
        flag("screen_probes.jitter_directions", kP, &P::jitter_directions,
             "moves rays within their texels from frame to frame"),
        flag("screen_probes.adaptive", kP, &P::adaptive, "further probes where interpolation fails"),
        number("screen_probes.adaptive_budget", kP, &P::adaptive_budget, 0.0f, 4.0f,
               "most adaptive probes, as a share of the uniform ones"),
        number("screen_probes.adaptive_threshold", kP, &P::adaptive_threshold, 0.0f, 1.0f,
               "interpolation fails where plane weights sum to less"),
        number("screen_probes.plane_sharpness", kP, &P::plane_sharpness, 0.0f, 1e8f,
               "k in exp2(-k (plane distance / scale)^2), the scale the depth or, through long lenses and "
               "without perspective, twice the height of what is seen"),
        flag("screen_probes.jitter_interpolation", kP, &P::jitter_interpolation,
             "moves a pixel within its plane before it reads its probes"),
        flag("screen_probes.probe_visibility", kP, &P::probe_visibility,
             "asks by short rays whether something hides a probe from the pixel that reads it"),
        flag("screen_probes.importance_sampling", kP, &P::importance_sampling,
             "moves rays from where the BRDF is small; needs the filter"),
        number("screen_probes.cull_threshold", kP, &P::cull_threshold, 0.0f, 1.0f,
               "of the BRDF, whose peak is about 1"),
        flag("screen_probes.lighting_pdf", kP, &P::lighting_pdf, "guides rays by the last frame's light"),
        flag("screen_probes.spatial_filter", kP, &P::spatial_filter, "averages probes with their neighbours"),
        number("screen_probes.filter_passes", kP, &P::filter_passes, 1, 8, "of the spatial filter"),
        number("screen_probes.filter_angle", kP, &P::filter_angle, 0.1f, 90.0f,
               "degrees; a neighbour's ray that deviates by more is left out"),
        flag("screen_probes.clamp_hit_distance", kP, &P::clamp_hit_distance,
             "a neighbour's hit is no farther than one's own: keeps contact shadows"),
        number("screen_probes.culled_weight", kP, &P::culled_weight, 0.0f, 1.0f,
               "of what neighbours gave a texel without rays, in later passes of the filter"),
        number("screen_probes.max_ray_intensity", kP, &P::max_ray_intensity, 0.0f, 1e12f,
               "cd/m^2; clamps brighter rays, which darkens the picture; 0: off"),
        choice("integrate.diffuse", kI, &I::diffuse,
               {{"sh", DiffuseIntegral::kSh}, {"sum", DiffuseIntegral::kSum}},
               "spherical harmonics, or the cosine summed over all texels"),
        flag("integrate.rough_specular", kI, &I::rough_specular, "reflects the probes in GGX directions"),
        number("integrate.specular_directions", kI, &I::specular_directions, 1, 64, "a pixel a frame"),
        number("integrate.rough_specular_max", kI, &I::rough_specular_max, 0.0f, 1.0f,
               "rougher surfaces reflect the probes' harmonics, without noise"),
        flag("integrate.reflections", kI, &I::reflections, "smooth surfaces take rays of their own"),
        number("integrate.reflection_roughness_max", kI, &I::reflection_roughness_max, 0.0f, 1.0f,
               "rougher surfaces reflect the probes"),
        number("integrate.reflection_rays", kI, &I::reflection_rays, 1, 64, "a smooth pixel a frame"),
        number("integrate.reflection_neighbors", kI, &I::reflection_neighbors, 0, 64,
               "whose rays a smooth pixel shares"),
        flag("integrate.bent_normal", kI, &I::bent_normal, "short rays restore contact shadows"),
        number("integrate.bent_normal_rays", kI, &I::bent_normal_rays, 1, 64, "a pixel a frame"),
        number("integrate.bent_normal_pixels", kI, &I::bent_normal_pixels, 1.0f, 64.0f,
               "length of those rays on the screen"),
        choice("integrate.near_field", kI, &I::near_field,
               {{"traced", NearField::kTraced}, {"multi_bounce", NearField::kMultiBounce}},
               "light of what the short rays hit: its own, or occlusion and an estimate"),
        number("integrate.near_field_radius", kI, &I::near_field_radius, 0, 8,
               "pixels within it on one plane share their short rays"),
        number("integrate.near_field_albedo_max", kI, &I::near_field_albedo_max, 0.0f, 1.0f,
               "caps the albedo in the multi-bounce approximation"),
        flag("temporal.accumulate", &Settings::temporal, &TemporalSettings::accumulate,
             "the picture is the mean of its frames; off: the last frame"),
    };
    return table;
}

}  // namespace

std::vector<SettingDescription> describe_settings(const Settings& settings) {
    std::vector<SettingDescription> result;
    for (const Knob& knob : knobs()) {
        result.push_back({knob.name, knob.get(settings), knob.values, knob.meaning});
    }
    return result;
}

void set_setting(Settings& settings, std::string_view name, std::string_view value) {
    std::vector<std::string> names;
    for (const Knob& knob : knobs()) {
        names.push_back(knob.name);
        if (knob.name != name) continue;
        if (!knob.set(settings, value)) fail(fmt::format("--set {}={}: takes {}", name, value, knob.values));
        return;
    }
    const std::string meant = core::nearest(name, names);
    fail(fmt::format("--set {}: no such setting{} (render --help-settings lists them)", name,
                     meant.empty() ? "" : fmt::format(", did you mean {}?", meant)));
}

Settings quality_settings(std::string_view quality) {
    Settings settings;
    if (quality == "medium") return settings;
    if (quality == "draft") {
        settings.frames = 4;
        settings.film.outline_samples = 1;
        settings.lighting.direct_samples = 1;
        settings.screen_probes.jitter_interpolation = true;  // Few frames show the grid otherwise.
        settings.screen_probes.adaptive_budget = 0.25f;
        settings.integrate.specular_directions = 2;
        settings.integrate.bent_normal_rays = 2;
    } else if (quality == "high" || quality == "ultra") {
        const bool ultra = quality == "ultra";
        settings.frames = ultra ? 64 : 32;
        settings.screen_probes.spacing = 8;
        settings.screen_probes.resolution = ultra ? 16 : 8;
        settings.integrate.specular_directions = ultra ? 16 : 8;
        settings.integrate.reflection_rays = ultra ? 4 : 2;
        settings.integrate.bent_normal_rays = ultra ? 8 : 4;
    } else {
        fail(fmt::format("--quality {}: is draft, medium, high or ultra", quality));
    }
    return settings;
}

}  // namespace gather
