// cli/report_series.h: how a series is told from the others in every figure and table of the report.
//
// Colours are classes of cli/report/style.css: s0 to s7 set `--series`, in a light and a dark form.
#pragma once

#include <cstddef>
#include <string>

#include "cli/report.h"

namespace cli {

/// The class of a series' colour: s0 for triangles, s1 to s7 for the others in order, then s1 again.
/// @pre series < report.series.size()
std::string series_class(const Report& report, std::size_t series);

/// The series' marker in SVG, centred on (x, y), about as large as a circle of `radius`. Shapes differ where
/// colours may not be told apart. @pre series < report.series.size()
std::string series_marker(const Report& report, std::size_t series, double x, double y, double radius);

/// Marker and name of a series for HTML, the name escaped. @pre series < report.series.size()
std::string series_name(const Report& report, std::size_t series);

}  // namespace cli
