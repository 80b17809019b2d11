// core/scene/load_options.h: what a user may ask of any reader of scenes.
#pragma once

#include <string>

namespace core {

struct LoadOptions {
    /// Name or number of the glTF scene; empty: the file's `scene`, or scene 0.
    std::string scene;
    /// Lets URIs and paths in the file leave its folder.
    bool allow_external = false;
};

}  // namespace core
