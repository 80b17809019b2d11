// An OBJ (with MTL), PLY or STL file, told apart by its first bytes, and all that follows from loading it.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/scene/scene_loader.h"
#include "tests/fuzz/exercise_scene.h"
#include "tests/fuzz/fuzz_input.h"

namespace {

/// An OBJ file may name "input.obj", the only file in its folder, as its material library: it is both.
const char* file_name_for(std::string_view text) {
    if (text.starts_with("ply")) return "input.ply";
    // A binary STL may begin with anything; those that are made here say so.
    if (text.starts_with("solid") || text.starts_with("STL")) return "input.stl";
    return "input.obj";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const auto path = fuzz::input_file(file_name_for(text), {data, size});
    fuzz::read_or_refuse([&] { fuzz::exercise_scene(core::load_scene_file(path)); });
    return 0;
}
