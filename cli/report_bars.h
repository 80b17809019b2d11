// cli/report_bars.h: the report's bars of cost by stage, as SVG written by the program: they need no script.
#pragma once

#include <string>

#include "cli/report.h"

namespace cli {

/// Seconds of the stages of each series' last rung, stacked to one bar a series, on one axis; the names of
/// the stages above. Colours are the classes t0 to t7 of cli/report/style.css, by first appearance. Empty
/// where no series has a stage that took time.
std::string stage_bars(const Report& report);

}  // namespace cli
