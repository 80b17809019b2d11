#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/options.h"
#include "cli/picture_file.h"
#include "core/image/png.h"
#include "core/image/tonemap.h"
#include "core/support/error.h"

namespace cli {

namespace {

struct ConvertOptions {
    std::string input;
    std::string output;
    std::string exposure = "auto";
    std::string tone_map = "aces";
    std::string layer;
};

float exposure_of(const ConvertOptions& options, const PictureLayer& picture) {
    if (options.exposure == "auto") {
        const std::vector<float>* alpha = picture.image.find("A");
        return core::automatic_exposure(picture.radiance,
                                        alpha ? std::span<const float>(*alpha) : std::span<const float>());
    }
    constexpr float kMaxExposure = 64.0f;
    float ev = 0.0f;
    const char* end = options.exposure.data() + options.exposure.size();
    const auto result = std::from_chars(options.exposure.data(), end, ev);
    if (result.ec != std::errc() || result.ptr != end || !(std::abs(ev) <= kMaxExposure)) {
        throw core::InputError(
            core::ErrorKind::kUsage,
            fmt::format("--exposure '{}': 'auto' or an EV100 from -64 to 64 is right", options.exposure));
    }
    return ev;
}

void convert(const ConvertOptions& options, const Program& program) {
    if (std::filesystem::path(options.output).extension() != ".png") {
        throw core::InputError(core::ErrorKind::kUsage,
                               fmt::format("'{}': only .png can be written", options.output));
    }
    const auto tone_map = core::tone_map_from_name(options.tone_map);
    if (!tone_map) {
        throw core::InputError(
            core::ErrorKind::kUsage,
            fmt::format("--tone-map '{}': aces, linear or hable is right", options.tone_map));
    }
    const PictureLayer picture = read_picture_layer(options.input, options.layer);
    const float ev = exposure_of(options, picture);
    std::size_t nonfinite = 0;
    for (const glm::vec3& color : picture.radiance) {
        nonfinite += !(std::isfinite(color.r) && std::isfinite(color.g) && std::isfinite(color.b));
    }
    core::write_png(options.output, picture.image.width(), picture.image.height(),
                    core::display_picture(picture.radiance, ev, *tone_map));
    if (nonfinite > 0) {
        warn(program,
             fmt::format("'{}': {} pixels are not finite and come out magenta", options.input, nonfinite));
    }
    note(program, fmt::format("'{}': EV {:.2f}, {}", options.output, ev, options.tone_map));
    if (program.common.json) {
        const nlohmann::json report = {
            {"schema", 1},    {"width", picture.image.width()}, {"height", picture.image.height()},
            {"exposure", ev}, {"tone_map", options.tone_map},   {"nonfinite_pixels", nonfinite}};
        std::printf("%s\n", report.dump().c_str());
    }
}

}  // namespace

void add_convert_command(CLI::App& app, Program& program) {
    const auto options = std::make_shared<ConvertOptions>();
    CLI::App& verb = *app.add_subcommand("convert", "Write a tone-mapped 8-bit preview of an EXR");
    add_common_options(verb, program.common);
    verb.add_option("input", options->input, "Picture to read: .exr or .hdr")->required();
    verb.add_option("output", options->output, "Picture to write: .png, 8-bit sRGB")->required();
    verb.add_option("--exposure", options->exposure,
                    "EV100: displayed = radiance / (1.2 x 2^EV); 'auto' takes the log-average luminance")
        ->capture_default_str();
    verb.add_option("--tone-map", options->tone_map, "Tone curve: aces, linear or hable")
        ->check(CLI::IsMember({"aces", "linear", "hable"}))
        ->capture_default_str();
    verb.add_option("--layer", options->layer, "Colour layer, such as Albedo; the beauty if not given");
    verb.footer(
        "Examples:\n"
        "  fieldlight convert room.exr room.png\n"
        "  fieldlight convert room.exr room.png --exposure 8.5 --tone-map hable\n"
        "  fieldlight convert room.exr albedo.png --layer Albedo --tone-map linear --exposure -0.263");
    verb.callback([options, &program] { run_verb(program, [&] { convert(*options, program); }); });
}

}  // namespace cli
