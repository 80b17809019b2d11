// cli/report_markup.h: text, numbers and tables of the report's page.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cli/report.h"

namespace cli {

/// Text as it may stand in an element or in a quoted attribute: & < > " ' are escaped. What is not UTF-8, and
/// control characters but tabs and line breaks, becomes U+FFFD.
std::string escape_html(std::string_view text);

/// At most `length` characters; the last is an ellipsis where some are left out. Not escaped. @pre length > 0
std::string shortened(std::string_view text, std::size_t length);

/// Decimals that show `value` with `digits` significant digits, 0 to 6. 0 where it is 0 or not finite.
int decimals_of(double value, int digits);

/// `value` with that many decimals, commas between thousands and a true minus; "–" for NaN, "∞" for infinity,
/// a power of ten where six decimals do not show it or 15 digits do not hold it.
std::string fixed(double value, int decimals);

/// `value` with three significant digits, whole where it is 100 or more.
std::string significant(double value);

/// The same without zeros at the end: 8, 0.1, 50.
std::string trimmed(double value);

/// 1234567 as 1,234,567.
std::string grouped(std::uint64_t value);

/// One column of a table.
struct Column {
    std::string header = {};
    std::string unit = {};        ///< Shown under the header; empty for none.
    std::string definition = {};  ///< Shown when pointed at; empty for none.
    bool text = false;            ///< Left-aligned, not a number.
};

/// One cell. All strings are HTML.
struct Cell {
    std::string value = {};     ///< Numbers with a point are aligned at it.
    std::string interval = {};  ///< Shown small below the value; empty for none.
    std::string note = {};      ///< Shown when pointed at; empty for none.
    bool strong = false;        ///< The best of its column.
    bool quiet = false;         ///< Does not count: grey.
    bool wrap = false;          ///< A sentence: grey, may take several lines.
};

/// A number with three significant digits.
Cell number_cell(double value);

/// Seconds with three significant digits, at most down to milliseconds.
Cell seconds_cell(double seconds);

/// A value with its 95 % interval, each times `scale`, all with the value's decimals.
Cell estimate_cell(const Estimate& estimate, double scale = 1.0);

/// The table, in a box that scrolls sideways where the page is narrow. The first column heads the rows; under
/// `groups` it heads several, and is empty in all but the first of them. The note stands below.
/// @pre each row has one cell a column
std::string table(std::string_view note_html, const std::vector<Column>& columns,
                  const std::vector<std::vector<Cell>>& rows, bool groups = false);

}  // namespace cli
