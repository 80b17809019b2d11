// cli/report_pictures.h: the report's pictures as the page holds them: thumbnails for all, exact values for
// as many as fit.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "cli/report.h"
#include "cli/report_colors.h"

namespace cli {

/// One picture and its maps.
struct EncodedPicture {
    std::string color, flip, error, steps;  ///< PNG data URIs; empty where the report has no such map.
    bool exact = false;                     ///< Its values are in `data`.
};

/// All pictures of a report.
struct EncodedPictures {
    std::vector<EncodedPicture> pictures;  ///< In the report's order.
    int thumbnail_width = 0, thumbnail_height = 0;
    float ev = 0.0f;   ///< EV100 of the thumbnails, and where the viewer starts: automatic, of the reference.
    HeatScale steps;   ///< Common to all.
    std::string data;  ///< HTML: the values as <script> elements that no browser runs; see viewer_data.js.
};

/// Encodes all pictures into less than `budget` bytes. Thumbnails are made narrower until they take at most a
/// fifth; then the values of the reference, the triangles and the fields from the finest down, each with its
/// maps, as long as they fit. @pre each picture has width * height > 0 pixels, as have maps that are not
/// empty; budget >= 64 kB a picture
EncodedPictures encode_pictures(const Report& report, std::size_t budget);

}  // namespace cli
