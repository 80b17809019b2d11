// tests/cli/sample_report.h: reports with known content, for the tests of the page that tells them.
#pragma once

#include <cstdint>
#include <string>

#include "cli/report.h"

namespace tests {

/// A whole report: triangles with a fit, fields with one and without, a single point, values that are not
/// numbers, texts that a page must escape (kHostileText among them), geometry, stages and pictures of 48
/// x 36.
cli::Report sample_report();

/// Markup, quotes, an entity, non-ASCII and a byte that is not UTF-8.
inline const std::string kHostileText =
    "</script><b onclick='x'>\"&amp; \u00FC\u6F22 http://example.invalid/ \xFF";

/// A picture of that size whose values are noise of all magnitudes: nothing compresses worse.
cli::ReportPicture noisy_picture(const std::string& name, int width, int height, std::uint32_t seed);

}  // namespace tests
