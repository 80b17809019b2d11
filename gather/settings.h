// gather/settings.h: what picture the final gather makes: every knob, its unit and its default.
//
// The defaults are the row `medium` of quality_settings(). How a picture is made (threads, instruction set)
// is not here.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gather {

/// Which emitters and parts of the sky are sampled by shadow rays (S); the others (U) are found by being hit.
enum class SampledEmitters {
    kAuto,  ///< Those that look small from within the scene and carry a share of its light.
    kNone,  ///< Only lights without a surface, which no ray could hit.
    kAll,
};

struct LightingSettings {
    SampledEmitters sampled_emitters = SampledEmitters::kAuto;
    float sampled_solid_angle = 2.0f;   ///< Steradians; emitters that look larger are not sampled. 0 ... 13.
    float sampled_power_share = 1e-6f;  ///< Of all light; emitters with less are not sampled. 0 ... 1.
    float sky_peak_ratio = 4.0f;  ///< Sky radiance beyond this multiple of its mean is sampled. 0 ... 1e6.
    float hit_roughness_min =
        0.5f;                ///< What gathering rays hit is lit as if no smoother. 0 ... 1; 0: as it is.
    int direct_samples = 4;  ///< Lights that a pixel samples a frame. 1 ... 64.
};

struct FilmSettings {
    int outline_samples = 4;  ///< Of the film, a frame, in pixels that an outline crosses. 1 ... 64.
};

struct ScreenProbeSettings {
    int spacing = 16;                   ///< Pixels between uniform probes; a power of two from 1 to 32.
    int resolution = 8;                 ///< Texels along an edge of a probe's octahedral map: 4, 8, 16 or 32.
    bool jitter_placement = true;       ///< Moves the grid of probes from frame to frame.
    bool jitter_directions = true;      ///< Moves the rays within their texels from frame to frame.
    bool adaptive = true;               ///< Places further probes where interpolation fails.
    float adaptive_budget = 1.0f;       ///< Most adaptive probes, as a share of the uniform ones. 0 ... 4.
    float adaptive_threshold = 0.1f;    ///< Interpolation fails where the plane weights sum to less. 0 ... 1.
    float plane_sharpness = 1e5f;       ///< k in exp2(-k (plane distance / depth)^2). 0 ... 1e8.
    bool jitter_interpolation = false;  ///< Moves a pixel within its plane before it reads its probes.
    bool probe_visibility = true;       ///< Does not read probes that something hides from the pixel.
    bool importance_sampling = true;    ///< Moves rays from where the BRDF is under `cull_threshold`.
    float cull_threshold = 0.1f;        ///< Of the BRDF, whose peak is about 1. 0 ... 1.
    bool lighting_pdf = true;           ///< Guides rays by the light that the last frame found.
    bool spatial_filter = true;         ///< Averages probes with their neighbours.
    int filter_passes = 3;              ///< 1 ... 8.
    float filter_angle = 10.0f;         ///< Degrees; a neighbour's ray that deviates by more is left out.
    bool clamp_hit_distance = true;     ///< A neighbour's hit is no farther than one's own: keeps contacts.
    float culled_weight = 0.1f;  ///< Of what neighbours gave a texel without rays, in later passes. 0 ... 1.
    float max_ray_intensity = 0.0f;  ///< cd/m^2 of luminance; clamps brighter rays; 0: no clamp.
};

/// How the probes' light becomes irradiance.
enum class DiffuseIntegral {
    kSh,   ///< Spherical harmonics of third order, once a probe.
    kSum,  ///< The clamped cosine summed over all texels, once a pixel.
};

/// What the short rays at full resolution do with what they hit.
enum class NearField {
    kTraced,       ///< The hit's own light takes the place of the probes' in its direction.
    kMultiBounce,  ///< Occlusion alone: the probes through a cone, and an estimate of the light sent back.
};

struct IntegrateSettings {
    DiffuseIntegral diffuse = DiffuseIntegral::kSh;
    bool rough_specular = true;       ///< Reflects the probes in GGX directions; off: by harmonics.
    int specular_directions = 8;      ///< A pixel a frame. 1 ... 64.
    float rough_specular_max = 0.8f;  ///< Rougher ones reflect by harmonics. 0 ... 1.
    bool reflections = true;          ///< Smooth surfaces take rays of their own; off: they blur the probes.
    float reflection_roughness_max = 0.5f;  ///< Rougher ones reflect the probes. 0 ... 1.
    int reflection_rays = 1;                ///< A pixel of them a frame. 1 ... 64.
    int reflection_neighbors = 8;           ///< Whose rays such a pixel shares. 0 ... 64.
    bool bent_normal = true;                ///< Short rays at full resolution restore contact shadows.
    int bent_normal_rays = 4;               ///< A pixel a frame. 1 ... 64.
    float bent_normal_pixels = 16.0f;       ///< Length of those rays on the screen. 1 ... 64.
    NearField near_field = NearField::kTraced;
    int near_field_radius = 1;           ///< Pixels within it on one plane share their rays. 0 ... 8.
    float near_field_albedo_max = 0.5f;  ///< Caps the albedo in the multi-bounce estimate. 0 ... 1.
};

struct TemporalSettings {
    bool accumulate = true;  ///< The picture is the mean of its frames; off: the last frame.
};

struct Settings {
    int frames = 16;  ///< Accumulated. At least 1.
    int bounces = 1;  ///< Indirect bounces: 0 or 1, until surfaces are cached.
    FilmSettings film;
    LightingSettings lighting;
    ScreenProbeSettings screen_probes;
    IntegrateSettings integrate;
    TemporalSettings temporal;
};

/// One knob by its name on the command line, such as `screen_probes.spatial_filter`.
struct SettingDescription {
    std::string name;
    std::string value;   ///< In `settings`, as set_setting() reads it.
    std::string values;  ///< What it may be: `on|off`, `1 ... 64`.
    std::string meaning;
};

/// Every knob with its value in `settings`, in a fixed order; `frames` and `bounces` are flags of their own.
std::vector<SettingDescription> describe_settings(const Settings& settings);

/// Sets one knob. @throws core::InputError (kUsage) for a name that does not exist (with the nearest one that
/// does) and for values out of range (with what would be right).
void set_setting(Settings& settings, std::string_view name, std::string_view value);

/// The row of a quality: draft, medium, high or ultra. @throws core::InputError for another name
Settings quality_settings(std::string_view quality);

}  // namespace gather
