// cli/report_plot.h: the report's plot of error against cost, as SVG written by the program: it needs no
// script.
#pragma once

#include <string>

#include "cli/report.h"

namespace cli {

/// What stands on the horizontal axis of the error plot.
enum class CostAxis {
    kWarm,       ///< Wall seconds of the rendering alone.
    kCold,       ///< The same, with load, bake and build.
    kProcessor,  ///< Processor seconds over all threads.
    kRays,       ///< Millions of rays.
};

/// Relative error in percent, 100 sqrt(relMSE), as the report shows it everywhere; 0 where noise of the
/// reference made the corrected relMSE negative. NaN stays NaN.
double error_percent(double rel_mse);

/// Error against cost, log-log: points with 95 % intervals and bands, for wall time the fitted
/// sqrt(b^2 + v/t) dashed and its floor dotted, names at the ends of the lines. Points link to
/// `#run-SERIES-POINT` and are hollow where they are dominated. Empty where no point has both a cost and an
/// error.
std::string error_plot(const Report& report, CostAxis axis);

}  // namespace cli
