// cli/report_tables.h: the tables of the report's page. Definitions stand in the headers or beside the
// numbers.
#pragma once

#include <string>

#include "cli/report.h"

namespace cli {

/// One row a series: what accuracy costs, and what making the structure costs.
std::string summary_table(const Report& report);

/// One row a pair of methods at equal time. Empty where none were compared.
std::string paired_table(const Report& report);

/// One row a measure, one column a series with fields. Empty where nothing was measured.
std::string geometry_table(const Report& report);

/// One row a stage of each series' last rung. Empty where no series has stages.
std::string stage_table(const Report& report);

/// One row a point; the samples link to `#run-SERIES-POINT`.
std::string runs_table(const Report& report);

}  // namespace cli
