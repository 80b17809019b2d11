#include "cli/inspect_exr.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/image/exr.h"

namespace cli {

namespace {

using nlohmann::json;

json window_array(const core::ExrWindow& window) {
    return {window.min_x, window.min_y, window.max_x, window.max_y};
}

json channel_statistics(const std::vector<float>& values) {
    double smallest = 0.0, largest = 0.0, sum = 0.0;
    std::size_t finite = 0, nan = 0, inf = 0;
    for (const float value : values) {
        if (std::isnan(value)) {
            ++nan;
        } else if (std::isinf(value)) {
            ++inf;
        } else {
            smallest = finite == 0 ? value : std::min<double>(smallest, value);
            largest = finite == 0 ? value : std::max<double>(largest, value);
            sum += value;
            ++finite;
        }
    }
    json statistics = {{"min", nullptr}, {"max", nullptr}, {"mean", nullptr}, {"nan", nan}, {"inf", inf}};
    if (finite > 0) {
        statistics["min"] = smallest;
        statistics["max"] = largest;
        statistics["mean"] = sum / static_cast<double>(finite);
    }
    return statistics;
}

/// The type that the file declares, or how a channel that is not in the file was made.
std::string declared_type(const core::ExrInfo& info, const std::string& name) {
    const auto found =
        std::find_if(info.channels.begin(), info.channels.end(),
                     [&](const core::ExrChannelInfo& channel) { return channel.name == name; });
    return found == info.channels.end() ? "from luminance and chroma" : found->type;
}

json warnings_of(const core::ExrInfo& info, std::size_t nan, std::size_t inf) {
    json warnings = json::array();
    if (nan + inf > 0) warnings.push_back(fmt::format("{} values are NaN and {} infinite", nan, inf));
    if (info.data_window != info.display_window) {
        warnings.push_back("the data window is not the display window; pixels are those of the data window");
    }
    return warnings;
}

/// Names and values come from the file and may be any bytes; JSON must be UTF-8.
json with_valid_text(const json& value) {
    return json::parse(value.dump(-1, ' ', false, json::error_handler_t::replace));
}

std::string number_text(const json& value) {
    return value.is_null() ? "-" : fmt::format("{:.6g}", value.get<double>());
}

}  // namespace

json inspect_exr(const std::filesystem::path& path) {
    const core::ExrFile file = core::read_exr_file(path);
    json channels = json::array();
    std::size_t nan = 0, inf = 0;
    for (const core::Channel& channel : file.image.channels()) {
        json entry = channel_statistics(channel.values);
        nan += entry["nan"].get<std::size_t>();
        inf += entry["inf"].get<std::size_t>();
        entry["name"] = channel.name;
        entry["type"] = declared_type(file.info, channel.name);
        channels.push_back(std::move(entry));
    }
    return with_valid_text({{"schema", 1},
                            {"width", file.info.width},
                            {"height", file.info.height},
                            {"data_window", window_array(file.info.data_window)},
                            {"display_window", window_array(file.info.display_window)},
                            {"compression", file.info.compression},
                            {"tiled", file.info.tiled},
                            {"channels", std::move(channels)},
                            {"nan", nan},
                            {"inf", inf},
                            {"attributes", file.info.attributes},
                            {"warnings", warnings_of(file.info, nan, inf)}});
}

std::string describe_exr(const json& inspected) {
    std::string text = fmt::format(
        "{} x {} pixels, {}, {}\n", inspected["width"].get<int>(), inspected["height"].get<int>(),
        inspected["compression"].get<std::string>(), inspected["tiled"].get<bool>() ? "tiles" : "scanlines");
    text += fmt::format("{:<24} {:<6} {:>12} {:>12} {:>12} {:>8} {:>8}\n", "channel", "type", "min", "max",
                        "mean", "nan", "inf");
    for (const json& channel : inspected["channels"]) {
        text +=
            fmt::format("{:<24} {:<6} {:>12} {:>12} {:>12} {:>8} {:>8}\n", channel["name"].get<std::string>(),
                        channel["type"].get<std::string>(), number_text(channel["min"]),
                        number_text(channel["max"]), number_text(channel["mean"]),
                        channel["nan"].get<std::size_t>(), channel["inf"].get<std::size_t>());
    }
    for (const auto& [name, value] : inspected["attributes"].items()) {
        text += fmt::format("{}: {}\n", name, value.get<std::string>());
    }
    for (const json& warning : inspected["warnings"])
        text += fmt::format("warning: {}\n", warning.get<std::string>());
    return text;
}

}  // namespace cli
