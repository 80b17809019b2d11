// tests/fuzz/exercise_scene.h: what the program does with a scene once it is loaded, small enough to fuzz.
#pragma once

#include "core/scene/scene.h"

namespace fuzz {

/// Asks what `inspect` asks, checks what core::Scene promises, and looks every texture up. Scenes of a few
/// triangles are also baked coarsely and rendered through both tracers. @throws core::InputError where the
/// program would refuse the scene
void exercise_scene(const core::Scene& scene);

}  // namespace fuzz
