// core/support/progress.h: how long work tells whoever started it how far it is.
#pragma once

#include <functional>
#include <string_view>

namespace core {

/// Called from any thread, one call at a time, with the name of the stage and how much of it is done in
/// [0, 1]. An empty function means nobody listens.
using Progress = std::function<void(std::string_view stage, double fraction)>;

/// True once a stop was asked for (SIGINT, SIGTERM). Long loops poll it and end early; an empty function
/// means never.
using StopRequested = std::function<bool()>;

}  // namespace core
