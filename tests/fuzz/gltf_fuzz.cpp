// A glTF or GLB file, and all that follows from loading it.
#include <cstddef>
#include <cstdint>

#include "core/scene/gltf_loader.h"
#include "tests/fuzz/exercise_scene.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    // URIs are relative to its folder, where "input.gltf" is the only file: it may name itself.
    const auto path = fuzz::input_file("input.gltf", {data, size});
    fuzz::read_or_refuse([&] { fuzz::exercise_scene(core::load_gltf(path)); });
    return 0;
}
