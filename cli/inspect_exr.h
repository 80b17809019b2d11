// cli/inspect_exr.h: what an EXR file holds.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace cli {

/// Reads the whole file and returns `{"schema":1,"width":..,"height":..,"data_window":[x0,y0,x1,y1],
/// "display_window":[..],"compression":..,"tiled":bool,"channels":[{"name":..,"type":..,"min":..,"max":..,
/// "mean":..,"nan":..,"inf":..}],"nan":..,"inf":..,"attributes":{..},"warnings":[..]}`. Statistics of a
/// channel are over its finite values, null where there are none; `nan` and `inf` are counts.
/// @throws core::InputError as core::read_exr_file
nlohmann::json inspect_exr(const std::filesystem::path& path);

/// The same as text for the person at the terminal; ends in a newline.
std::string describe_exr(const nlohmann::json& inspected);

}  // namespace cli
