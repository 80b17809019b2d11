// cli/picture_file.h: the colours of one layer of a picture file, as the verbs on pictures need them.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "core/image/exr.h"
#include "core/image/image.h"

namespace cli {

/// One colour layer of a file.
struct PictureLayer {
    core::Image image;                ///< All channels of the file.
    core::ExrWindow window;           ///< Where its pixels lie; for a .hdr the picture itself.
    std::vector<glm::vec3> radiance;  ///< The layer, row-major.
};

/// Reads a .exr or .hdr and picks layer `layer` (R, G, B for an empty name, else `layer`.R, .G, .B).
/// @throws core::InputError as the readers do; kUsage for another extension; kBadData where the layer is
/// missing, with the channels that there are
PictureLayer read_picture_layer(const std::filesystem::path& path, const std::string& layer);

}  // namespace cli
