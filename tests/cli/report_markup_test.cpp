// tests/cli/report_markup_test.cpp: numbers, texts, tables and axes of the report's page.
#include "cli/report_markup.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "cli/report_axis.h"

namespace {

TEST(ReportMarkup, ShowsThreeSignificantDigits) {
    EXPECT_EQ(cli::significant(0.0), "0");
    EXPECT_EQ(cli::significant(3.14159), "3.14");
    EXPECT_EQ(cli::significant(31.4159), "31.4");
    EXPECT_EQ(cli::significant(314.159), "314");
    EXPECT_EQ(cli::significant(1234567.8), "1,234,568");
    EXPECT_EQ(cli::significant(0.00031416), "0.000314");
    EXPECT_EQ(cli::significant(0.9996), "1.00") << "rounding carries";
    EXPECT_EQ(cli::significant(-2.5), "\u22122.50");
    EXPECT_EQ(cli::significant(-0.0), "0");
    EXPECT_EQ(cli::significant(1.5e-9), "1.50\u202F×\u202F10⁻⁹");
    EXPECT_EQ(cli::significant(-2e20), "\u22122.00\u202F×\u202F10²⁰");
    EXPECT_EQ(cli::significant(std::nan("")), "–");
    EXPECT_EQ(cli::significant(-HUGE_VAL), "\u2212∞");
    EXPECT_EQ(cli::trimmed(8.0), "8");
    EXPECT_EQ(cli::trimmed(0.1), "0.1");
    EXPECT_EQ(cli::trimmed(0.125), "0.125");
    EXPECT_EQ(cli::trimmed(500.0), "500");
    EXPECT_EQ(cli::grouped(18446744073709551615u), "18,446,744,073,709,551,615");
}

TEST(ReportMarkup, RoundsNothingToASignedZero) {
    EXPECT_EQ(cli::fixed(-0.0001, 2), "0.00");
}

TEST(ReportMarkup, GivesAnIntervalTheDecimalsOfItsValue) {
    const cli::Cell cell = cli::estimate_cell({0.0123, 0.0111, 0.0140}, 100.0);
    EXPECT_EQ(cell.value, "1.23");
    EXPECT_EQ(cell.interval, "1.11 – 1.40");
    EXPECT_EQ(cli::estimate_cell({0.0, 0.0, 0.0456}).interval, "0.0000 – 0.0456");
    EXPECT_EQ(cli::estimate_cell({std::nan(""), std::nan(""), std::nan("")}).interval, "");
    EXPECT_EQ(cli::seconds_cell(0.00002).value, "&lt; 0.001");
    EXPECT_EQ(cli::seconds_cell(0.0123).value, "0.012");
    EXPECT_EQ(cli::seconds_cell(0.0).value, "0");
}

TEST(ReportMarkup, EscapesAndMendsText) {
    EXPECT_EQ(cli::escape_html("<a b=\"c\" d='e'>&"), "&lt;a b=&quot;c&quot; d=&#39;e&#39;&gt;&amp;");
    EXPECT_EQ(cli::escape_html("ü漢\U0001F600\n\t"), "ü漢\U0001F600\n\t");
    const std::string mark = "\uFFFD";
    EXPECT_EQ(cli::escape_html(std::string("a\0b\x1B", 4)), "a" + mark + "b" + mark);
    EXPECT_EQ(cli::escape_html("\xC2\x85"), mark) << "a control character beyond ASCII";
    EXPECT_EQ(cli::escape_html("\xC3"), mark) << "cut short";
    EXPECT_EQ(cli::escape_html("\xC0\xBC"), mark + mark) << "an overlong '<'";
    EXPECT_EQ(cli::escape_html("\xED\xA0\x80"), mark + mark + mark) << "a surrogate";
    EXPECT_EQ(cli::escape_html("\xF4\x90\x80\x80"), mark + mark + mark + mark) << "beyond Unicode";
}

TEST(ReportMarkup, ShortensBetweenCharacters) {
    EXPECT_EQ(cli::shortened("fields", 6), "fields");
    EXPECT_EQ(cli::shortened("fields 128", 6), "field…");
    EXPECT_EQ(cli::shortened("üüüü", 3), "üü…");
    EXPECT_EQ(cli::shortened("", 3), "");
    EXPECT_EQ(cli::shortened("ab", 1), "…");
}

TEST(ReportMarkup, AlignsNumbersAtTheirPoint) {
    const std::string html = cli::table("", {{"a", "", "", true}, {"b"}},
                                        {{{.value = "x"}, {.value = "1.25"}},
                                         {{.value = "y"}, {.value = "100"}},
                                         {{.value = "z"}, {.value = "never"}}});
    EXPECT_NE(html.find(">1<span class=\"fraction\" style=\"width:3ch\">.25</span>"), std::string::npos)
        << html;
    EXPECT_NE(html.find(">100<span class=\"fraction\" style=\"width:3ch\"></span>"), std::string::npos)
        << html;
    EXPECT_NE(html.find(">never</td>"), std::string::npos) << html;
}

TEST(LogAxis, CoversItsRangeWithTicksInside) {
    for (const auto& [low, high] :
         {std::pair{0.3, 0.31}, {1.0, 1.0}, {1e-3, 5e4}, {1e-200, 1e200}, {0.0, 0.0}}) {
        cli::Range range;
        range.include(low);
        range.include(high);
        const cli::LogAxis axis(range, 100.0, 700.0);
        EXPECT_NEAR(axis.at(axis.low()), 100.0, 1e-6);
        EXPECT_NEAR(axis.at(axis.high()), 700.0, 1e-6);
        EXPECT_GE(axis.high() / axis.low(), 9.999) << "at least a decade";
        std::size_t labels = 0;
        double previous = 0.0;
        for (const cli::Tick& tick : axis.ticks()) {
            EXPECT_TRUE(axis.contains(tick.value));
            if (tick.label.empty()) continue;
            ++labels;
            EXPECT_GT(axis.at(tick.value) - previous, 30.0)
                << "labels " << low << " to " << high << " overlap";
            previous = axis.at(tick.value);
        }
        EXPECT_GE(labels, 2u) << low << " to " << high;
        EXPECT_LE(labels, 14u);
    }
}

TEST(LogAxis, IgnoresWhatHasNoLogarithm) {
    cli::Range range;
    for (const double value : {0.0, -1.0, std::nan(""), HUGE_VAL, 2.0}) range.include(value);
    EXPECT_EQ(range.low, 2.0);
    EXPECT_EQ(range.high, 2.0);
}

TEST(LinearTicks, AreRoundAndFew) {
    for (const double high : {0.0123, 0.9, 1.0, 7.0, 414.0, 99999.0}) {
        const auto ticks = cli::linear_ticks(high, 8);
        EXPECT_GE(ticks.size(), 4u) << high;
        EXPECT_LE(ticks.size(), 9u) << high;
        EXPECT_EQ(ticks.front().label.find_first_not_of("0."), std::string::npos);
        EXPECT_LE(ticks.back().value, high * 1.001);
    }
    EXPECT_EQ(cli::linear_ticks(0.5, 5)[1].label, "0.1");
}

}  // namespace
