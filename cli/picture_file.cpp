#include "cli/picture_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "core/image/hdr.h"
#include "core/support/error.h"

namespace cli {

PictureLayer read_picture_layer(const std::filesystem::path& path, const std::string& layer) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
    PictureLayer picture;
    if (extension == ".exr") {
        core::ExrFile file = core::read_exr_file(path);
        picture.image = std::move(file.image);
        picture.window = file.info.data_window;
    } else if (extension == ".hdr") {
        picture.image = core::read_hdr(path);
        picture.window = {0, 0, picture.image.width() - 1, picture.image.height() - 1};
    } else {
        throw core::InputError(
            core::ErrorKind::kUsage,
            fmt::format("'{}': is not a picture that can be read; .exr or .hdr is right", path.string()));
    }
    auto radiance = picture.image.color(layer);
    if (!radiance) {
        std::vector<std::string> names;
        for (const core::Channel& channel : picture.image.channels()) names.push_back(channel.name);
        const std::string wanted = layer.empty() ? "R, G, B" : fmt::format("{0}.R, {0}.G, {0}.B", layer);
        throw core::InputError(core::ErrorKind::kBadData,
                               fmt::format("'{}': has no channels {}; it has {}", path.string(), wanted,
                                           fmt::join(names, ", ")));
    }
    picture.radiance = std::move(*radiance);
    return picture;
}

}  // namespace cli
