// Every picture that is read: EXR, Radiance HDR, and the PNG and JPEG of textures, told apart by their first
// bytes.
#include <cstddef>
#include <cstdint>

#include "core/image/exr.h"
#include "core/image/hdr.h"
#include "core/image/metrics.h"
#include "core/scene/sky.h"
#include "core/scene/texture.h"
#include "tests/fuzz/fuzz_input.h"

namespace {

void exercise_picture(const core::Image& image) {
    core::count_nonfinite(image);
    const auto color = image.color();
    if (!color) return;
    core::compare_images(*color, *color);
    const core::Sky sky = core::Sky::latitude_longitude(image, 0.5f, "input");
    const core::Sky::Sample sample = sky.sample({0.25f, 0.75f});
    if (sample.pdf > 0.0f) sky.pdf(sample.direction);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span<const std::uint8_t> bytes(data, size);
    if (size == 0) return 0;
    if (bytes[0] == '#') {
        fuzz::read_or_refuse([&] { exercise_picture(core::decode_hdr(bytes, "input.hdr")); });
    } else if (bytes[0] == 0x89 || bytes[0] == 0xff) {
        fuzz::read_or_refuse([&] {
            const core::TextureImage image = core::decode_texture_image(bytes, "input");
            core::sample_texture({}, image, {0.999f, 0.001f}, true);
        });
    } else {
        const auto path = fuzz::input_file("input.exr", bytes);
        fuzz::read_or_refuse([&] { core::read_exr_info(path); });
        fuzz::read_or_refuse([&] { exercise_picture(core::read_exr_file(path).image); });
    }
    return 0;
}
